"""Cubic (Duffing) stiffness: the stiffness of a spring changes with the square of its deflection, symmetrically.

    F = -k3 x³        k3 > 0: hardening, k3 < 0: softening; N/m³ (a rotation: N m/rad³)

An entry of `equalizer.effects.catalogue`.
"""

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_axis_motion
from equalizer.signals.signal import FloatArray


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the force (N) over one step: the mean of those at its start and end (trapezoidal rule).

    The end position depends on this force (implicit step), x_end = x_free + x_per_n F, so that
    g(F) = F + k3/2 (x³ + x_end³) = 0 is solved by Newton's method, dg/dF = 1 + 3 k3/2 x_per_n x_end²: four iterations
    (chosen) from the force for x_end = x_free.
    """
    half_stiffness, start_cubed = 0.5 * parameters[0], step_motion[X] ** 3
    force = -half_stiffness * (start_cubed + step_motion[X_FREE] ** 3)
    for _ in range(4):
        end_position = step_motion[X_FREE] + step_motion[X_PER_N] * force
        residual = force + half_stiffness * (start_cubed + end_position**3)
        force -= residual / (1 + 3 * half_stiffness * step_motion[X_PER_N] * end_position * end_position)
    step_motion[F_END] = -parameters[0] * (step_motion[X_FREE] + step_motion[X_PER_N] * force) ** 3
    return float(force)


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find k3 by linear regression of the missing force on -x³ and the linear terms of the motion; empty where k3 is
    not positive, so that a search by simulation begins with hardening only."""
    motion = select_axis_motion(evidence, axis)
    k3 = float(regress_out_linear_terms(motion).fit(-(motion.position**3)).strengths[0])
    return ({"k3": k3},) if k3 > 0 else ()


EFFECT = Effect(
    name="hardening_stiffness",
    equation="F = -k3 x^3; softening for k3 < 0",
    source="Duffing 1918, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz",
    signature="the missing force is an odd function of the position; its odd harmonics grow with the level, and the "
    "lowest resonance moves up with it",
    parameters=(Parameter("k3", -1e15, 1e15, none=0.0, scale="signed"),),
    action=AxisForce(_compute_mean_force, pack_values("k3")),
    starts=_find_starting_values,
)
