"""Pose-dependent inertia: a mass that changes with position, as that of a linkage.

With the mass M (1 + per_m x), per_m in 1/m (a rotation: 1/rad), Lagrange's equation adds -per_m M (x dv/dt + v^2 / 2)
to the force on the axis, with position x and velocity v. `equalizer.effects.catalogue` lists the effect.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import STEP_S, V_FREE, V_PER_N, X_FREE, V, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import (
    compute_quadratic_form,
    regress_out_linear_terms,
    select_axis_motion,
)
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

LAGRANGE_SPEED_SHARE = 0.5
"""Factor of -per_m M v^2 by Lagrange's equation; the default of `speed_share`, which may differ from it where several
axes move."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the force (N) at the mean position and velocity of the step without this force. The mean acceleration
    depends on the force itself: an implicit step, linear in the force. Its divisor, the total mass over M, is at least
    0.1 (chosen), so that a fit cannot make the mass zero or negative. parameters: per_m M, speed_share; memory: not
    used; step_motion: see `instant`."""
    mid_position, mid_velocity = (
        0.5 * (step_motion[X] + step_motion[X_FREE]),
        0.5 * (step_motion[V] + step_motion[V_FREE]),
    )
    added_mass = parameters[0] * mid_position
    free_acceleration, per_newton = (
        (step_motion[V_FREE] - step_motion[V]) / step_motion[STEP_S],
        step_motion[V_PER_N] / step_motion[STEP_S],
    )
    return float(
        -(added_mass * free_acceleration + parameters[0] * parameters[1] * mid_velocity * mid_velocity)
        / max(1 + added_mass * per_newton, 0.1)
    )


def _pack_parameters(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Pack the kernel's parameters, (2,): per_m times the mass along the axis, and speed_share (1/2 where it is
    missing)."""
    mass = compute_quadratic_form(model.mass, compute_driven_axes(model)[:, axis])
    return np.array([values["per_m"] * mass, values.get("speed_share", LAGRANGE_SPEED_SHARE)])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values of per_m by regression of the missing force: first with a separate strength of each term,
    if their ratio is within the upper limit 1.5 of speed_share in magnitude (a negative ratio becomes 0), then with the
    ratio of Lagrange's equation. Values with per_m = 0 are left out."""
    motion = select_axis_motion(evidence, axis)
    mass = compute_quadratic_form(evidence.model.mass, compute_driven_axes(evidence.model)[:, axis])
    position_term, speed_term = -mass * motion.position * motion.acceleration, -mass * motion.velocity**2
    regression = regress_out_linear_terms(motion)
    separate_fit, lagrange_fit = (
        regression.fit(position_term, speed_term),
        regression.fit(position_term + LAGRANGE_SPEED_SHARE * speed_term),
    )
    per_m, speed_strength = separate_fit.strengths.tolist()
    lagrange_per_m = float(lagrange_fit.strengths[0])
    starting_values = [{"per_m": lagrange_per_m, "speed_share": LAGRANGE_SPEED_SHARE}]
    if abs(speed_strength) < 1.5 * abs(per_m):
        starting_values.insert(0, {"per_m": per_m, "speed_share": max(speed_strength / per_m, 0.0)})
    return tuple(values for values in starting_values if values["per_m"] != 0)


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
    action=AxisForce(_compute_mean_force, _pack_parameters),
    starts=_find_starting_values,
)
