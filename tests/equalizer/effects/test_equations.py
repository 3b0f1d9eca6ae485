"""The compiled laws of motion against their equations, as `Effect.equation` states them, solved by another integrator.

A block on a spring and a damper under a force that is held for a millisecond: `simulate_mechanism` with the effect, and
Runge-Kutta steps of the equation written out anew, none of which calls the law's code. Friction's jump at v = 0 is a
steep tanh there; what sticks is in tests/contracts/test_effect_recovery.py, from event to event.
"""

from math import exp, pi, sin, tanh
from typing import NamedTuple

import numpy as np
import pytest

from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel

MASS, DAMPING, STIFFNESS = 0.3, 2.0, 150.0
PARTS, PARTS_OF_A_JUMP = 5, 25
"""Steps of the other integrator per millisecond; and where the force turns with the sign of the speed."""
JUMPS = {
    "coulomb_friction", "asymmetric_friction", "stribeck_friction", "position_dependent_friction",
    "presliding_hysteresis",
}  # fmt: skip
SHARP = 2e-4
"""m/s in which the other integrator's sign turns: well below the speeds that are played."""


class Now(NamedTuple):
    """The block at a moment."""

    x: float
    v: float
    t: float
    z: float
    """Deflection of a bristle (presliding)."""
    pull: float
    """All other forces, N."""


def sign(v):
    return tanh(v / SHARP)


def above(x, place):
    """How far x is above a place, m."""
    return max(x - place, 0.0)


def pose_dependent(at, per_m, speed_share):
    """-per_m M (x a + speed_share v²), with a from M a = pull + this force."""
    a = (at.pull / MASS - per_m * speed_share * at.v**2) / (1 + per_m * at.x)
    return -per_m * MASS * (at.x * a + speed_share * at.v**2)


LAWS = {
    "viscous_damping": lambda at, damping: -damping * at.v,
    "quadratic_damping": lambda at, coefficient: -coefficient * at.v * abs(at.v),
    "hardening_stiffness": lambda at, k3: -k3 * at.x**3,
    "asymmetric_stiffness": lambda at, k2: -k2 * at.x**2,
    "constant_force": lambda at, force: force,
    "gravity_torque": lambda at, torque, angle: -torque * sin(at.x + angle),
    "cogging": lambda at, amplitude, pitch, phase: amplitude * sin(2 * pi * at.x / pitch + phase),
    "end_stop": lambda at, position, stiffness, opposite: (
        -stiffness * (above(at.x, position) - opposite * above(-at.x, position))
    ),
    "pose_dependent_inertia": pose_dependent,
    "time_varying_grip": lambda at, rate_hz, depth, phase, stiffness_share: (
        -depth * sin(2 * pi * rate_hz * at.t + phase) * (DAMPING * at.v + stiffness_share * STIFFNESS * at.x)
    ),
    "coulomb_friction": lambda at, level: -level * sign(at.v),
    "asymmetric_friction": lambda at, level_positive, level_negative: (
        -(level_positive if at.v > 0 else level_negative) * sign(at.v)
    ),
    "stribeck_friction": lambda at, coulomb, static, speed: (
        -(coulomb + (static - coulomb) * exp(-((at.v / speed) ** 2))) * sign(at.v)
    ),
    "position_dependent_friction": lambda at, level, slope_per_m, bend_per_m2: (
        -max(level * (1 + slope_per_m * at.x + bend_per_m2 * at.x**2), 0.0) * sign(at.v)
    ),
    "presliding_hysteresis": lambda at, level, stiffness: -stiffness * at.z,
}
"""The force, as the equation says it."""
VALUES = {
    "asymmetric_stiffness": {"k2": 2000.0},
    "constant_force": {"force": -0.7},
    "gravity_torque": {"torque": 20.0, "angle": 0.3},
    "cogging": {"amplitude": 0.4, "pitch": 0.02, "phase": 0.7},
    "end_stop": {"position": 0.005, "stiffness": 3000.0, "opposite": 0.4},
    "time_varying_grip": {"rate_hz": 2.3, "depth": 0.5, "phase": 1.0, "stiffness_share": 0.6},
}
"""Where those of the bench are too weak or too strong for this block."""


def pushed() -> np.ndarray:
    """(n,), N: strong enough that the block hardly ever stands still."""
    time_s = np.arange(500) / 1000
    return 2.5 * np.sin(2 * np.pi * 3.1 * time_s) + 0.8 * np.sin(2 * np.pi * 11.3 * time_s + 1)


def solved(name: str, values: dict[str, float], force: np.ndarray) -> np.ndarray:
    """(n,): velocities at the samples, by Runge-Kutta steps of fourth order."""
    parts = PARTS_OF_A_JUMP if name in JUMPS else PARTS
    step_s = 1e-3 / parts
    bends = name == "presliding_hysteresis"
    state, time_s, found = (0.0, 0.0, 0.0), 0.0, []

    def rates(state, time_s, u):
        x, v, z = state
        at = Now(x, v, time_s, z, u - DAMPING * v - STIFFNESS * x)
        bristle = v - values["stiffness"] * abs(v) * z / values["level"] if bends else 0.0
        return v, (at.pull + LAWS[name](at, **values)) / MASS, bristle

    def moved(state, rate, by_s):
        return tuple(value + by_s * slope for value, slope in zip(state, rate, strict=True))

    for u in force.tolist():
        found.append(state[1])
        for _ in range(parts):
            first = rates(state, time_s, u)
            second = rates(moved(state, first, step_s / 2), time_s + step_s / 2, u)
            third = rates(moved(state, second, step_s / 2), time_s + step_s / 2, u)
            last = rates(moved(state, third, step_s), time_s + step_s, u)
            slopes = zip(first, second, third, last, strict=True)
            mean = tuple((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in slopes)
            state, time_s = moved(state, mean, step_s), time_s + step_s
    return np.array(found)


@pytest.mark.parametrize("name", LAWS)
def test_a_law_does_what_its_equation_says(name, bench):
    values = VALUES.get(name, bench.EXAMPLES[name])
    matrices = (np.array([[number]]) for number in (MASS, DAMPING, STIFFNESS))
    block = MechanicalModel("block", "acceleration", *matrices, np.eye(1), np.eye(1))
    force = pushed()
    played = simulate_mechanism(block, force[:, None], 1000.0, bench.placed(name, values, 0)).axis_velocity[:, 0]
    plain = simulate_mechanism(block, force[:, None], 1000.0).axis_velocity[:, 0]
    right = solved(name, values, force)
    assert np.std(played - plain) > 0.03 * np.std(plain)
    assert np.std(played - right) < 0.01 * np.std(played - plain)
