"""Gravity torque of a body whose centre of mass is off its axis of rotation, as of a pendulum (unbalanced rotor).

tau = -torque sin(x + angle), with torque = m g r (N m) and x the rotation angle (rad). For rotational models only.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import axis_motion, regress_out_linear_terms
from equalizer.signals.signal import FloatArray

LEAST_TRAVEL_RAD = 0.5
"""Least travel (rad): below it, sin(x + angle) is nearly linear in x, so that gravity and a spring cannot be
distinguished."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean of the torques at start and end of the step (trapezoidal rule). The angle at the end depends on that mean:
    it is found by fixed-point iteration. parameters: torque, angle; at: see `instant`."""
    start, torque = np.sin(at[X] + parameters[1]), 0.0
    for _ in range(4):
        torque = -0.5 * parameters[0] * (start + np.sin(at[X_FREE] + at[X_PER_N] * torque + parameters[1]))
    at[F_END] = -parameters[0] * np.sin(at[X_FREE] + at[X_PER_N] * torque + parameters[1])
    return float(torque)


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Starting values by linear regression of the missing torque on -sin(x) and -cos(x), whose factors are
    torque cos(angle) and torque sin(angle). Empty for translational models and for small travel."""
    motion = axis_motion(evidence, axis)
    if not evidence.model.rotational or not np.ptp(motion.position) > LEAST_TRAVEL_RAD:
        return ()
    fit = regress_out_linear_terms(motion).fit(-np.sin(motion.position), -np.cos(motion.position))
    sine, cosine = fit.strengths.tolist()
    torque = float(np.hypot(sine, cosine))
    return ({"torque": torque, "angle": float(np.arctan2(cosine, sine))},) if torque > 0 else ()


EFFECT = Effect(
    name="gravity_torque",
    equation="F = -torque sin(x + angle)",
    source="a pendulum; Spong, Hutchinson and Vidyasagar, Robot Modeling and Control, chapter 6",
    signature="the missing torque is proportional to the sine of the angle and repeats with each turn, at every level",
    parameters=(
        Parameter("torque", 1e-9, 1e6, none=0.0),
        Parameter("angle", -1e3, 1e3, none=None, scale="linear", step=0.02),
    ),
    action=AxisForce(_law, pack_values("torque", "angle")),
    starts=_starts,
)
