"""Restore the sign of a speed or position whose sensor measures its magnitude only, from the command.

Between two minima near zero the sign is taken to be constant. It is that of the speed which an FIR filter predicts from
the command, and the filter is fitted to the signed speed in turn, until the signs no longer change or `MAX_FITS` is
reached (alternating projections, as in phase retrieval; Gerchberg and Saxton, Optik 35:237, 1972).
"""

import itertools
from dataclasses import replace

import numpy as np

from analysis.diagnosis.limits import (
    LEAST_SIGN_SHARE,
    REVERSAL_SPEED_SHARE,
    SIGNED_SPEED_ERROR_RATIO,
    SIGNED_SPEED_FIT_SHARE,
    UNSIGNED_NEGATIVE_SHARE,
)
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

FILTER_TAPS, RIDGE_SHARE, MAX_FITS = 40, 1e-3, 20
"""Taps of the filter (samples), ridge parameter over the mean diagonal element of the Gram matrix, and largest number
of fits. Chosen by hand."""


def restore_sign(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """Return the recordings with signed speeds, and a sentence about it. All are returned unchanged, with an empty
    sentence, where one of them is not an unsigned speed with a single command (`_is_unsigned_speed`), or where the
    filter predicts a signed speed too poorly (`SIGNED_SPEED_FIT_SHARE`, `SIGNED_SPEED_ERROR_RATIO`). At least one
    recording."""
    if any(not _is_unsigned_speed(recording) for recording in recordings):
        return recordings, ""
    restored_recordings = []
    for recording in recordings:
        magnitude = recording.response.samples[:, 0]
        signed_speed, unexplained_share = _estimate_signed_speed(recording.command.samples[:, 0], magnitude)
        unsigned_unexplained_share = _compute_unexplained_share(recording.command.samples[:, 0], magnitude)
        if (
            unexplained_share > 1 - SIGNED_SPEED_FIT_SHARE
            or unexplained_share > SIGNED_SPEED_ERROR_RATIO * unsigned_unexplained_share
        ):
            return recordings, ""
        restored_recordings.append(
            replace(recording, response=replace(recording.response, samples=signed_speed[:, None]))
        )
    name = recordings[0].response.channels[0]
    return tuple(restored_recordings), (
        f"{name} is never negative though the command pushes both ways: its sensor measures the absolute value only, "
        "so the sign was restored from the command."
    )


def _is_unsigned_speed(recording: Recording) -> bool:
    """Whether no position was recorded and the only response, a speed or position without NaN, stays above
    -`UNSIGNED_NEGATIVE_SHARE` of its rms and is below `REVERSAL_SPEED_SHARE` of its rms in about 5 % of the samples or
    more, though each sign of the only command has more than `LEAST_SIGN_SHARE` of its power."""
    response, command = recording.response, recording.command
    if len(response.channels) != 1 or len(command.channels) != 1 or recording.position is not None:
        return False
    speed, force = response.samples[:, 0], command.samples[:, 0]
    if DERIVATIVE_OF_QUANTITY.get(response.quantities[0]) not in (1, 0) or not np.isfinite(speed).all():
        return False
    rms = float(np.sqrt(np.mean(speed**2)))
    command_power = float(np.sum(force**2))
    powers_by_sign = [float(np.sum(force[force * sign > 0] ** 2)) for sign in (1, -1)]
    is_often_near_zero = float(np.quantile(speed, 0.05)) < REVERSAL_SPEED_SHARE * rms
    return (
        rms > 0
        and float(speed.min()) > -UNSIGNED_NEGATIVE_SHARE * rms
        and is_often_near_zero
        and min(powers_by_sign) > LEAST_SIGN_SHARE * command_power
    )


def _estimate_signed_speed(command: FloatArray, magnitude: FloatArray) -> tuple[FloatArray, float]:
    """Estimate the signed speed (n,), and the share of its power that the filter does not predict. The signs of the
    first iterate are those of the command's sum over the latest quarter of the taps, a time chosen by hand."""
    regressors = _build_regressors(command)
    stretches = _split_at_minima(magnitude)
    command_sums = np.concatenate([[0.0], np.cumsum(command)])
    recent_impulses = [
        command_sums[sample_index + 1] - command_sums[max(sample_index + 1 - FILTER_TAPS // 4, 0)]
        for sample_index in range(len(command))
    ]
    signed_speed = _assign_signs(magnitude, np.array(recent_impulses), stretches)
    for _ in range(MAX_FITS):
        next_speed = _assign_signs(magnitude, _predict_speed(regressors, signed_speed), stretches)
        if np.array_equal(next_speed, signed_speed):
            break
        signed_speed = next_speed
    return signed_speed, float(
        np.sum((signed_speed - _predict_speed(regressors, signed_speed)) ** 2) / np.sum(signed_speed**2)
    )


def _compute_unexplained_share(command: FloatArray, magnitude: FloatArray) -> float:
    """Compute the error power of the filter for the magnitude itself, its mean subtracted, over the magnitude's
    power."""
    regressors, centred = _build_regressors(command), magnitude - magnitude.mean()
    return float(np.sum((centred - _predict_speed(regressors, centred)) ** 2) / np.sum(magnitude**2))


def _build_regressors(command: FloatArray) -> FloatArray:
    """Build the regressors (n, FILTER_TAPS + 1): the last FILTER_TAPS samples of the command up to each instant (zero
    before the first), and a constant."""
    padded = np.concatenate([np.zeros(FILTER_TAPS), command])
    return np.column_stack(
        [
            *(padded[FILTER_TAPS - lag_samples : len(padded) - lag_samples] for lag_samples in range(FILTER_TAPS)),
            np.ones(len(command)),
        ]
    )


def _predict_speed(regressors: FloatArray, speed: FloatArray) -> FloatArray:
    """Predict the speed (n,) by ridge regression on regressors (n, k)."""
    gram = regressors.T @ regressors
    weights = np.linalg.solve(gram + RIDGE_SHARE * np.trace(gram) / len(gram) * np.eye(len(gram)), regressors.T @ speed)
    return np.asarray(regressors @ weights)


def _split_at_minima(magnitude: FloatArray) -> list[slice]:
    """Split the samples at local minima of the magnitude below `REVERSAL_SPEED_SHARE` of its rms; each starts a
    slice."""
    threshold = REVERSAL_SPEED_SHARE * float(np.sqrt(np.mean(magnitude**2)))
    is_minimum = (
        (magnitude[1:-1] <= magnitude[:-2]) & (magnitude[1:-1] <= magnitude[2:]) & (magnitude[1:-1] < threshold)
    )
    boundaries = [0, *(np.flatnonzero(is_minimum) + 1).tolist(), len(magnitude)]
    return [slice(start, end) for start, end in itertools.pairwise(boundaries) if end > start]


def _assign_signs(magnitude: FloatArray, predicted_speed: FloatArray, stretches: list[slice]) -> FloatArray:
    """Return the magnitude (n,), negated in each stretch in which its inner product with the predicted speed is
    negative."""
    signed_speed = magnitude.copy()
    for stretch in stretches:
        if float(magnitude[stretch] @ predicted_speed[stretch]) < 0:
            signed_speed[stretch] = -magnitude[stretch]
    return signed_speed
