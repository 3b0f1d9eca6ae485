"""Dry friction over one time step, compiled: the bristle of the LuGre model, integrated within the step.

Coulomb friction jumps at v = 0, so that a scheme with a fixed step has no consistent force there. The LuGre bristle
(Canudas de Wit and others 1995, IEEE Trans. Autom. Control 40:419) replaces the jump by a spring with a damper:
    dz/dt = v - |v| z / z_max,    F = -(stiffness z + damping dz/dt),    stiffness = level / z_max,    z_max = 50 nm.
The bristle slips after tens of nanometres, far less than a position sensor resolves: sliding friction is -level sgn(v),
and at rest any smaller force is balanced. An accelerometer shows the finite time in which the force reverses.

For a travel s without reversal the deflection has a closed form, z_max + (z - z_max) exp(-s / z_max); the travel
depends on the force and is found by Newton's method. All quantities are divided by z_max, step and level once per step,
because this law takes most of the time of a fit with friction.
"""

import numpy as np
from numba import njit, types

from equalizer.effects.simulation.instant import F_END, STEP_S, V_FREE, V_PER_N, V
from equalizer.laws.kernel import NO_REFERENCE_COUNTS
from equalizer.signals.signal import FloatArray

LONGEST_M = 50e-9
"""z_max (m): deflection at which the bristle slips."""
BRISTLE_DAMPING = 0.5
"""Damping of the bristle over sqrt(stiffness * mass), with the mass that it holds: twice the damping ratio."""
PARTS = 12
"""Maximum number of parts into which a step is divided while the bristle is deflected."""
TRAVEL_PER_PART = 0.3
"""Intended travel per part, in units of z_max: sets the number of parts."""
SLIDING_SHARE = 1 - 1e-6
"""Share of the full deflection above which the bristle counts as sliding."""
ITERATIONS = 12
"""Maximum number of Newton iterations for the travel of one part."""
TRAVEL_TOLERANCE = 3e-3
"""Residual of the travel equation, in units of z_max, at which the iteration ends: the last linear correction reduces
it to about its square."""
_VECTOR = types.float64[::1]


@njit(inline="always")
def _deflect(
    bend: float, free: float, compliance: float, damping: float, full: tuple[float, float]
) -> tuple[float, float]:
    """Deflection at the end of a part of a step, and the mean bristle force over it, opposed to the motion.

    Lengths are in units of z_max, forces in units of the level. bend: deflection at the start; free: travel without the
    bristle's force; compliance: travel per force; damping: force per travel; full: deflections in sliding forwards and
    backwards, >= 0.
    """
    # Newton's method for off(travel) = travel - free + compliance * mean force = 0; rate: d ahead / d travel.
    travel = free / (1.0 + compliance * (1.0 + damping))
    end_deflection, rate, residual = bend, 0.0, 0.0
    for _ in range(ITERATIONS):
        full_deflection = full[0] if travel > 0.0 else -full[1]
        if full_deflection == 0.0:
            end_deflection, rate = 0.0, 0.0
        else:
            slip = np.exp(-travel / full_deflection)
            end_deflection = full_deflection + (bend - full_deflection) * slip
            rate = max(slip * (1.0 - bend / full_deflection), 0.0)
        residual = travel - free + compliance * (0.5 * (bend + end_deflection) + damping * (end_deflection - bend))
        correction = residual / (1.0 + compliance * (0.5 + damping) * rate)
        travel -= correction
        if abs(residual) < TRAVEL_TOLERANCE:
            end_deflection -= rate * correction
            break
    return end_deflection, 0.5 * (bend + end_deflection) + damping * (end_deflection - bend)


@njit(
    types.float64(types.float64, types.float64, types.float64, _VECTOR, _VECTOR),
    cache=True,
    error_model="numpy",
    **NO_REFERENCE_COUNTS,
)
def friction_force(forward: float, backward: float, start: float, memory: FloatArray, at: FloatArray) -> float:
    """Mean friction force (N) over a step, with the level (N) `forward` where v > 0 and `backward` where v < 0.

    start: deflection over z_max at the start of the step. at: see `instant`. Writes the deflection at the end to
    `memory[0]` and the force (N) at the end to `at[F_END]`.
    """
    level, speed, per_newton = max(forward, backward), at[V], at[V_PER_N]
    if level <= 0:
        at[F_END] = 0.0
        return 0.0
    sliding = -forward if speed > 0 else backward
    # The velocity does not reverse within the step and the bristle slips already: the force is constant.
    full = -sliding / level
    if speed * (at[V_FREE] + per_newton * sliding) > 0 and start * full > SLIDING_SHARE * full * full:
        memory[0], at[F_END] = full, sliding
        return sliding
    # From here on: lengths in units of z_max, times of the step, forces of the level. give: stiffness step² / mass.
    step_s = at[STEP_S]
    v, free_change, relative_compliance = (
        speed * step_s / LONGEST_M,
        (at[V_FREE] - speed) * step_s / LONGEST_M,
        per_newton * level * step_s / LONGEST_M,
    )
    damping = BRISTLE_DAMPING / np.sqrt(relative_compliance)
    travel_estimate = abs(v) + 0.5 * abs(free_change - relative_compliance * start)
    parts = min(PARTS, 1 + int(min(travel_estimate / TRAVEL_PER_PART, PARTS)))
    share = 1.0 / parts
    free, compliance = 0.5 * free_change * share**2, 0.5 * relative_compliance * share**2
    bend, impulse = start, 0.0
    full_deflections = (forward / level, backward / level)
    for _ in range(parts):
        bend, force = _deflect(bend, v * share + free, compliance, damping * parts, full_deflections)
        v += (free_change - relative_compliance * force) * share
        impulse += force
    end_full = full_deflections[0] if v > 0 else full_deflections[1]
    memory[0], at[F_END] = bend, -level * (bend + (damping * (v - abs(v) * bend / end_full) if end_full > 0 else 0.0))
    return -level * impulse * share


_PATH = types.Array(types.float64, 1, "A", readonly=True)
"""A vector of any stride that is only read."""


@njit(types.float64[::1](_PATH, types.float64), cache=True)
def bristle_bend(position: FloatArray, longest: float) -> FloatArray:
    """(n,): deflection over `longest`, the deflection at which the bristle slips, by Dahl's equation dz/dx = 1 - sgn(v)
    z along a position (n,) in the unit of `longest`; from 0 at the first sample."""
    bend = np.zeros(position.shape[0])
    for k in range(1, position.shape[0]):
        travel = (position[k] - position[k - 1]) / longest
        full = np.sign(travel)
        bend[k] = full + (bend[k - 1] - full) * np.exp(-abs(travel))
    return bend
