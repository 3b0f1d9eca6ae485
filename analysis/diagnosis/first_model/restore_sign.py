"""Restores the sign of a speed whose sensor shows its magnitude only, such as a pulse counter, from the command.

Between two minima near zero the sign is constant. It is that of the speed which an FIR filter predicts from the
command, and the filter is fitted to the signed speed in turn, until the signs no longer change (alternating
projections, as in phase retrieval; Gerchberg and Saxton, Optik 35:237, 1972). A step of `one_motion_per_force`.
"""

import itertools
from dataclasses import replace

import numpy as np

from analysis.diagnosis.settings import (
    PUSHED_BOTH_WAYS,
    REVERSAL_NEAR_ZERO,
    SIGNED_SPEED_BETTER,
    SIGNED_SPEED_FITS,
    UNSIGNED_BELOW_ZERO,
)
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

FILTER_TAPS, RIDGE_SHARE, MOST_FITS = 40, 1e-3, 20
"""Taps of the filter (samples), ridge parameter over the mean power of a tap, and largest number of fits."""


def restore_sign(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """The recordings with signed speeds, and a sentence about it. Unchanged, with an empty sentence, where a recording
    holds more than one unsigned speed and its command, or where the filter predicts the signed speed too poorly
    (`SIGNED_SPEED_FITS`, `SIGNED_SPEED_BETTER`)."""
    if any(not _is_unsigned_speed(recording) for recording in recordings):
        return recordings, ""
    restored = []
    for recording in recordings:
        magnitude = recording.response.samples[:, 0]
        signed, unexplained = _find_signs(recording.command.samples[:, 0], magnitude)
        unsigned_unexplained = _compute_unexplained_share(recording.command.samples[:, 0], magnitude)
        if unexplained > 1 - SIGNED_SPEED_FITS or unexplained > SIGNED_SPEED_BETTER * unsigned_unexplained:
            return recordings, ""
        restored.append(replace(recording, response=replace(recording.response, samples=signed[:, None])))
    name = recordings[0].response.channels[0]
    return tuple(restored), (
        f"{name} is never negative though the command pushes both ways: its sensor measures the absolute value only, "
        "so the sign was restored from the command."
    )


def _is_unsigned_speed(recording: Recording) -> bool:
    """Whether the only response is never negative and often near zero, though the only command has both signs."""
    response, command = recording.response, recording.command
    if len(response.channels) != 1 or len(command.channels) != 1 or recording.position is not None:
        return False
    speed, force = response.samples[:, 0], command.samples[:, 0]
    if DERIVATIVE_OF_QUANTITY.get(response.quantities[0]) not in (1, 0) or not np.isfinite(speed).all():
        return False
    rms = float(np.sqrt(np.mean(speed**2)))
    command_power = float(np.sum(force**2))
    sign_powers = [float(np.sum(force[force * sign > 0] ** 2)) for sign in (1, -1)]
    reaches_zero = float(np.quantile(speed, 0.05)) < REVERSAL_NEAR_ZERO * rms
    return (
        rms > 0
        and float(speed.min()) > -UNSIGNED_BELOW_ZERO * rms
        and reaches_zero
        and min(sign_powers) > PUSHED_BOTH_WAYS * command_power
    )


def _find_signs(command: FloatArray, magnitude: FloatArray) -> tuple[FloatArray, float]:
    """The signed speed (n,), and the share of its power that the filter does not predict."""
    regressors = _build_regressors(command)
    stretches = _split_at_minima(magnitude)
    cumulative = np.concatenate([[0.0], np.cumsum(command)])
    recent_sums = [cumulative[k + 1] - cumulative[max(k + 1 - FILTER_TAPS // 4, 0)] for k in range(len(command))]
    signed_speed = _assign_signs(magnitude, np.array(recent_sums), stretches)
    for _ in range(MOST_FITS):
        next_speed = _assign_signs(magnitude, _predict_speed(regressors, signed_speed), stretches)
        if np.array_equal(next_speed, signed_speed):
            break
        signed_speed = next_speed
    return signed_speed, float(
        np.sum((signed_speed - _predict_speed(regressors, signed_speed)) ** 2) / np.sum(signed_speed**2)
    )


def _compute_unexplained_share(command: FloatArray, magnitude: FloatArray) -> float:
    """Error of the filter for the magnitude itself, its mean subtracted, as a share of the magnitude's power."""
    regressors, centred = _build_regressors(command), magnitude - magnitude.mean()
    return float(np.sum((centred - _predict_speed(regressors, centred)) ** 2) / np.sum(magnitude**2))


def _build_regressors(command: FloatArray) -> FloatArray:
    """(n, TAPS + 1): the last TAPS samples of the command at each instant, and a constant."""
    padded = np.concatenate([np.zeros(FILTER_TAPS), command])
    return np.column_stack(
        [*(padded[FILTER_TAPS - k : len(padded) - k] for k in range(FILTER_TAPS)), np.ones(len(command))]
    )


def _predict_speed(regressors: FloatArray, speed: FloatArray) -> FloatArray:
    """(n,): prediction of the speed by ridge regression on the rows."""
    gram = regressors.T @ regressors
    weights = np.linalg.solve(gram + RIDGE_SHARE * np.trace(gram) / len(gram) * np.eye(len(gram)), regressors.T @ speed)
    return np.asarray(regressors @ weights)


def _split_at_minima(magnitude: FloatArray) -> list[slice]:
    """Stretches between local minima of the magnitude below `REVERSAL_NEAR_ZERO` of its rms."""
    threshold = REVERSAL_NEAR_ZERO * float(np.sqrt(np.mean(magnitude**2)))
    is_minimum = (
        (magnitude[1:-1] <= magnitude[:-2]) & (magnitude[1:-1] <= magnitude[2:]) & (magnitude[1:-1] < threshold)
    )
    ends = [0, *(np.flatnonzero(is_minimum) + 1).tolist(), len(magnitude)]
    return [slice(start, end) for start, end in itertools.pairwise(ends) if end > start]


def _assign_signs(magnitude: FloatArray, predicted: FloatArray, stretches: list[slice]) -> FloatArray:
    """(n,): the magnitude, negative in each stretch in which its product with the predicted speed is negative."""
    signed = magnitude.copy()
    for stretch in stretches:
        if float(magnitude[stretch] @ predicted[stretch]) < 0:
            signed[stretch] = -magnitude[stretch]
    return signed
