"""Force of each amplifier and motor from the command, at the mechanism's integration step (compiled).

In this order: delay (interpolated between steps), dead band, hysteresis (play operator), slew limit, saturation,
first-order lag (explicit Euler), and a gain that falls with the averaged square of the force, as by heating.
"""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray

GAIN, LIMIT, DEAD_BAND, RATE, LAG_S, DELAY_S, FADE, FADE_S, HYSTERESIS = range(9)
"""Columns of an axis: gain factor; limit (N, 0 = none); half width of the dead band (N); slew rate (N/s, 0 = none);
time constant of the lag (s, 0 = none); delay (s); relative loss of force per N^2 of mean square, and the averaging time
of that mean (s); half width of the hysteresis between command and force (N)."""


@njit(cache=True, nogil=True)
def drive_actuators(command: FloatArray, axes: FloatArray, steps: int, rate_hz: float) -> FloatArray:
    """Actuator force, (samples * steps, 3), N. command: (samples, 3), N, each sample held for `steps` steps. axes: (3,
    9), columns above. A lag of at most a step is ignored."""
    samples, h = command.shape[0], 1.0 / (rate_hz * steps)
    force = np.zeros((samples * steps, 3))
    for j in range(3):
        row = axes[j]
        delay_steps = row[DELAY_S] / h
        whole_steps = int(delay_steps)
        slewed, lagged, mean_square, played = 0.0, 0.0, 0.0, 0.0
        for k in range(samples * steps):
            delayed = (1.0 - (delay_steps - whole_steps)) * _command(command, j, k - whole_steps, steps)
            delayed += (delay_steps - whole_steps) * _command(command, j, k - whole_steps - 1, steps)
            delayed = _dead_band(delayed, row[DEAD_BAND])
            played = min(max(played, delayed - row[HYSTERESIS]), delayed + row[HYSTERESIS])
            slewed = _limit_slew(slewed, played, row[RATE] * h)
            limited = min(max(slewed, -row[LIMIT]), row[LIMIT]) if row[LIMIT] > 0.0 else slewed
            lagged = lagged + (limited - lagged) * h / row[LAG_S] if row[LAG_S] > h else limited
            if row[FADE] > 0.0:
                mean_square += (lagged * lagged - mean_square) * h / row[FADE_S]
            force[k, j] = row[GAIN] * (1.0 - row[FADE] * mean_square) * lagged
    return force


@njit(cache=True, nogil=True)
def _command(command: FloatArray, axis: int, step: int, steps: int) -> float:
    """Command of an axis at an integration step, N; zero before the start."""
    value: float = command[step // steps, axis] if step >= 0 else 0.0
    return value


@njit(cache=True, nogil=True)
def _dead_band(command: float, half_width: float) -> float:
    """Command after a dead band of half width `half_width`, N."""
    return max(command - half_width, 0.0) + min(command + half_width, 0.0) if half_width > 0.0 else command


@njit(cache=True, nogil=True)
def _limit_slew(previous: float, target: float, max_change: float) -> float:
    """`previous`, moved towards `target` by at most `max_change`, N; 0 = no limit."""
    return previous + min(max(target - previous, -max_change), max_change) if max_change > 0.0 else target
