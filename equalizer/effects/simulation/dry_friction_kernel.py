"""Dry friction over one step, compiled: a bristle that is deflected, slips and springs back within the step.

Friction with a jump at v = 0 has no solution at a fixed step. The bristle of LuGre (Canudas de Wit and others 1995)
replaces the jump by a spring of stiffness level / 50 nm with a damper: dz/dt = v - |v| z / z_max, F = -(stiffness z +
damping dz/dt). It slips after tens of nanometres, far less than a position sensor resolves, so that F = -level sgn(v)
holds in sliding and any smaller force is balanced at rest; an accelerometer shows the finite time in which the force
reverses.

Within the step the deflection has a closed form for a given travel, and the travel is found by Newton's method, because
it depends on the force. Everything that stays the same over the step is divided out once: this law takes most of the
time of a fit with friction.
"""

import numpy as np
from numba import njit, types

from equalizer.effects.simulation.instant import F_END, STEP_S, V_FREE, V_PER_N, V
from equalizer.laws.kernel import UNCOUNTED
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
ITERATIONS = 12
"""Most Newton iterations for the travel of one part."""
NEAR = 3e-3
"""Error of the travel, over z_max, that the last iteration's linear correction takes to about its square."""
_VECTOR = types.float64[::1]


@njit(inline="always")
def _deflect(
    bend: float, free: float, compliance: float, damping: float, full: tuple[float, float]
) -> tuple[float, float]:
    """Deflection at the end of a part of a step, and the mean force over it.

    All over z_max and the level. bend: deflection at the start; free: travel without the bristle's force; compliance:
    travel per force; damping: force per travel; full: deflections in sliding forwards and backwards, >= 0.
    """
    travel = free / (1.0 + compliance * (1.0 + damping))
    ahead, rate, off = bend, 0.0, 0.0
    for _ in range(ITERATIONS):
        far = full[0] if travel > 0.0 else -full[1]
        if far == 0.0:
            ahead, rate = 0.0, 0.0
        else:
            slip = np.exp(-travel / far)
            ahead = far + (bend - far) * slip
            rate = max(slip * (1.0 - bend / far), 0.0)
        off = travel - free + compliance * (0.5 * (bend + ahead) + damping * (ahead - bend))
        correction = off / (1.0 + compliance * (0.5 + damping) * rate)
        travel -= correction
        if abs(off) < NEAR:
            ahead -= rate * correction
            break
    return ahead, 0.5 * (bend + ahead) + damping * (ahead - bend)


@njit(
    types.float64(types.float64, types.float64, types.float64, _VECTOR, _VECTOR),
    cache=True,
    error_model="numpy",
    **UNCOUNTED,
)
def friction_force(forward: float, backward: float, start: float, memory: FloatArray, at: FloatArray) -> float:
    """Mean force over a step of friction with the level `forward` where v > 0 and `backward` where v < 0.

    start: deflection over z_max at the step's start; `memory[0]` becomes that at its end. `at[F_END]` becomes the force
    at the end.
    """
    level, speed, per_newton = max(forward, backward), at[V], at[V_PER_N]
    if level <= 0:
        at[F_END] = 0.0
        return 0.0
    sliding = -forward if speed > 0 else backward
    full = -sliding / level
    if speed * (at[V_FREE] + per_newton * sliding) > 0 and start * full > BENT * full * full:
        memory[0], at[F_END] = full, sliding
        return sliding
    # From here on in units of z_max, the step, and the level.
    step_s = at[STEP_S]
    v, free_change, give = (
        speed * step_s / LONGEST_M,
        (at[V_FREE] - speed) * step_s / LONGEST_M,
        per_newton * level * step_s / LONGEST_M,
    )
    damping = DAMPED / np.sqrt(give)
    moved = abs(v) + 0.5 * abs(free_change - give * start)
    parts = min(PARTS, 1 + int(min(moved / STUCK, PARTS)))
    share = 1.0 / parts
    free, compliance = 0.5 * free_change * share**2, 0.5 * give * share**2
    bend, impulse = start, 0.0
    ends = (forward / level, backward / level)
    for _ in range(parts):
        bend, force = _deflect(bend, v * share + free, compliance, damping * parts, ends)
        v += (free_change - give * force) * share
        impulse += force
    far = ends[0] if v > 0 else ends[1]
    memory[0], at[F_END] = bend, -level * (bend + (damping * (v - abs(v) * bend / far) if far > 0 else 0.0))
    return -level * impulse * share


_PATH = types.Array(types.float64, 1, "A", readonly=True)


@njit(types.float64[::1](_PATH, types.float64), cache=True)
def bristle_bend(position: FloatArray, longest: float) -> FloatArray:
    """(n,): deflection over `longest`, at which the bristle slips (Dahl's equation). position: (n,), any unit."""
    bend = np.zeros(position.shape[0])
    for k in range(1, position.shape[0]):
        travel = (position[k] - position[k - 1]) / longest
        full = np.sign(travel)
        bend[k] = full + (bend[k - 1] - full) * np.exp(-abs(travel))
    return bend
