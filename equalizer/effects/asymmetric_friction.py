"""Asymmetric Coulomb friction: dry friction that is stronger in one direction of motion than in the other.

The force jumps at v = 0; the simulation replaces the jump by a bristle of nanometre travel (`dry_friction_kernel`).
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.dry_friction_kernel import friction_force
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_beside_linear, select_sliding_motion
from equalizer.signals.signal import FloatArray

_GUESS = 1.3
"""Ratio of the two levels in the starting values that are tried in addition to the measured ones."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean friction force over the step. memory: deflection of the bristle."""
    return float(friction_force(parameters[0], parameters[1], memory[0], memory, at))


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Levels by regression of the missing force on either direction of sliding, then two guesses with the same mean.
    Empty where the mean level is not positive."""
    motion = select_sliding_motion(evidence, axis)
    forward = np.asarray(motion.velocity > 0, dtype=np.float64)
    # No constant force among the regressors: it would absorb the asymmetry.
    positive, negative = regress_beside_linear(motion, constant=False).fit(-forward, 1 - forward).strengths.tolist()
    mean = (positive + negative) / 2
    if mean <= 0:
        return ()
    measured = {"level_positive": max(positive, 0.05 * mean), "level_negative": max(negative, 0.05 * mean)}
    more, less = 2 * mean * _GUESS / (1 + _GUESS), 2 * mean / (1 + _GUESS)
    guesses = ((more, less), (less, more))
    return (measured, *({"level_positive": each, "level_negative": other} for each, other in guesses))


EFFECT = Effect(
    name="asymmetric_friction",
    equation="F = -level_positive where v > 0, +level_negative where v < 0",
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30:1083",
    signature="the missing force flips its sign with the velocity, by unequal amounts: there is a mean force while "
    "the axis moves; its odd harmonics, and weaker even ones, fall as the level rises",
    parameters=(Parameter("level_positive", 1e-9, 1e6, none=0.0), Parameter("level_negative", 1e-9, 1e6, none=0.0)),
    acts=AxisForce(_law, pack_values("level_positive", "level_negative"), memory=1),
    starts=_starts,
    simpler=("coulomb_friction",),
)
