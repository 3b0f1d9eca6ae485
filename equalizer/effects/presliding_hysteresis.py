"""Presliding hysteresis: Dahl's bristle model of friction, a spring with a hysteresis loop for small motions.

    F = -k z,   dz/dt = v - k |v| z / level        level in N, k in N/m (a rotation: N m, N m/rad)

The bristle deflection z saturates at level / k, where F = -level sgn(v) as in Coulomb friction.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values, pack_values
from equalizer.effects.simulation.dry_friction_kernel import bristle_bend
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import axis_motion, best_trial, regress_out_linear_terms
from equalizer.signals.signal import FloatArray

RELATIVE_DEFLECTIONS = np.geomspace(3e-4, 1.0, 15)
"""Deflections level / k that are tried for starting values, relative to the rms position."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean force (N) over a step, whose travel depends on the force (implicit step), by Newton's method.

    The force is a weighted mean of those at both ends of the step: weight 1/2 (trapezoidal rule) for a soft bristle,
    towards the end (backward Euler, stable) for a stiff one. memory: deflection z.
    """
    if parameters[0] <= 0:
        return 0.0
    stiffness, longest, start = parameters[1], parameters[0] / parameters[1], memory[0]
    slack = stiffness * at[X_PER_N]
    end_weight = (0.5 + slack) / (1 + slack)
    free_travel = at[X_FREE] - at[X]
    travel = free_travel / (1 + slack)
    deflection = start
    for _ in range(20):
        full = longest * np.sign(travel)
        deflection = full + (start - full) * np.exp(-abs(travel) / longest)
        # Derivative of the deflection with respect to the travel.
        rate = 1 - deflection * np.sign(travel) / longest
        travel_error = travel - free_travel + slack * ((1 - end_weight) * start + end_weight * deflection)
        step = travel_error / (1 + slack * end_weight * max(rate, 0.0))
        travel -= step
        if abs(step) < 1e-7 * longest:
            break
    full = longest * np.sign(travel)
    deflection = full + (start - full) * np.exp(-abs(travel) / longest)
    memory[0] = deflection
    at[F_END] = -stiffness * deflection
    return float(-stiffness * ((1 - end_weight) * start + end_weight * deflection))


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Level and stiffness for the deflection level / k that explains most of the missing force."""
    motion = axis_motion(evidence, axis)
    path, used = evidence.axis_position[:, axis], evidence.used > 0
    rms = float(np.sqrt(np.mean(motion.position**2)))
    if rms == 0:
        return ()
    deflection, fit = best_trial(
        regress_out_linear_terms(motion),
        (RELATIVE_DEFLECTIONS * rms).tolist(),
        lambda slip: (-bristle_bend(path, slip)[used],),
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
    action=AxisForce(_law, pack_values("level", "stiffness"), memory=1),
    starts=_starts,
    simpler=("coulomb_friction",),
)
