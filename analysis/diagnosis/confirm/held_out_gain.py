"""Share of the held-out error power that an effect explains, with a 95 % interval by block bootstrap.

    gain = 1 - mean over channels of (E_with / E_without),    E: sum of squared residuals on held-out samples

Channels that contain only noise without and with the effect are not counted (`_find_channels_above_noise`).
No model of a real device reaches the sensors' noise, so an effect is judged by its prediction of held-out samples, not
by the residual in units of noise. Stretches are resampled as blocks, because residuals are correlated (Kunsch, Ann.
Stat. 17:1217, 1989).
"""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.correlated_residuals import draw_bootstrap_blocks
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import compute_residual_rms, compute_signal_rms
from analysis.diagnosis.limits import (
    BOOTSTRAP_LEVEL,
    HELD_OUT_MISMATCH_ERROR,
    HELD_OUT_STRETCHES,
    LEAST_HELD_OUT_STRETCHES,
)
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.types import Mask
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


def estimate_held_out_gain(
    measure: ErrorMeasure, baseline: FittedCandidate, candidate: FittedCandidate
) -> HeldOutGain | None:
    """Estimate the gain of `candidate` over `baseline`, both fitted with this measure. None where fewer than
    `LEAST_HELD_OUT_STRETCHES` stretches are held out, or where a held-out residual is not finite."""
    powers_without, powers_with = (_compute_stretch_powers(measure, fitted) for fitted in (baseline, candidate))
    if len(powers_without) < LEAST_HELD_OUT_STRETCHES or not (
        np.isfinite(powers_without).all() and np.isfinite(powers_with).all()
    ):
        return None
    # Each channel in units of its residual without the effect, so that no channel dominates.
    channel_powers = np.maximum(powers_without.sum(axis=0), np.finfo(float).tiny)
    counted = _find_channels_above_noise(measure, np.maximum(powers_without.sum(axis=0), powers_with.sum(axis=0)))
    scaled_without, scaled_with = (
        (powers_without / channel_powers)[:, counted].mean(axis=1),
        (powers_with / channel_powers)[:, counted].mean(axis=1),
    )
    drawn_stretches = draw_bootstrap_blocks(len(scaled_without))
    bootstrap_gains = 1 - scaled_with[drawn_stretches].sum(axis=1) / np.maximum(
        scaled_without[drawn_stretches].sum(axis=1), np.finfo(float).tiny
    )
    low, high = np.quantile(bootstrap_gains, [BOOTSTRAP_LEVEL, 1 - BOOTSTRAP_LEVEL])
    return HeldOutGain(float(1 - scaled_with.sum() / scaled_without.sum()), float(low), float(high))


def _find_channels_above_noise(measure: ErrorMeasure, powers: FloatArray) -> Mask:
    """Find (c,): channels with more than noise (`HELD_OUT_MISMATCH_ERROR`) in the held-out residuals; all where there
    is none. powers: (c,), sums of squares as in `_compute_stretch_powers`. In a channel of noise alone, such as that of
    another axis, no effect could explain anything."""
    sample_count = sum(int(record.test.sum()) for record in measure.records)
    is_above_noise = powers > sample_count * (HELD_OUT_MISMATCH_ERROR * measure.noise / measure.unit) ** 2
    return is_above_noise if is_above_noise.any() else ~is_above_noise


def predicts_motion(measure: ErrorMeasure, candidate: FittedCandidate) -> bool:
    """Whether the model with its effects predicts a held-out motion better than the mean of that motion does; not where
    residuals are not finite. Channels that contain only noise are not counted. True without a test where forces are
    compared, nothing is held out, or no channel is counted."""
    return measure.name == "predicted force" or _compute_remaining_share(measure, candidate, 0.0) < 1


def explains_half(measure: ErrorMeasure, candidate: FittedCandidate) -> bool:
    """Whether the model with its effects explains more than half of the held-out power beyond noise (chosen: with less,
    its law may only be the best substitute for a law that was not found), and passes `predicts_motion`. True where
    nothing is held out, or all channels contain only noise."""
    return predicts_motion(measure, candidate) and _compute_remaining_share(measure, candidate, 1.0) < 0.5


def _compute_remaining_share(measure: ErrorMeasure, candidate: FittedCandidate, noise_factor: float) -> float:
    """Compute the mean over channels of (e^2 - k n^2) / (s^2 - k n^2) on held-out samples: rms residual e, rms signal
    s, rms noise n, and k = noise_factor (1 subtracts the noise power, 0 does not). Channels with s up to
    `HELD_OUT_MISMATCH_ERROR` n are left out; 0 where none remains, or nothing is held out."""
    masks = [record.test for record in measure.records]
    if not any(mask.any() for mask in masks):
        return 0.0
    residual_rms = compute_residual_rms(candidate.fitted.residuals, masks) * measure.unit
    channel_rms = compute_signal_rms(measure.records, masks)
    is_above_noise = channel_rms > HELD_OUT_MISMATCH_ERROR * measure.noise
    if not is_above_noise.any():
        return 0.0
    noise_power = noise_factor * measure.noise[is_above_noise] ** 2
    return float(
        np.mean((residual_rms[is_above_noise] ** 2 - noise_power) / (channel_rms[is_above_noise] ** 2 - noise_power))
    )


def _compute_stretch_powers(measure: ErrorMeasure, candidate: FittedCandidate) -> FloatArray:
    """Compute (stretches, c): sums of squares of the held-out residuals, in units of `measure.unit`. All records
    together are cut into about `HELD_OUT_STRETCHES` consecutive stretches, at least one per record with held-out
    samples."""
    total_samples = sum(int(record.test.sum()) for record in measure.records)
    power_sums = []
    for record, residuals in zip(measure.records, candidate.fitted.residuals, strict=True):
        indices = np.flatnonzero(record.test)
        if len(indices):
            stretch_count = int(np.clip(round(HELD_OUT_STRETCHES * len(indices) / total_samples), 1, len(indices)))
            power_sums += [
                np.sum(residuals[stretch] ** 2, axis=0) for stretch in np.array_split(indices, stretch_count)
            ]
    return np.reshape(power_sums, (len(power_sums), candidate.fitted.residuals[0].shape[1]))
