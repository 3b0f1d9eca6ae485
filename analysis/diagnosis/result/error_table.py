"""Table of errors of the given, the re-tuned and the completed model, on fitted and on held-out samples.

Errors are rms residuals over the rms of the measured signal (`signal_rms`), root mean square over the channels, and are
listed with the error that noise alone would leave. For impacts they are errors of the logarithm of band
amplitudes instead.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.document import Errors, Fit
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import rms_over, signal_rms
from analysis.diagnosis.search.explain import Explanation, Statistic
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.settings import HELD_OUT_SURPRISE, SAME_TO_READERS, STILL_SHARE
from analysis.diagnosis.types import Mask
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import FloatArray


def errors_of(measure: ErrorMeasure, found: Explanation) -> Fit:
    """The table for the document (`Fit`). "fit" includes the samples to choose by."""
    if found.statistic is not None:
        return Fit(*(_log_errors(found, found.statistic, parts) for parts in (("fit", "choose"), ("test",))))
    return Fit(_errors(measure, found, ("fit", "choose")), _errors(measure, found, ("test",)))


def channel_errors(found: Explanation, names: tuple[str, ...]) -> Mapping[str, Mapping[str, float]]:
    """Rms errors over the test samples, in units of the noise, by stage and channel."""
    stages = {"before": found.before, "retuned": found.retuned, "after": found.after}
    return {stage: dict(zip(names, candidate.score.test.tolist(), strict=True)) for stage, candidate in stages.items()}


def _log_errors(found: Explanation, statistic: Statistic, parts: tuple[str, ...]) -> Errors:
    """Rms over the channels of the error of ln a (`band_power`), and its chance value in place of the noise. parts:
    roles of the samples."""

    def error(candidate: FittedCandidate) -> float | None:
        off = np.array([getattr(candidate.score, part) for part in parts]) * statistic.chance
        whole = float(np.sqrt(np.mean(off**2)))
        return whole if np.isfinite(whole) else None

    chance = float(np.sqrt(np.mean(statistic.chance**2)))
    return Errors(error(found.before), error(found.retuned), error(found.after), chance)


def _errors(measure: ErrorMeasure, found: Explanation, parts: tuple[str, ...]) -> Errors:
    """Normalised errors on the samples of these roles; None where there are none, or where held-out samples contain no
    motion."""
    if parts == ("test",) and held_out_stands_still(measure.records, measure.noise):
        return Errors(None, None, None, None)
    masks = [np.logical_or.reduce([getattr(record, part) for part in parts]) for record in measure.records]
    if not any(mask.any() for mask in masks):
        return Errors(None, None, None, None)
    size = np.maximum(signal_rms(measure.records, masks), np.finfo(float).tiny)

    def error(candidate: FittedCandidate) -> float | None:
        rms = rms_over(measure.records, candidate.fitted.residuals, masks) * measure.unit / size
        whole = float(np.sqrt(np.mean(rms**2)))
        return whole if np.isfinite(whole) else None

    noise = float(np.sqrt(np.mean((measure.noise / size) ** 2)))
    before, retuned, after = (error(each) for each in (found.before, found.retuned, found.after))
    # An error smaller than the noise refutes the estimate of the noise, such as one from above the driven band.
    known = all(each is None or noise <= SAME_TO_READERS * each for each in (before, retuned, after))
    return Errors(before, retuned, after, noise if known else None)


def held_out_stands_still(records: Sequence[Observed], noise: FloatArray) -> bool:
    """Whether samples are held out, and every channel's mean square in them is below `STILL_SHARE` of that in the other
    samples, or at its noise, although a channel moves above the noise in the others. Errors on such samples test
    nothing. noise: (c,), rms."""
    if not any(each.test.any() for each in records):
        return False
    held = _mean_power(records, [each.test for each in records])
    known = _mean_power(records, [each.fit | each.choose for each in records])
    # A channel that contains only noise is never below a share of that in the fitted samples.
    still = np.fmax(STILL_SHARE * known, (HELD_OUT_SURPRISE * noise) ** 2)
    return bool((STILL_SHARE * known > noise**2).any() and (held <= still).all())


def _mean_power(records: Sequence[Observed], masks: Sequence[Mask]) -> FloatArray:
    """(c,): mean square of each channel about its rest value, over the masked samples."""
    moved = [_about_rest(each, mask)[mask] for each, mask in zip(records, masks, strict=True)]
    return np.asarray(np.nanmean(np.concatenate(moved) ** 2, axis=0))


def _about_rest(record: Observed, mask: Mask) -> FloatArray:
    """(n, c): speeds unchanged, because rest is zero; other channels about their mean over the masked samples."""
    signals = (record.recording.response, record.recording.position)
    quantities = [word for signal in signals if signal is not None for word in signal.quantities]
    speeds = [DERIVATIVE_OF_QUANTITY.get(word) == 1 for word in quantities[: record.measured.shape[1]]]
    if not mask.any():
        return record.measured
    return np.asarray(record.measured - np.where(speeds, 0.0, np.nanmean(record.measured[mask], axis=0)))
