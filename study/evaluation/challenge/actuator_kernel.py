"""Force of each amplifier and motor from the command, at the mechanism's integration step (compiled).

In this order: delay (interpolated between steps), dead band, hysteresis (play operator), slew limit, saturation,
first-order lag (explicit Euler), and a gain that falls with the averaged square of the force, as by heating.
"""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray

GAIN, LIMIT, DEAD, RATE, LAG_S, DELAY_S, FADE, FADE_S, HELD = range(9)
"""Columns of an axis: gain factor; limit (N, 0 = none); half width of the dead band (N); slew rate (N/s, 0 = none);
time constant of the lag (s, 0 = none); delay (s); relative loss of force per N^2 of mean square, and the averaging time
of that mean (s); half width of the hysteresis between command and force (N)."""


@njit(cache=True, nogil=True)
def drive(command: FloatArray, axes: FloatArray, steps: int, rate_hz: float) -> FloatArray:
    """Actuator force, (samples * steps, 3), N. command: (samples, 3), N, each sample held for `steps` steps. axes: (3,
    9), columns above. A lag of at most a step is ignored."""
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
            wanted = _dead_band(wanted, row[DEAD])
            held = min(max(held, wanted - row[HELD]), wanted + row[HELD])
            sent = _limit_slew(sent, held, row[RATE] * h)
            limited = min(max(sent, -row[LIMIT]), row[LIMIT]) if row[LIMIT] > 0.0 else sent
            made = made + (limited - made) * h / row[LAG_S] if row[LAG_S] > h else limited
            if row[FADE] > 0.0:
                warm += (made * made - warm) * h / row[FADE_S]
            force[k, j] = row[GAIN] * (1.0 - row[FADE] * warm) * made
    return force


@njit(cache=True, nogil=True)
def _command(command: FloatArray, axis: int, step: int, steps: int) -> float:
    """Command of an axis at an integration step, N; zero before the start."""
    value: float = command[step // steps, axis] if step >= 0 else 0.0
    return value


@njit(cache=True, nogil=True)
def _dead_band(wanted: float, dead: float) -> float:
    """Command after a dead band of half width `dead`, N."""
    return max(wanted - dead, 0.0) + min(wanted + dead, 0.0) if dead > 0.0 else wanted


@njit(cache=True, nogil=True)
def _limit_slew(sent: float, wanted: float, most: float) -> float:
    """`sent`, moved towards `wanted` by at most `most`, N; 0 = no limit."""
    return sent + min(max(wanted - sent, -most), most) if most > 0.0 else wanted
