"""From the command to the force that acts, compiled: amplifier and motor of each axis, at the mechanism's step."""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray

GAIN, LIMIT, DEAD, RATE, LAG_S, DELAY_S, FADE, FADE_S, HELD = range(9)
"""Columns of an axis: a factor; N, 0 = none; N, half the dead band; N/s, 0 = none; s; s; loss of force per N^2 of mean
square and the seconds over which that mean is taken; N, half the play of a hysteresis between command and force."""


@njit(cache=True, nogil=True)
def drive(command: FloatArray, axes: FloatArray, steps: int, rate_hz: float) -> FloatArray:
    """command: (samples, 3), each held for `steps` steps. axes: (3, 9). Returns (samples * steps, 3), N."""
    samples, h = command.shape[0], 1.0 / (rate_hz * steps)
    force = np.zeros((samples * steps, 3))
    for j in range(3):
        row = axes[j]
        late = row[DELAY_S] / h
        whole = int(late)
        sent, made, warm, held = 0.0, 0.0, 0.0, 0.0
        for k in range(samples * steps):
            wanted = (1.0 - (late - whole)) * _command(command, j, k - whole, steps)
            wanted += (late - whole) * _command(command, j, k - whole - 1, steps)
            wanted = _banded(wanted, row[DEAD])
            held = min(max(held, wanted - row[HELD]), wanted + row[HELD])
            sent = _slewed(sent, held, row[RATE] * h)
            limited = min(max(sent, -row[LIMIT]), row[LIMIT]) if row[LIMIT] > 0.0 else sent
            made = made + (limited - made) * h / row[LAG_S] if row[LAG_S] > h else limited
            if row[FADE] > 0.0:
                warm += (made * made - warm) * h / row[FADE_S]
            force[k, j] = row[GAIN] * (1.0 - row[FADE] * warm) * made
    return force


@njit(cache=True, nogil=True)
def _command(command: FloatArray, axis: int, step: int, steps: int) -> float:
    value: float = command[step // steps, axis] if step >= 0 else 0.0
    return value


@njit(cache=True, nogil=True)
def _banded(wanted: float, dead: float) -> float:
    return max(wanted - dead, 0.0) + min(wanted + dead, 0.0) if dead > 0.0 else wanted


@njit(cache=True, nogil=True)
def _slewed(sent: float, wanted: float, most: float) -> float:
    return sent + min(max(wanted - sent, -most), most) if most > 0.0 else wanted
