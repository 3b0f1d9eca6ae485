"""Dry friction over one step, compiled: a bristle that is deflected, slips and springs back within the step.

Friction with a jump at v = 0 has no solution at a fixed step. The bristle of LuGre (Canudas de Wit and others 1995)
replaces the jump by a spring of stiffness level / 50 nm with a damper: dz/dt = v - |v| z / z_max, F = -(stiffness z +
damping dz/dt). It slips after tens of nanometres, far less than a position sensor resolves, so that F = -level sgn(v)
holds in sliding and any smaller force is balanced at rest; an accelerometer shows the finite time in which the force
reverses.

Within the step the deflection has a closed form for a given travel, and the travel is found by Newton's method, because
it depends on the force.
"""

import numpy as np
from numba import njit, types

from equalizer.effects.simulation.instant import F_END, STEP_S, V_FREE, V_PER_N, V
from equalizer.signals.signal import FloatArray

LONGEST_M = 50e-9
"""Deflection z_max at which the bristle slips."""
DAMPED = 0.5
"""Damping of the bristle over sqrt(stiffness times the mass that it holds)."""
PARTS = 12
"""Most parts of a step in which the bristle is followed while it is deflected."""
STUCK = 0.3
"""Travel per part, in units of z_max, that is fine enough for the bristle."""
BENT = 1 - 1e-6
"""Share of the full bristle force above which the bristle counts as fully bent (sliding)."""
_VECTOR = types.float64[::1]


@njit(types.float64(types.float64, types.float64, types.float64, _VECTOR, _VECTOR), cache=True, error_model="numpy")
def friction_force(forward: float, backward: float, start: float, memory: FloatArray, at: FloatArray) -> float:
    """Mean force over a step of friction with the level `forward` where v > 0 and `backward` where v < 0.

    start: deflection over z_max at the step's start; `memory[0]` becomes that at its end. `at[F_END]` becomes the force
    at the end.
    """
    level, velocity, per_newton = max(forward, backward), at[V], at[V_PER_N]
    if level <= 0:
        at[F_END] = 0.0
        return 0.0
    sliding = -forward if velocity > 0 else backward
    full = -sliding / level
    if velocity * (at[V_FREE] + per_newton * sliding) > 0 and start * full > BENT * full * full:
        memory[0], at[F_END] = full, sliding
        return sliding
    mass, stiffness = at[STEP_S] / per_newton, level / LONGEST_M
    damping = DAMPED * np.sqrt(stiffness * mass)
    pull, bend, impulse, last = (at[V_FREE] - velocity) / at[STEP_S], start * LONGEST_M, 0.0, 0.0
    moved = at[STEP_S] * (abs(velocity) + 0.5 * at[STEP_S] * abs(pull - stiffness * bend / mass))
    parts = min(PARTS, 1 + int(min(moved / (STUCK * LONGEST_M), PARTS)))
    step_s = at[STEP_S] / parts
    for _ in range(parts):
        free = velocity * step_s + 0.5 * pull * step_s**2
        give = 0.5 * step_s**2 / mass
        travel, ahead, force = free / (1 + give * (stiffness + damping / step_s)), bend, 0.0
        for _ in range(12):
            way = np.sign(travel)
            longest = (forward if travel > 0 else backward) / stiffness
            slip = np.exp(-abs(travel) / longest) if longest > 0 else 0.0
            ahead = way * longest + (bend - way * longest) * slip
            rate = slip * (1 - bend * way / longest) if longest > 0 else 0.0
            force = 0.5 * stiffness * (bend + ahead) + damping * (ahead - bend) / step_s
            off = travel - free + give * force
            travel -= off / (1 + give * (0.5 * stiffness + damping / step_s) * max(rate, 0.0))
            if abs(off) < 1e-6 * LONGEST_M:
                break
        bend = ahead
        velocity += pull * step_s - force * step_s / mass
        impulse += force
        longest = (forward if velocity > 0 else backward) / stiffness
        turning = velocity - abs(velocity) * bend / longest if longest > 0 else 0.0
        last = stiffness * bend + damping * turning
    memory[0], at[F_END] = bend / LONGEST_M, -last
    return float(-impulse / parts)
