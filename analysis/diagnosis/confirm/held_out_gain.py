"""Share of the held-out error power that an effect explains, with a 95 % interval by block bootstrap.

    gain = 1 - mean over channels of (E_with / E_without),    E: sum of squared residuals on held-out samples

No model of a real device reaches the sensors' noise, so an effect is judged by its prediction of held-out samples, not
by the residual in units of noise. Stretches are resampled as blocks, because residuals are correlated (Kunsch, Ann.
Stat. 17:1217, 1989).
"""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.correlated_residuals import bootstrap_draws
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import rms_over, signal_rms
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.settings import BOOTSTRAP_LEVEL, HELD_OUT_STRETCHES, HELD_OUT_SURPRISE, LEAST_HELD_OUT_STRETCHES
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class HeldOutGain:
    """Share of the held-out error power that an effect explains (at most 1), with its interval."""

    gain: float
    """Estimate from all stretches; below 0 where the effect makes the prediction worse."""
    low: float
    """Lower bound of the 95 % interval."""
    high: float
    """Upper bound of the 95 % interval."""


def held_out_gain(measure: ErrorMeasure, without: FittedCandidate, with_it: FittedCandidate) -> HeldOutGain | None:
    """The gain of the candidate `with_it` over the candidate `without`, both fitted with this measure. None where fewer
    than `LEAST_HELD_OUT_STRETCHES` are held out, or where a residual is not finite."""
    left, right = (_powers(measure, each) for each in (without, with_it))
    if len(left) < LEAST_HELD_OUT_STRETCHES or not (np.isfinite(left).all() and np.isfinite(right).all()):
        return None
    # Each channel in units of its residual without the effect, so that no channel dominates.
    size = np.maximum(left.sum(axis=0), np.finfo(float).tiny)
    before, after = (left / size).mean(axis=1), (right / size).mean(axis=1)
    drawn = bootstrap_draws(len(before))
    shares = 1 - after[drawn].sum(axis=1) / np.maximum(before[drawn].sum(axis=1), np.finfo(float).tiny)
    low, high = np.quantile(shares, [BOOTSTRAP_LEVEL, 1 - BOOTSTRAP_LEVEL])
    return HeldOutGain(float(1 - after.sum() / before.sum()), float(low), float(high))


def predicts_something(measure: ErrorMeasure, candidate: FittedCandidate) -> bool:
    """Whether the model with its effects predicts a held-out motion better than the mean of that motion does. A law
    that only stabilises an unstable model fails this test. Channels that contain only noise are not counted. True
    without a test where forces are compared, or where no motion is held out."""
    return measure.name == "predicted force" or _share_left(measure, candidate, 0.0) < 1


def explains_half(measure: ErrorMeasure, candidate: FittedCandidate) -> bool:
    """Whether the model with its effects explains more than half of the held-out power beyond noise. With less, its law
    may only be the best substitute for a law that was not found. True where no motion is held out."""
    return predicts_something(measure, candidate) and _share_left(measure, candidate, 1.0) < 0.5


def _share_left(measure: ErrorMeasure, candidate: FittedCandidate, noise_taken: float) -> float:
    """Mean over channels of (e^2 - k n^2) / (s^2 - k n^2) on held-out samples: rms residual e, rms signal s, rms noise
    n, and k = noise_taken (1 subtracts the noise power, 0 does not). Channels with s up to `HELD_OUT_SURPRISE` n are
    left out; 0 where none remains, or nothing is held out."""
    masks = [record.test for record in measure.records]
    if not any(mask.any() for mask in masks):
        return 0.0
    left = rms_over(measure.records, candidate.fitted.residuals, masks) * measure.unit
    size = signal_rms(measure.records, masks)
    moves = size > HELD_OUT_SURPRISE * measure.noise
    if not moves.any():
        return 0.0
    noise = noise_taken * measure.noise[moves] ** 2
    return float(np.mean((left[moves] ** 2 - noise) / (size[moves] ** 2 - noise)))


def _powers(measure: ErrorMeasure, candidate: FittedCandidate) -> FloatArray:
    """(stretches, c): sums of squares of the held-out residuals, in units of `measure.unit`. All records together are
    cut into about `HELD_OUT_STRETCHES` consecutive stretches, at least one per record."""
    total = sum(int(record.test.sum()) for record in measure.records)
    found = []
    for record, residuals in zip(measure.records, candidate.fitted.residuals, strict=True):
        places = np.flatnonzero(record.test)
        if len(places):
            count = int(np.clip(round(HELD_OUT_STRETCHES * len(places) / total), 1, len(places)))
            found += [np.sum(residuals[part] ** 2, axis=0) for part in np.array_split(places, count)]
    return np.array(found).reshape(len(found), -1)
