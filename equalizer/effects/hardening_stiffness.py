"""Cubic (Duffing) stiffness: a spring that stiffens with deflection in either direction."""

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import axis_motion, regress_beside_linear
from equalizer.signals.signal import FloatArray


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean of the force at the step's start and end; the position at the end depends on the force (implicit step)."""
    half, start = 0.5 * parameters[0], at[X] ** 3
    force = -half * (start + at[X_FREE] ** 3)
    for _ in range(4):
        end = at[X_FREE] + at[X_PER_N] * force
        off = force + half * (start + end**3)
        force -= off / (1 + 3 * half * at[X_PER_N] * end * end)
    at[F_END] = -parameters[0] * (at[X_FREE] + at[X_PER_N] * force) ** 3
    return float(force)


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    motion = axis_motion(evidence, axis)
    k3 = float(regress_beside_linear(motion).fit(-(motion.position**3)).strengths[0])
    return ({"k3": k3},) if k3 > 0 else ()


EFFECT = Effect(
    name="hardening_stiffness",
    equation="F = -k3 x^3, below zero softening",
    source="Duffing 1918, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz",
    signature="the missing force is an odd curve over the position; its odd harmonics rise with the level and the "
    "lowest resonance moves up",
    parameters=(Parameter("k3", -1e15, 1e15, none=0.0, scale="signed"),),
    acts=AxisForce(_law, pack_values("k3")),
    starts=_starts,
)
