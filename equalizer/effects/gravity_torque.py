"""Gravity torque of a body whose centre of mass is off its axis of rotation, as of a pendulum (unbalanced rotor).

tau = -torque sin(x + angle), with torque = m g r (N m), r (m) the distance of the centre of mass from the axis, and x
and angle in rad. For rotational models only. `equalizer.effects.catalogue` lists the effect.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_axis_motion
from equalizer.signals.signal import FloatArray

LEAST_TRAVEL_RAD = 0.5
"""Range of the angle (rad) that must be exceeded: in a smaller one sin(x + angle) is nearly linear in x, so that
gravity and a spring cannot be distinguished. Chosen."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean of the torques (N m) at start and end of the step (trapezoidal rule). The angle at the end
    depends on that mean, which is found by four fixed-point iterations; each multiplies the error by at most 0.5 torque
    times the angle that 1 N m adds in a step, a small number at usual sample rates. parameters: torque, angle; memory:
    not used; step_motion: see `instant`."""
    start_sine, torque = np.sin(step_motion[X] + parameters[1]), 0.0
    for _ in range(4):
        torque = (
            -0.5
            * parameters[0]
            * (start_sine + np.sin(step_motion[X_FREE] + step_motion[X_PER_N] * torque + parameters[1]))
        )
    step_motion[F_END] = -parameters[0] * np.sin(step_motion[X_FREE] + step_motion[X_PER_N] * torque + parameters[1])
    return float(torque)


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values by linear regression of the missing torque on -sin(x) and -cos(x), whose factors are
    torque cos(angle) and torque sin(angle). Empty for translational models, for a travel of at most `LEAST_TRAVEL_RAD`
    (or NaN) and for a torque of zero."""
    motion = select_axis_motion(evidence, axis)
    if not evidence.model.rotational or not np.ptp(motion.position) > LEAST_TRAVEL_RAD:
        return ()
    fit = regress_out_linear_terms(motion).fit(-np.sin(motion.position), -np.cos(motion.position))
    sine_strength, cosine_strength = fit.strengths.tolist()
    torque = float(np.hypot(sine_strength, cosine_strength))
    return ({"torque": torque, "angle": float(np.arctan2(cosine_strength, sine_strength))},) if torque > 0 else ()


EFFECT = Effect(
    name="gravity_torque",
    equation="F = -torque sin(x + angle)",
    source="a pendulum; Spong, Hutchinson and Vidyasagar, Robot Modeling and Control, chapter 6",
    signature="the missing torque is proportional to the sine of the angle and repeats with each turn, at every level",
    parameters=(
        Parameter("torque", 1e-9, 1e6, none=0.0),
        Parameter("angle", -1e3, 1e3, none=None, scale="linear", step=0.02),
    ),
    action=AxisForce(_compute_mean_force, pack_values("torque", "angle")),
    starts=_find_starting_values,
)
