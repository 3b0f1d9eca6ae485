"""Quadratic damping: drag that grows with the square of the velocity, as of air or oil in turbulent flow.

    F = -c v |v|        c in N s²/m² (a rotation: N m s²/rad²)

An entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.instant import F_END, V_FREE, V_PER_N, V
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_axis_motion
from equalizer.signals.signal import FloatArray


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean of the drag (N) at the step's start and end (trapezoidal rule); the drag at the end is
    written to step_motion[F_END]. The end velocity w depends on it (implicit step) and solves w + r w |w| = v_free - r
    v |v|, with r = c v_per_n / 2 (`half_drag_gain`). parameters: c; memory: not used; step_motion: columns as in
    `instant`."""
    half_drag_gain = 0.5 * parameters[0] * step_motion[V_PER_N]
    right_side = step_motion[V_FREE] - half_drag_gain * step_motion[V] * abs(step_motion[V])
    end_velocity = 2 * right_side / (1 + np.sqrt(1 + 4 * half_drag_gain * abs(right_side)))
    step_motion[F_END] = -parameters[0] * end_velocity * abs(end_velocity)
    return float(-0.5 * parameters[0] * (step_motion[V] * abs(step_motion[V]) + end_velocity * abs(end_velocity)))


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the coefficient by linear regression of the missing force on -v |v|, with the terms of a linear model
    regressed out; empty unless positive."""
    motion = select_axis_motion(evidence, axis)
    coefficient = float(regress_out_linear_terms(motion).fit(-motion.velocity * np.abs(motion.velocity)).strengths[0])
    return ({"coefficient": coefficient},) if coefficient > 0 else ()


EFFECT = Effect(
    name="quadratic_damping",
    equation="F = -coefficient v |v|",
    source="Newton's drag at high Reynolds numbers",
    signature="the missing force is a parabola over the velocity, odd; its odd harmonics rise with the level",
    parameters=(Parameter("coefficient", 1e-9, 1e9, none=0.0),),
    action=AxisForce(_compute_mean_force, pack_values("coefficient")),
    starts=_find_starting_values,
)
