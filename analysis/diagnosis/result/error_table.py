"""Compute the errors of the given, the re-tuned and the completed model, on fitted and on held-out samples.

Errors are rms residuals over the rms of the measured signal (`compute_signal_rms`), root mean square over the channels,
and are listed with the error that noise alone would leave. For impacts they are errors of the logarithm of band
amplitudes instead.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.document import Errors, Fit
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import compute_residual_rms, compute_signal_rms
from analysis.diagnosis.limits import EQUAL_ERROR_RATIO, HELD_OUT_MISMATCH_ERROR, STILL_SHARE
from analysis.diagnosis.search.explain import Explanation, Statistic
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.types import Mask
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import FloatArray


def compute_fit_errors(measure: ErrorMeasure, explanation: Explanation) -> Fit:
    """Compute the errors for the document (`Fit`). Its `fit` includes the samples to choose by."""
    if explanation.statistic is not None:
        return Fit(
            *(
                _compute_log_errors(explanation, explanation.statistic, roles)
                for roles in (("fit", "choose"), ("test",))
            )
        )
    return Fit(
        _compute_errors(measure, explanation, ("fit", "choose")), _compute_errors(measure, explanation, ("test",))
    )


def collect_channel_errors(explanation: Explanation, names: tuple[str, ...]) -> Mapping[str, Mapping[str, float]]:
    """Collect the rms errors over the test samples, in units of the noise, by stage and channel."""
    stages = {"before": explanation.before, "retuned": explanation.retuned, "after": explanation.after}
    return {stage: dict(zip(names, candidate.score.test.tolist(), strict=True)) for stage, candidate in stages.items()}


def _compute_log_errors(explanation: Explanation, statistic: Statistic, roles: tuple[str, ...]) -> Errors:
    """Compute the rms over the channels and roles of the error of the logarithmic amplitude (`band_power`), with its
    chance variation in place of the noise. roles: of the samples; an error that is not finite becomes None."""

    def compute_error(candidate: FittedCandidate) -> float | None:
        log_errors = np.array([getattr(candidate.score, role) for role in roles]) * statistic.chance
        mean_error = float(np.sqrt(np.mean(log_errors**2)))
        return mean_error if np.isfinite(mean_error) else None

    chance = float(np.sqrt(np.mean(statistic.chance**2)))
    return Errors(
        compute_error(explanation.before), compute_error(explanation.retuned), compute_error(explanation.after), chance
    )


def _compute_errors(measure: ErrorMeasure, explanation: Explanation, roles: tuple[str, ...]) -> Errors:
    """Compute the errors on the samples of these roles, relative to the signal; None where there are no samples, an
    error is not finite, or held-out samples contain no motion. Channels that rest there alone are left out
    (`find_resting_channels`). The error by noise alone is also None where an error is clearly smaller
    (`EQUAL_ERROR_RATIO`)."""
    is_test = roles == ("test",)
    if is_test and is_held_out_still(measure.records, measure.noise):
        return Errors(None, None, None, None)
    masks = [np.logical_or.reduce([getattr(record, role) for role in roles]) for record in measure.records]
    if not any(mask.any() for mask in masks):
        return Errors(None, None, None, None)
    signal_rms = np.maximum(compute_signal_rms(measure.records, masks), np.finfo(float).tiny)
    is_resting = find_resting_channels(measure.records, measure.noise) if is_test else np.zeros(len(signal_rms), bool)

    def compute_error(candidate: FittedCandidate) -> float | None:
        error_ratios = compute_residual_rms(candidate.fitted.residuals, masks) * measure.unit / signal_rms
        mean_error = float(np.sqrt(np.mean(error_ratios[~is_resting] ** 2)))
        return mean_error if np.isfinite(mean_error) else None

    noise = float(np.sqrt(np.mean((measure.noise / signal_rms)[~is_resting] ** 2)))
    given_error, retuned_error, completed_error = (
        compute_error(stage) for stage in (explanation.before, explanation.retuned, explanation.after)
    )
    # An error smaller than the noise refutes the estimate of the noise, such as one from above the driven band.
    is_noise_plausible = all(
        stage is None or noise <= EQUAL_ERROR_RATIO * stage for stage in (given_error, retuned_error, completed_error)
    )
    return Errors(given_error, retuned_error, completed_error, noise if is_noise_plausible else None)


def is_held_out_still(records: Sequence[Observed], noise: FloatArray) -> bool:
    """Whether samples are held out, and every channel's mean square in them is below `STILL_SHARE` of that in the other
    samples, or at its noise, although a channel moves above the noise in the others. Errors on such samples test
    nothing. noise: (c,), rms."""
    moves, rests = _find_motion_and_rest(records, noise)
    return bool(moves.any() and rests.all())


def find_resting_channels(records: Sequence[Observed], noise: FloatArray) -> Mask:
    """Find (c,): channels that rest in the held-out samples, as in `is_held_out_still`, and move in the others. Any
    error is large relative to their signal there. noise: (c,), rms."""
    moves, rests = _find_motion_and_rest(records, noise)
    return moves & rests


def _find_motion_and_rest(records: Sequence[Observed], noise: FloatArray) -> tuple[Mask, Mask]:
    """Find (c,) each: whether a channel moves above the noise in the samples that are not held out, and whether it
    rests in the held-out ones; none of both where nothing is held out. noise: (c,), rms."""
    if not any(record.test.any() for record in records):
        nothing = np.zeros(len(noise), dtype=np.bool_)
        return nothing, nothing
    held_out_power = _compute_mean_power(records, [record.test for record in records])
    fitted_power = _compute_mean_power(records, [record.fit | record.choose for record in records])
    # A channel that contains only noise is never below a share of that in the fitted samples.
    still_power = np.fmax(STILL_SHARE * fitted_power, (HELD_OUT_MISMATCH_ERROR * noise) ** 2)
    moves: Mask = np.asarray(STILL_SHARE * fitted_power > noise**2, dtype=np.bool_)
    return moves, np.asarray(held_out_power <= still_power, dtype=np.bool_)


def _compute_mean_power(records: Sequence[Observed], masks: Sequence[Mask]) -> FloatArray:
    """Compute (c,): mean square of each channel about its rest value, over the masked samples."""
    deviations = [_subtract_rest(record, mask)[mask] for record, mask in zip(records, masks, strict=True)]
    return np.asarray(np.nanmean(np.concatenate(deviations) ** 2, axis=0))


def _subtract_rest(record: Observed, mask: Mask) -> FloatArray:
    """Subtract the rest value, (n, c): 0 for speeds, for other channels their mean over the masked samples; nothing
    where no sample is masked."""
    signals = (record.recording.response, record.recording.position)
    quantities = [quantity for signal in signals if signal is not None for quantity in signal.quantities]
    is_speed = [DERIVATIVE_OF_QUANTITY.get(quantity) == 1 for quantity in quantities[: record.measured.shape[1]]]
    if not mask.any():
        return record.measured
    return np.asarray(record.measured - np.where(is_speed, 0.0, np.nanmean(record.measured[mask], axis=0)))
