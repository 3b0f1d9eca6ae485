"""Asymmetric Coulomb friction: dry friction that is stronger in one direction of motion than in the other.

    F = -level_positive where v > 0, +level_negative where v < 0        levels in N (a rotation: N m)

The force jumps at v = 0; the simulation replaces the jump by a bristle that slips after 50 nm (`dry_friction_kernel`).
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.dry_friction_kernel import compute_friction_force
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_sliding_motion
from equalizer.signals.signal import FloatArray

_INITIAL_LEVEL_RATIO = 1.3
"""Ratio of the two levels in the starting values that are tried in addition to the measured ones. Chosen."""
_LEAST_LEVEL_SHARE = 0.05
"""Least measured level, relative to the mean of both. Chosen."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean friction force (N) over a step. parameters: level for v > 0, level for v < 0 (N); memory:
    deflection of the bristle over its largest; step_motion: motion in the step, as laid out in `simulation.instant`."""
    return float(compute_friction_force(parameters[0], parameters[1], memory[0], memory, step_motion))


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values: the levels by regression of the missing force on either direction of sliding, then two
    pairs of levels with the ratio `_INITIAL_LEVEL_RATIO` and the same mean. Empty where the mean level is not
    positive."""
    motion = select_sliding_motion(evidence, axis)
    is_forward = np.asarray(motion.velocity > 0, dtype=np.float64)
    # No constant force among the regressors: it would absorb the asymmetry.
    positive_level, negative_level = (
        regress_out_linear_terms(motion, constant=False).fit(-is_forward, 1 - is_forward).strengths.tolist()
    )
    mean_level = (positive_level + negative_level) / 2
    if mean_level <= 0:
        return ()
    least_level = _LEAST_LEVEL_SHARE * mean_level
    low_level = 2 * mean_level / (1 + _INITIAL_LEVEL_RATIO)
    high_level = _INITIAL_LEVEL_RATIO * low_level
    return (
        {"level_positive": max(positive_level, least_level), "level_negative": max(negative_level, least_level)},
        {"level_positive": high_level, "level_negative": low_level},
        {"level_positive": low_level, "level_negative": high_level},
    )


EFFECT = Effect(
    name="asymmetric_friction",
    equation="F = -level_positive where v > 0, +level_negative where v < 0",
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30:1083",
    signature="the missing force flips its sign with the velocity, by unequal amounts: there is a mean force while "
    "the axis moves; its odd harmonics, and weaker even ones, fall as the level rises",
    parameters=(Parameter("level_positive", 1e-9, 1e6, none=0.0), Parameter("level_negative", 1e-9, 1e6, none=0.0)),
    action=AxisForce(_compute_mean_force, pack_values("level_positive", "level_negative"), memory=1),
    starts=_find_starting_values,
    simpler=("coulomb_friction",),
)
