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

SLIP_DEFLECTION_M = 50e-9
"""z_max (m): deflection at which the bristle slips. Chosen far below the resolution of position sensors."""
BRISTLE_DAMPING = 0.5
"""Damping of the bristle over sqrt(stiffness * mass), with the mass along the axis: twice the damping ratio. Chosen."""
MAX_PARTS = 12
"""Maximum number of parts into which a step is divided unless the bristle slips throughout. Chosen."""
TRAVEL_PER_PART = 0.3
"""Intended travel per part, in units of z_max: sets the number of parts. Chosen."""
SLIDING_SHARE = 1 - 1e-6
"""Share of the deflection in sliding above which the bristle counts as sliding. Chosen."""
MAX_NEWTON_ITERATIONS = 12
"""Maximum number of Newton iterations for the travel of one part. Chosen."""
TRAVEL_TOLERANCE = 3e-3
"""Residual of the travel equation, in units of z_max, at which the iteration ends: the last linear correction reduces
it to about its square."""
_VECTOR = types.float64[::1]
"""Type of a contiguous vector that a kernel may write to."""


@njit(inline="always")
def _solve_bristle_deflection(
    start_deflection: float,
    free_travel: float,
    compliance: float,
    damping: float,
    sliding_deflections: tuple[float, float],
) -> tuple[float, float]:
    """Solve for the deflection at the end of a part of a step; also returns the mean bristle force over the part,
    opposed to the motion.

    Lengths are in units of z_max, forces in units of the level. free_travel: travel without the bristle's force;
    compliance: travel per force; damping: force per deflection; sliding_deflections: in sliding forwards and backwards,
    >= 0.
    """
    # Newton's method for residual(travel) = travel - free_travel + compliance * mean force = 0; deflection_rate:
    # derivative of the end's deflection with respect to the travel.
    travel = free_travel / (1.0 + compliance * (1.0 + damping))
    end_deflection, deflection_rate, residual = start_deflection, 0.0, 0.0
    for _ in range(MAX_NEWTON_ITERATIONS):
        sliding_deflection = sliding_deflections[0] if travel > 0.0 else -sliding_deflections[1]
        if sliding_deflection == 0.0:
            end_deflection, deflection_rate = 0.0, 0.0
        else:
            decay = np.exp(-travel / sliding_deflection)
            end_deflection = sliding_deflection + (start_deflection - sliding_deflection) * decay
            deflection_rate = max(decay * (1.0 - start_deflection / sliding_deflection), 0.0)
        residual = (
            travel
            - free_travel
            + compliance * (0.5 * (start_deflection + end_deflection) + damping * (end_deflection - start_deflection))
        )
        correction = residual / (1.0 + compliance * (0.5 + damping) * deflection_rate)
        travel -= correction
        if abs(residual) < TRAVEL_TOLERANCE:
            end_deflection -= deflection_rate * correction
            break
    return end_deflection, 0.5 * (start_deflection + end_deflection) + damping * (end_deflection - start_deflection)


@njit(
    types.float64(types.float64, types.float64, types.float64, _VECTOR, _VECTOR),
    cache=True,
    error_model="numpy",
    **NO_REFERENCE_COUNTS,
)
def compute_friction_force(
    forward_level: float, backward_level: float, start_z: float, memory: FloatArray, step_motion: FloatArray
) -> float:
    """Compute the mean friction force (N) over a step, with the level (N) `forward_level` where v > 0 and
    `backward_level` where v < 0.

    start_z: deflection over z_max at the start of the step; step_motion: see `instant`. Writes the deflection at the
    end, over z_max, to `memory[0]` and the force (N) at the end to `step_motion[F_END]`; where neither level is above
    0, only a force of 0.
    """
    level, start_v, v_per_newton = max(forward_level, backward_level), step_motion[V], step_motion[V_PER_N]
    if level <= 0:
        step_motion[F_END] = 0.0
        return 0.0
    sliding_force = -forward_level if start_v > 0 else backward_level
    # The velocity does not reverse within the step and the bristle slips already: the force is constant.
    sliding_z = -sliding_force / level
    if (
        start_v * (step_motion[V_FREE] + v_per_newton * sliding_force) > 0
        and start_z * sliding_z > SLIDING_SHARE * sliding_z * sliding_z
    ):
        memory[0], step_motion[F_END] = sliding_z, sliding_force
        return sliding_force
    # From here on: lengths in units of z_max, times of the step, forces of the level; dv_per_force is then
    # stiffness step² / mass.
    step_s = step_motion[STEP_S]
    v, free_dv, dv_per_force = (
        start_v * step_s / SLIP_DEFLECTION_M,
        (step_motion[V_FREE] - start_v) * step_s / SLIP_DEFLECTION_M,
        v_per_newton * level * step_s / SLIP_DEFLECTION_M,
    )
    damping = BRISTLE_DAMPING / np.sqrt(dv_per_force)
    travel = abs(v) + 0.5 * abs(free_dv - dv_per_force * start_z)
    part_count = min(MAX_PARTS, 1 + int(min(travel / TRAVEL_PER_PART, MAX_PARTS)))
    step_fraction = 1.0 / part_count
    free_travel, compliance = 0.5 * free_dv * step_fraction**2, 0.5 * dv_per_force * step_fraction**2
    z, impulse = start_z, 0.0
    sliding_z_limits = (forward_level / level, backward_level / level)
    for _ in range(part_count):
        z, force = _solve_bristle_deflection(
            z, v * step_fraction + free_travel, compliance, damping * part_count, sliding_z_limits
        )
        v += (free_dv - dv_per_force * force) * step_fraction
        impulse += force
    z_limit = sliding_z_limits[0] if v > 0 else sliding_z_limits[1]
    memory[0], step_motion[F_END] = z, -level * (z + (damping * (v - abs(v) * z / z_limit) if z_limit > 0 else 0.0))
    return -level * impulse * step_fraction


_READ_ONLY_VECTOR = types.Array(types.float64, 1, "A", readonly=True)
"""A vector of any stride that is only read."""


@njit(types.float64[::1](_READ_ONLY_VECTOR, types.float64), cache=True)
def compute_bristle_deflection(position: FloatArray, slip_deflection: float) -> FloatArray:
    """Compute the deflection (n,) of a bristle, relative to `slip_deflection`, at which it slips, by Dahl's equation
    dz/dx = 1 - sgn(v) z along a position (n,) in the unit of `slip_deflection`, from 0 at the first sample. For
    regressions on a measured position, not for a simulation."""
    deflection = np.zeros(position.shape[0])
    for k in range(1, position.shape[0]):
        travel = (position[k] - position[k - 1]) / slip_deflection
        sliding_deflection = np.sign(travel)
        deflection[k] = sliding_deflection + (deflection[k - 1] - sliding_deflection) * np.exp(-abs(travel))
    return deflection
