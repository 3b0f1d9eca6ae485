"""Force of each amplifier and motor from the command, at the mechanism's integration step (compiled).

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
    """Compute the actuator force, (samples * steps_per_sample, 3), N. command: (samples, 3), N, each sample held for
    `steps_per_sample` integration steps. axis_parameters: (3, 9), columns above. rate_hz: sample rate of the command. A
    lag of at most a step is ignored."""
    sample_count, step_s = command.shape[0], 1.0 / (rate_hz * steps_per_sample)
    force = np.zeros((sample_count * steps_per_sample, 3))
    for axis in range(3):
        parameters = axis_parameters[axis]
        delay_steps = parameters[DELAY_S] / step_s
        whole_steps = int(delay_steps)
        slew_limited, lagged_force, mean_square, play_output = 0.0, 0.0, 0.0, 0.0
        for step in range(sample_count * steps_per_sample):
            delayed_command = (1.0 - (delay_steps - whole_steps)) * _look_up_command(
                command, axis, step - whole_steps, steps_per_sample
            )
            delayed_command += (delay_steps - whole_steps) * _look_up_command(
                command, axis, step - whole_steps - 1, steps_per_sample
            )
            delayed_command = _apply_dead_band(delayed_command, parameters[DEAD_BAND])
            play_output = min(
                max(play_output, delayed_command - parameters[HYSTERESIS_HALF_WIDTH]),
                delayed_command + parameters[HYSTERESIS_HALF_WIDTH],
            )
            slew_limited = _limit_slew(slew_limited, play_output, parameters[SLEW_RATE] * step_s)
            limited_force = (
                min(max(slew_limited, -parameters[FORCE_LIMIT]), parameters[FORCE_LIMIT])
                if parameters[FORCE_LIMIT] > 0.0
                else slew_limited
            )
            lagged_force = (
                lagged_force + (limited_force - lagged_force) * step_s / parameters[LAG_S]
                if parameters[LAG_S] > step_s
                else limited_force
            )
            if parameters[HEATING_LOSS] > 0.0:
                mean_square += (lagged_force * lagged_force - mean_square) * step_s / parameters[HEATING_TIME_S]
            force[step, axis] = parameters[GAIN] * (1.0 - parameters[HEATING_LOSS] * mean_square) * lagged_force
    return force


@njit(cache=True, nogil=True)
def _look_up_command(command: FloatArray, axis: int, step: int, steps_per_sample: int) -> float:
    """Look up the command (N) of an axis at an integration step, held over each sample; zero before the start."""
    held_command_n: float = command[step // steps_per_sample, axis] if step >= 0 else 0.0
    return held_command_n


@njit(cache=True, nogil=True)
def _apply_dead_band(command: float, half_width: float) -> float:
    """Apply a dead band to a command (N): its magnitude is reduced by `half_width` (N), to no less than 0."""
    return max(command - half_width, 0.0) + min(command + half_width, 0.0) if half_width > 0.0 else command


@njit(cache=True, nogil=True)
def _limit_slew(previous: float, target: float, max_change: float) -> float:
    """Move `previous` towards `target` by at most `max_change` (all in N); at 0 return `target`: no limit."""
    return previous + min(max(target - previous, -max_change), max_change) if max_change > 0.0 else target
