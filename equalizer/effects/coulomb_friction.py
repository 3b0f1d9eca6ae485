"""Coulomb friction: a constant force against the motion; at rest it balances any smaller force.

    F = -level sgn(v) in sliding, any force from -level to level at rest; level in N (a rotation: N m)

The simulation replaces the jump at v = 0 by the bristle of the LuGre model, which slips after 50 nm
(`equalizer.effects.simulation.dry_friction_kernel`).
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.dry_friction_kernel import compute_friction_force
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_sliding_motion
from equalizer.signals.signal import FloatArray


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean friction force (N) over a step. parameters: level (N). memory: deflection of the bristle,
    relative to that at which it slips; advanced to the step's end."""
    return float(compute_friction_force(parameters[0], parameters[0], memory[0], memory, step_motion))


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the level by linear regression of the missing force on -sgn(v) where the axis slides; empty unless
    positive."""
    motion = select_sliding_motion(evidence, axis)
    level = float(regress_out_linear_terms(motion).fit(-np.sign(motion.velocity)).strengths[0])
    return ({"level": level},) if level > 0 else ()


EFFECT = Effect(
    name="coulomb_friction",
    equation="F = -level sgn(v)",
    source="Coulomb; bristles of Canudas de Wit and others 1995, IEEE Trans. Autom. Control 40:419, 50 nm long",
    signature="the missing force flips its sign with the velocity and does not grow with it; its odd harmonics fall "
    "as the level rises",
    parameters=(Parameter("level", 1e-9, 1e6, none=0.0),),
    action=AxisForce(_compute_mean_force, pack_values("level"), memory=1),
    starts=_find_starting_values,
)
