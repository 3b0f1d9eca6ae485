"""Position-dependent dry friction, as of a bent screw, a rack, or a cable whose course changes with the position.

    F = -level max(1 + s x + b x², 0) sgn(v)        level in N, s in 1/m, b in 1/m² (a rotation: N m, 1/rad, 1/rad²)

The bristle of `simulation.dry_friction_kernel` replaces the jump at v = 0. An entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.dry_friction_kernel import compute_friction_force
from equalizer.effects.simulation.instant import X_FREE, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_sliding_motion
from equalizer.signals.signal import FloatArray


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean friction force (N) over a step, its level at the mean of its start and (force-free) end
    position. parameters: level (N), slope (1/m), bend (1/m²); memory: the bristle's deflection over its largest;
    step_motion: see `instant`."""
    mean_position = 0.5 * (step_motion[X] + step_motion[X_FREE])
    level = max(
        parameters[0] * (1 + parameters[1] * mean_position + parameters[2] * mean_position * mean_position), 0.0
    )
    return float(compute_friction_force(level, level, memory[0], memory, step_motion))


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values by linear regression of the missing force on -sgn(v), -x sgn(v), -x² sgn(v) where the axis
    slides; empty unless the level is positive."""
    motion = select_sliding_motion(evidence, axis)
    friction_direction = -np.sign(motion.velocity)
    fit = regress_out_linear_terms(motion).fit(
        friction_direction, friction_direction * motion.position, friction_direction * motion.position**2
    )
    level, slope_strength, bend_strength = fit.strengths.tolist()
    if level <= 0:
        return ()
    return ({"level": level, "slope_per_m": slope_strength / level, "bend_per_m2": bend_strength / level},)


EFFECT = Effect(
    name="position_dependent_friction",
    equation="F = -level (1 + slope_per_m x + bend_per_m2 x^2) sgn(v), never along the motion",
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30:1083, section 2.4",
    signature="the missing force flips its sign with the velocity by an amount that depends on where the axis is",
    parameters=(
        Parameter("level", 1e-9, 1e6, none=0.0),
        Parameter("slope_per_m", -1e6, 1e6, none=None, scale="signed"),
        Parameter("bend_per_m2", -1e9, 1e9, none=None, scale="signed"),
    ),
    action=AxisForce(_compute_mean_force, pack_values("level", "slope_per_m", "bend_per_m2"), memory=1),
    starts=_find_starting_values,
    simpler=("coulomb_friction",),
)
