"""Asymmetric (quadratic) stiffness: a spring that is stiffer in one direction than in the other.

    F = -k2 x^2        k2 in N/m^2 (a rotation: N m/rad^2)

adds to the linear spring force -k x: with k2 > 0 the spring stiffens for x > 0 and softens for x < 0.
"""

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_axis_motion
from equalizer.signals.signal import FloatArray


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean of the forces (N) at the start and the end of the step (trapezoidal rule), and the force at its
    end in `step_motion`. The end position depends on the force (implicit step): four steps of Newton's method, which
    converges quadratically, with the derivative limited to 0.5 or more against divergence (both chosen). parameters:
    k2; memory: not used; step_motion: see `instant`."""
    half_stiffness, start_squared = 0.5 * parameters[0], step_motion[X] ** 2
    force = -half_stiffness * (start_squared + step_motion[X_FREE] ** 2)
    for _ in range(4):
        end_position = step_motion[X_FREE] + step_motion[X_PER_N] * force
        residual = force + half_stiffness * (start_squared + end_position**2)
        force -= residual / max(1 + 2 * half_stiffness * step_motion[X_PER_N] * end_position, 0.5)
    step_motion[F_END] = -parameters[0] * (step_motion[X_FREE] + step_motion[X_PER_N] * force) ** 2
    return float(force)


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Estimate k2 by regression of the missing force on -x^2, with the linear terms of the motion projected out; empty
    where it is zero."""
    motion = select_axis_motion(evidence, axis)
    k2 = float(regress_out_linear_terms(motion).fit(-(motion.position**2)).strengths[0])
    return ({"k2": k2},) if k2 != 0 else ()


EFFECT = Effect(
    name="asymmetric_stiffness",
    equation="F = -k2 x^2",
    source="Helmholtz 1863, Tonempfindungen, appendix 12",
    signature="the missing force is an even curve over the position; its even harmonics rise with the level and the "
    "mean position moves",
    parameters=(Parameter("k2", -1e12, 1e12, none=0.0, scale="signed"),),
    action=AxisForce(_compute_mean_force, pack_values("k2")),
    starts=_find_starting_values,
)
