"""Presliding hysteresis: Dahl's bristle model of friction, a spring with a hysteresis loop for small motions.

    F = -k z,   dz/dt = v - k |v| z / level        level in N, k in N/m (a rotation: N m, N m/rad)

The bristle deflection z saturates at level / k, where F = -level sgn(v) as in Coulomb friction. An entry of
`equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.dry_friction_kernel import compute_bristle_deflection
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import find_best_trial, regress_out_linear_terms, select_axis_motion
from equalizer.signals.signal import FloatArray

RELATIVE_DEFLECTIONS = np.geomspace(3e-4, 1.0, 15)
"""Deflections level / k that are tried for starting values, relative to the rms position. Chosen."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean force (N) over a step, whose travel depends on the force (implicit step), by Newton's method.

    The force is a weighted mean of those at both ends of the step: weight 1/2 (trapezoidal rule) for a soft bristle,
    towards the end (backward Euler, stable) for a stiff one. Newton's method ends at a correction of 1e-7 of the slip
    deflection, or after 20 iterations. parameters: level, stiffness; memory: deflection z (m), advanced;
    step_motion: see `instant`; the force at the end is written to it. A level of 0 or less gives 0 and writes nothing.
    """
    if parameters[0] <= 0:
        return 0.0
    stiffness, slip_deflection, start_deflection = parameters[1], parameters[0] / parameters[1], memory[0]
    relative_compliance = stiffness * step_motion[X_PER_N]
    end_weight = (0.5 + relative_compliance) / (1 + relative_compliance)
    free_travel = step_motion[X_FREE] - step_motion[X]
    travel = free_travel / (1 + relative_compliance)
    deflection = start_deflection
    for _ in range(20):
        sliding_deflection = slip_deflection * np.sign(travel)
        deflection = sliding_deflection + (start_deflection - sliding_deflection) * np.exp(
            -abs(travel) / slip_deflection
        )
        # Derivative of the deflection with respect to the travel.
        deflection_rate = 1 - deflection * np.sign(travel) / slip_deflection
        travel_error = (
            travel - free_travel + relative_compliance * ((1 - end_weight) * start_deflection + end_weight * deflection)
        )
        correction = travel_error / (1 + relative_compliance * end_weight * max(deflection_rate, 0.0))
        travel -= correction
        if abs(correction) < 1e-7 * slip_deflection:
            break
    sliding_deflection = slip_deflection * np.sign(travel)
    deflection = sliding_deflection + (start_deflection - sliding_deflection) * np.exp(-abs(travel) / slip_deflection)
    memory[0] = deflection
    step_motion[F_END] = -stiffness * deflection
    return float(-stiffness * ((1 - end_weight) * start_deflection + end_weight * deflection))


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find level and stiffness for the deflection level / k that explains most of the missing force, among
    `RELATIVE_DEFLECTIONS`; empty where the axis does not move or the level is not positive."""
    motion = select_axis_motion(evidence, axis)
    position, is_used = evidence.axis_position[:, axis], evidence.used > 0
    rms_position = float(np.sqrt(np.mean(motion.position**2)))
    if rms_position == 0:
        return ()
    deflection, fit = find_best_trial(
        regress_out_linear_terms(motion),
        (RELATIVE_DEFLECTIONS * rms_position).tolist(),
        lambda trial_deflection: (-compute_bristle_deflection(position, trial_deflection)[is_used],),
    )
    level = float(fit.strengths[0])
    return ({"level": level, "stiffness": level / deflection},) if level > 0 else ()


EFFECT = Effect(
    name="presliding_hysteresis",
    equation="F = -stiffness z, dz/dt = v - stiffness |v| z / level",
    source="Dahl 1968, Aerospace Corp. TOR-0158(3107-18)-1; Canudas de Wit and others 1995, IEEE Trans. Autom. Control "
    "40:419",
    signature="the missing force flips its sign with the velocity only after some travel: a loop over the position "
    "near each reversal",
    parameters=(Parameter("level", 1e-9, 1e6, none=0.0), Parameter("stiffness", 1e-3, 1e9, none=None, step=0.03)),
    action=AxisForce(_compute_mean_force, pack_values("level", "stiffness"), memory=1),
    starts=_find_starting_values,
    simpler=("coulomb_friction",),
)
