"""Pose-dependent inertia: a mass that changes with position, as that of a linkage.

With the mass M (1 + per_m x), Lagrange's equation adds -per_m M (x dv/dt + v^2 / 2) to the force on the axis.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import STEP_S, V_FREE, V_PER_N, X_FREE, V, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import axis_motion, quadratic_form, regress_out_linear_terms
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

LAGRANGE = 0.5
"""Factor of M per_m v^2 by Lagrange's equation; the default of `speed_share`."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Force (N) at mid-step. The mean acceleration depends on the force itself: an implicit step, linear in the force.
    parameters: per_m M, speed_share."""
    middle, speed = 0.5 * (at[X] + at[X_FREE]), 0.5 * (at[V] + at[V_FREE])
    added_mass = parameters[0] * middle
    free_acceleration, per_newton = (at[V_FREE] - at[V]) / at[STEP_S], at[V_PER_N] / at[STEP_S]
    return float(
        -(added_mass * free_acceleration + parameters[0] * parameters[1] * speed * speed)
        / max(1 + added_mass * per_newton, 0.1)
    )


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """(2,): per_m times the mass along the axis, and speed_share."""
    mass = quadratic_form(model.mass, compute_driven_axes(model)[:, axis])
    return np.array([values["per_m"] * mass, values.get("speed_share", LAGRANGE)])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """per_m by regression of the missing force: with both terms free where their ratio is plausible (below 1.5), and
    with the ratio of Lagrange's equation."""
    motion = axis_motion(evidence, axis)
    mass = quadratic_form(evidence.model.mass, compute_driven_axes(evidence.model)[:, axis])
    by_place, by_speed = -mass * motion.position * motion.acceleration, -mass * motion.velocity**2
    regression = regress_out_linear_terms(motion)
    free, bound = regression.fit(by_place, by_speed), regression.fit(by_place + LAGRANGE * by_speed)
    per_m, momentum = free.strengths.tolist()
    joint_fit = float(bound.strengths[0])
    starts = [{"per_m": joint_fit, "speed_share": LAGRANGE}]
    if abs(momentum) < 1.5 * abs(per_m):
        starts.insert(0, {"per_m": per_m, "speed_share": max(momentum / per_m, 0.0)})
    return tuple(values for values in starts if values["per_m"] != 0)


EFFECT = Effect(
    name="pose_dependent_inertia",
    equation="F = -per_m M (x dv/dt + speed_share v^2), M the mass along the axis; speed_share is 1/2 by Lagrange",
    source="Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, chapter 7",
    signature="the missing force is proportional to position times acceleration; its even harmonics rise with the "
    "level",
    parameters=(
        Parameter("per_m", -1e6, 1e6, none=0.0, scale="signed"),
        Parameter("speed_share", -0.5, 1.5, none=None, scale="linear", step=0.02),
    ),
    action=AxisForce(_law, _pack),
    starts=_starts,
)
