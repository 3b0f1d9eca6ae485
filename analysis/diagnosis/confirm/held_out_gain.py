"""The share of the held-out error power that an effect takes, with an interval by block bootstrap.

No model of a real device reaches the sensors' noise, so that an effect is judged by its prediction of held-out samples,
not by the residual in units of noise. Stretches are resampled as blocks, because residuals are correlated (Kunsch, Ann.
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
    """Shares of the error power that an effect explains, in the mean over the channels."""

    gain: float
    low: float
    """Lower bound of the 95 % interval."""
    high: float
    """Upper bound of the 95 % interval."""


def held_out_gain(measure: ErrorMeasure, without: FittedCandidate, with_it: FittedCandidate) -> HeldOutGain | None:
    """The gain of one candidate over another. measure: with the held-out samples, as both candidates' fits. None where
    too little is held out."""
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
    """Whether a completed model predicts a held-out motion better than its mean would: a law that only stabilises an
    unstable model does not. Channels that contain only noise do not count. True where forces are compared, or no motion
    is held out."""
    return measure.name == "predicted force" or _share_left(measure, candidate, 0.0) < 1


def explains_half(measure: ErrorMeasure, candidate: FittedCandidate) -> bool:
    """Whether a completed model explains at least half of the held-out power beyond noise: with less, a law may only be
    the best substitute for one that was not found. True where no motion is held out."""
    return predicts_something(measure, candidate) and _share_left(measure, candidate, 1.0) < 0.5


def _share_left(measure: ErrorMeasure, candidate: FittedCandidate, noise_taken: float) -> float:
    """Share of the held-out signal power that is left, in the mean over the channels that hold more than noise.
    noise_taken: 1 to count out what noise alone leaves of both, 0 to count it in."""
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
    """(stretches, c): sums of squares of the held-out residuals."""
    total = sum(int(record.test.sum()) for record in measure.records)
    found = []
    for record, residuals in zip(measure.records, candidate.fitted.residuals, strict=True):
        places = np.flatnonzero(record.test)
        if len(places):
            count = int(np.clip(round(HELD_OUT_STRETCHES * len(places) / total), 1, len(places)))
            found += [np.sum(residuals[part] ** 2, axis=0) for part in np.array_split(places, count)]
    return np.array(found).reshape(len(found), -1)
