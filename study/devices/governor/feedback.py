"""Centring spring and damper: the part of the force that depends on the measured position of the handle.

    F = -K (x - centre) - B v,        v: low-pass filtered velocity

K (STIFFNESS) in N/m, B (DAMPING) in N s/m. Spring, damper and their sum are each limited to FEEDBACK_CAP, separately
from the cap of the stimulus: a wrong reading that no plausibility check detects then exerts at most this force. Called
by `govern` at each tick of a stimulus.
"""

import math

from equalizer.signals.signal import FloatArray
from study.devices.governor.cells import (
    CENTRE_X,
    DAMPING,
    ELAPSED_TICKS,
    FEEDBACK_CAP,
    FEEDBACK_CLIPPED,
    FEEDBACK_FORCE,
    FEEDBACK_REDUCTION,
    FRICTION,
    LAST_POSITION,
    REDUCTION_TICKS,
    STIFFNESS,
    TICK_S,
    UNCHANGED_TICKS,
    VELOCITY,
    VELOCITY_SMOOTHING,
)
from study.devices.governor.compiling import njit_inline
from study.devices.governor.confine import EXCESS_FACTOR, compute_limiting_factor, compute_norm


@njit_inline
def _filter_velocity(state: FloatArray, settings: FloatArray, reading: FloatArray) -> None:
    """First-order low-pass filter of the velocity (m/s): v += c (dx/dt - v) per tick, dx/dt = 0 at the first reading. A
    reading k ticks after the last by their time stamps (ELAPSED_TICKS) is weighted with 1 - (1 - c)^k instead of c, so
    that late or missed ticks do not change the corner frequency."""
    elapsed_ticks = state[ELAPSED_TICKS]
    coefficient = settings[VELOCITY_SMOOTHING]
    if elapsed_ticks != 1.0:
        coefficient = 1.0 - (1.0 - coefficient) ** elapsed_ticks
    for i in range(3):
        last_position = state[LAST_POSITION + i]
        velocity = (
            0.0 if math.isnan(last_position) else (reading[i] - last_position) / (elapsed_ticks * settings[TICK_S])
        )
        state[VELOCITY + i] += coefficient * (velocity - state[VELOCITY + i])


@njit_inline
def _reduce_feedback(state: FloatArray, settings: FloatArray) -> None:
    """Reduce the feedback force slowly while, unreduced, it exceeds dry friction and the position reading stays equal.

    A handle that dry friction holds at rest looks like a frozen encoder. With the force reduced, a real handle moves
    and shows that the encoder works; an encoder whose reading still does not change is reported as stale. The reduction
    stays until the end of the hold.
    """
    if state[UNCHANGED_TICKS] >= settings[REDUCTION_TICKS] and state[FEEDBACK_FORCE] > settings[FRICTION]:
        state[FEEDBACK_REDUCTION] = min(1.0, state[FEEDBACK_REDUCTION] + 1.0 / settings[REDUCTION_TICKS])


@njit_inline
def add_feedback(state: FloatArray, settings: FloatArray, reading: FloatArray, gain: float, force: FloatArray) -> None:
    """Add spring and damper to `force` (3,), N, each and their sum limited to FEEDBACK_CAP. gain: 0 to 1, the ramp at
    the start and end. FEEDBACK_FORCE (N) is their magnitude before `_reduce_feedback` reduces it."""
    _filter_velocity(state, settings, reading)
    cap, stiffness, damping = settings[FEEDBACK_CAP], settings[STIFFNESS], settings[DAMPING]
    x = stiffness * (reading[0] - settings[CENTRE_X])
    y = stiffness * (reading[1] - settings[CENTRE_X + 1])
    z = stiffness * (reading[2] - settings[CENTRE_X + 2])
    u, v, w = damping * state[VELOCITY], damping * state[VELOCITY + 1], damping * state[VELOCITY + 2]
    spring_norm, damper_norm = compute_norm(x, y, z), compute_norm(u, v, w)
    spring_factor, damper_factor = compute_limiting_factor(spring_norm, cap), compute_limiting_factor(damper_norm, cap)
    x, y, z = (
        spring_factor * x + damper_factor * u,
        spring_factor * y + damper_factor * v,
        spring_factor * z + damper_factor * w,
    )
    total_norm = compute_norm(x, y, z)
    total_factor = compute_limiting_factor(total_norm, cap)
    state[FEEDBACK_FORCE] = abs(gain) * total_factor * total_norm
    _reduce_feedback(state, settings)
    reduced_gain = gain * (1.0 - state[FEEDBACK_REDUCTION])
    force[0] -= reduced_gain * (total_factor * x)
    force[1] -= reduced_gain * (total_factor * y)
    force[2] -= reduced_gain * (total_factor * z)
    state[FEEDBACK_CLIPPED] += max(spring_norm, damper_norm, total_norm) > cap * EXCESS_FACTOR
