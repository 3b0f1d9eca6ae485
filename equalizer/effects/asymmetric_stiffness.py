"""Asymmetric (quadratic) stiffness: a spring that is stiffer in one direction than in the other.

F = -k2 x^2 adds to the linear spring force -k x: with k2 > 0 the spring stiffens for x > 0 and softens for x < 0.
"""

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import axis_motion, regress_out_linear_terms
from equalizer.signals.signal import FloatArray


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean of the forces at the start and the end of the step. The end position depends on the force: an implicit step,
    solved by Newton's method, with the derivative kept at 0.5 or more against diverging steps."""
    half, start = 0.5 * parameters[0], at[X] ** 2
    force = -half * (start + at[X_FREE] ** 2)
    for _ in range(4):
        end = at[X_FREE] + at[X_PER_N] * force
        residual = force + half * (start + end**2)
        force -= residual / max(1 + 2 * half * at[X_PER_N] * end, 0.5)
    at[F_END] = -parameters[0] * (at[X_FREE] + at[X_PER_N] * force) ** 2
    return float(force)


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """k2 by regression of the missing force on -x^2, the linear terms projected out."""
    motion = axis_motion(evidence, axis)
    k2 = float(regress_out_linear_terms(motion).fit(-(motion.position**2)).strengths[0])
    return ({"k2": k2},) if k2 != 0 else ()


EFFECT = Effect(
    name="asymmetric_stiffness",
    equation="F = -k2 x^2",
    source="Helmholtz 1863, Tonempfindungen, appendix 12",
    signature="the missing force is an even curve over the position; its even harmonics rise with the level and the "
    "mean position moves",
    parameters=(Parameter("k2", -1e12, 1e12, none=0.0, scale="signed"),),
    action=AxisForce(_law, pack_values("k2")),
    starts=_starts,
)
