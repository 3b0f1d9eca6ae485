"""Force of each amplifier and motor from the command, at the mechanism's integration step (compiled). Called by
`study.evaluation.challenge.device`; `effects.actuator` sets the columns.

In this order: delay (interpolated between steps), dead band, hysteresis (play operator), slew limit, saturation,
first-order lag (explicit Euler), and a gain that falls with the averaged square of the force, as by heating.
"""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray

GAIN, FORCE_LIMIT, DEAD_BAND, SLEW_RATE, LAG_S, DELAY_S, HEATING_LOSS, HEATING_TIME_S, HYSTERESIS_HALF_WIDTH = range(9)
"""Columns of an axis: gain factor; limit (N, 0 = none); half width of the dead band (N); slew rate (N/s, 0 = no limit);
time constant of the lag (s, 0 = none); delay (s); relative loss of force per N^2 of mean square, and the averaging time
of that mean (s); half width of the hysteresis between command and force (N)."""


@njit(cache=True, nogil=True)
def drive_actuators(
    command: FloatArray, axis_parameters: FloatArray, steps_per_sample: int, rate_hz: float
) -> FloatArray:
    """Actuator force, (samples * steps_per_sample, 3), N. command: (samples, 3), N, each sample held for
    `steps_per_sample` integration steps. axis_parameters: (3, 9), columns above. rate_hz: sample rate of the command. A
    lag of at most a step is ignored."""
    sample_count, step_s = command.shape[0], 1.0 / (rate_hz * steps_per_sample)
    force = np.zeros((sample_count * steps_per_sample, 3))
    for axis in range(3):
        parameters = axis_parameters[axis]
        delay_steps = parameters[DELAY_S] / step_s
        whole_steps = int(delay_steps)
        slewed, lagged, mean_square, play_output = 0.0, 0.0, 0.0, 0.0
        for step in range(sample_count * steps_per_sample):
            delayed = (1.0 - (delay_steps - whole_steps)) * _look_up_command(
                command, axis, step - whole_steps, steps_per_sample
            )
            delayed += (delay_steps - whole_steps) * _look_up_command(
                command, axis, step - whole_steps - 1, steps_per_sample
            )
            delayed = _apply_dead_band(delayed, parameters[DEAD_BAND])
            play_output = min(
                max(play_output, delayed - parameters[HYSTERESIS_HALF_WIDTH]),
                delayed + parameters[HYSTERESIS_HALF_WIDTH],
            )
            slewed = _limit_slew(slewed, play_output, parameters[SLEW_RATE] * step_s)
            limited = (
                min(max(slewed, -parameters[FORCE_LIMIT]), parameters[FORCE_LIMIT])
                if parameters[FORCE_LIMIT] > 0.0
                else slewed
            )
            lagged = lagged + (limited - lagged) * step_s / parameters[LAG_S] if parameters[LAG_S] > step_s else limited
            if parameters[HEATING_LOSS] > 0.0:
                mean_square += (lagged * lagged - mean_square) * step_s / parameters[HEATING_TIME_S]
            force[step, axis] = parameters[GAIN] * (1.0 - parameters[HEATING_LOSS] * mean_square) * lagged
    return force


@njit(cache=True, nogil=True)
def _look_up_command(command: FloatArray, axis: int, step: int, steps_per_sample: int) -> float:
    """Command of an axis, N, held at an integration step; zero before the start."""
    value: float = command[step // steps_per_sample, axis] if step >= 0 else 0.0
    return value


@njit(cache=True, nogil=True)
def _apply_dead_band(command: float, half_width: float) -> float:
    """Command (N) after a dead band of half width `half_width` (N): reduced by that in magnitude, 0 within it."""
    return max(command - half_width, 0.0) + min(command + half_width, 0.0) if half_width > 0.0 else command


@njit(cache=True, nogil=True)
def _limit_slew(previous: float, target: float, max_change: float) -> float:
    """`previous`, moved towards `target` by at most `max_change`, N; 0 = no limit."""
    return previous + min(max(target - previous, -max_change), max_change) if max_change > 0.0 else target
