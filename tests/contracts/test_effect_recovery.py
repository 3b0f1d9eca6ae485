"""Effects of the mechanism and of the hand are recovered from their own noisy data; friction against other integrators.

Those of actuators, sensors and clocks: tests/equalizer/effects.
"""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import ALL_SITES
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel
from tests.slow_instances import slow_rows

ONE_AXIS = (
    "coulomb_friction", "asymmetric_friction", "stribeck_friction", "position_dependent_friction",
    "presliding_hysteresis", "viscous_damping", "quadratic_damping", "hardening_stiffness", "asymmetric_stiffness",
    "constant_force", "cogging", "end_stop", "pose_dependent_inertia", "extra_mode", "added_mass", "hand_impedance",
    "time_varying_grip", "body_on_actuator",
)  # fmt: skip
REFINED = ("coulomb_friction", "hardening_stiffness", "quadratic_damping", "added_mass", "hand_impedance", "extra_mode")
"""Those of `ONE_AXIS` that are refined in the quick tests too."""


@pytest.fixture(scope="module")
def bench(module_at) -> ModuleType:
    return module_at(Path(__file__).parent / "effect_bench.py")


def refined(bench, model, name, start, sites, seen) -> dict[str, float]:
    """By least squares of the simulated response and position, from a start; numbers move as in a diagnosis."""
    numbers = EFFECTS[name].parameters
    unit = [abs(start[number.name]) or number.step if number.scale == "signed" else number.step for number in numbers]

    def values(point):
        moved = {
            number.name: start[number.name] * np.exp(x) if number.scale == "log" else start[number.name] + x * size
            for number, x, size in zip(numbers, point, unit, strict=True)
        }
        return {number.name: float(np.clip(moved[number.name], number.lower, number.upper)) for number in numbers}

    def left(point):
        played = simulate_mechanism(model, seen.command, bench.RATE_HZ, bench.placed(name, values(point), *sites))
        response = (seen.response - played.response) / bench.NOISE_MPS2
        return np.hstack([response, (seen.position - played.position) / bench.NOISE_M]).ravel()

    steps = np.array([number.step if number.scale != "linear" else 1.0 for number in numbers])

    def slopes(point):
        moves = steps * np.eye(len(numbers))
        return np.column_stack([(left(point + m) - left(point - m)) / (2 * m.sum()) for m in moves])

    return values(least_squares(left, np.zeros(len(numbers)), jac=slopes, x_scale=steps, max_nfev=12).x)


def started(bench, model, name, sites, seen):
    effect = EFFECTS[name]
    site = sites[0] if "one" in effect.sites or "each" in effect.sites else ALL_SITES
    return effect.starts(bench.evidence(model, seen), site)


def measured_alone(bench, name):
    """Of the effect on one axis: the model, its sites, what is seen, and its first start."""
    model = bench.one_axis()
    placed = bench.example(name, model)
    seen = bench.measured(model, placed, bench.commands(1, periods=1))
    start = started(bench, model, name, placed[0].sites, seen)[0]
    truth, main = bench.EXAMPLES[name], EFFECTS_BY_NAME[name].main.name
    assert start[main] == pytest.approx(truth[main], rel=0.3)
    return model, placed[0].sites, seen, start


@pytest.mark.parametrize("name", ONE_AXIS)
def test_an_effect_starts_near_its_truth(name, bench):
    measured_alone(bench, name)


@pytest.mark.parametrize(
    "name", [name if name in REFINED else pytest.param(name, marks=pytest.mark.slow) for name in ONE_AXIS]
)
def test_an_effect_starts_near_its_truth_and_is_refined_to_it(name, bench):
    model, sites, seen, start = measured_alone(bench, name)
    main = EFFECTS_BY_NAME[name].main.name
    found = refined(bench, model, name, start, sites, seen)
    assert found[main] == pytest.approx(bench.EXAMPLES[name][main], rel=0.02)


@pytest.mark.parametrize(("name", "axis"), [("coulomb_friction", 2), ("extra_mode", 1), *slow_rows(("cogging", 0))])
def test_it_is_recovered_at_one_of_three_axes(name, axis, bench):
    model, truth = bench.three_axes(), dict(bench.EXAMPLES[name])
    if name == "extra_mode":
        truth |= {"tilt_next": 0.15, "tilt_after_next": -0.2}
    seen = bench.measured(model, bench.placed(name, truth, axis), bench.commands(3, periods=1))
    start, main = started(bench, model, name, (axis,), seen)[0], EFFECTS_BY_NAME[name].main.name
    assert start[main] == pytest.approx(truth[main], rel=0.3)
    found = refined(bench, model, name, start, (axis,), seen)
    assert found[main] == pytest.approx(truth[main], rel=0.02)
    if name == "extra_mode":
        assert found["tilt_next"] == pytest.approx(0.15, abs=0.05)
        assert found["tilt_after_next"] == pytest.approx(-0.2, abs=0.05)


def test_play_starts_within_half_of_its_gap_though_its_blows_are_no_waveform(bench):
    model = bench.one_axis()
    seen = bench.measured(model, bench.example("backlash", model), bench.commands(1))
    starts = started(bench, model, "backlash", (0,), seen)
    assert starts[0]["gap"] == pytest.approx(5e-5, rel=0.5)


def test_a_loose_joint_starts_within_a_factor_of_three(bench):
    model = bench.one_axis()
    seen = bench.measured(model, bench.example("loose_joint", model), bench.commands(1, periods=1))
    start = started(bench, model, "loose_joint", (0,), seen)[0]
    assert abs(np.log(start["gap"] / 1e-5)) < np.log(3)


@pytest.mark.parametrize("name", ("coulomb_friction", "quadratic_damping", "hardening_stiffness", "extra_mode"))
def test_where_nothing_is_missing_a_start_has_no_strength(name, bench):
    model = bench.one_axis()
    seen = bench.measured(model, (), bench.commands(1, periods=1))
    strength = next(parameter.name for parameter in EFFECTS[name].parameters if parameter.none is not None)
    starts = started(bench, model, name, (0,), seen)
    assert all(start[strength] < 0.05 * bench.EXAMPLES[name][strength] for start in starts)


BLOCK = {"mass": 0.3, "damping": 2.0, "stiffness": 150.0}


def block() -> MechanicalModel:
    mass, damping, stiffness = (np.array([[BLOCK[name]]]) for name in ("mass", "damping", "stiffness"))
    return MechanicalModel("block", "acceleration", mass, damping, stiffness, np.eye(1), np.eye(1))


def by_events(force: np.ndarray, level: float, back: float, rate_hz: float) -> np.ndarray:
    """(n,): velocities of the block under held forces (n,) and ideal dry friction, from one event to the next."""
    x, v, found = 0.0, 0.0, []
    for pushed in force:
        found.append(v)
        left = 1 / rate_hz
        while left > 1e-12:
            pull = pushed - BLOCK["stiffness"] * x
            if v == 0 and -back <= pull <= level:
                break
            way = np.sign(v) or np.sign(pull)
            rub = -level if way > 0 else back

            def moves(_, state, pushed=pushed, rub=rub):
                x, v = state
                return v, (pushed + rub - BLOCK["damping"] * v - BLOCK["stiffness"] * x) / BLOCK["mass"]

            def stops(time_s, state, way=way):
                return state[1] * way if time_s > 1e-9 else 1.0

            stops.terminal, stops.direction = True, -1
            solved = solve_ivp(moves, (0, left), (x, v), events=stops, rtol=1e-9, atol=1e-13)
            x, v = float(solved.y[0, -1]), float(solved.y[1, -1])
            left -= solved.t[-1]
            v = 0.0 if len(solved.t_events[0]) else v
    return np.array(found)


@pytest.mark.parametrize(
    ("name", "values", "levels"),
    [
        ("coulomb_friction", {"level": 0.2}, (0.2, 0.2)),
        ("asymmetric_friction", {"level_positive": 0.3, "level_negative": 0.1}, (0.3, 0.1)),
    ],
)
def test_friction_sticks_and_slides_as_solved_from_event_to_event(name, values, levels, bench):
    time_s = np.arange(700) / 1000
    force = 0.35 * np.sin(2 * np.pi * 4 * time_s) + 0.25 * np.sin(2 * np.pi * 23 * time_s)
    exact = by_events(force, *levels, 1000.0)
    played = simulate_mechanism(block(), force[:, None], 1000.0, bench.placed(name, values, 0))
    assert (exact == 0).mean() > 0.05
    assert np.std(played.axis_velocity[:, 0] - exact) < 0.005 * np.std(exact)


LAWS_OF_MOTION = (
    "stribeck_friction", "position_dependent_friction", "presliding_hysteresis", "quadratic_damping",
    "hardening_stiffness", "asymmetric_stiffness", "cogging", "end_stop", "pose_dependent_inertia",
    "time_varying_grip",
)  # fmt: skip


@pytest.mark.parametrize("name", LAWS_OF_MOTION)
def test_steps_of_a_quarter_millisecond_are_as_good_as_a_hundred_times_finer_ones(name, bench):
    model, finer = block(), 25
    command = 1.5 * bench.odd_multisine(3)[:1000, None]
    coarse = simulate_mechanism(model, command, 1000.0, bench.example(name, model))
    fine = simulate_mechanism(model, np.repeat(command, finer * 4, axis=0), 1e5, bench.example(name, model))
    off = np.std(coarse.axis_velocity - fine.axis_velocity[:: finer * 4])
    effect = np.std(simulate_mechanism(model, command, 1000.0).axis_velocity - coarse.axis_velocity)
    assert off < 0.02 * effect


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction", {"level": 500.0}),
        ("presliding_hysteresis", {"level": 1.0, "stiffness": 1e9}),
        ("quadratic_damping", {"coefficient": 1e6}),
        ("hardening_stiffness", {"k3": 1e12}),
        ("end_stop", {"position": 1e-4, "stiffness": 1e9}),
        ("loose_joint", {"gap": 1e-5, "stiffness": 1e8, "slip": 0.5}),
        ("backlash", {"gap": 1e-4, "contact_stiffness": 1e9}),
    ],
)
def test_laws_that_are_far_too_steep_for_the_step_stay_bounded(name, values, bench):
    model = bench.one_axis()
    played = simulate_mechanism(model, bench.commands(1, periods=1), 1000.0, bench.placed(name, values, 0))
    free = simulate_mechanism(model, bench.commands(1, periods=1), 1000.0)
    assert np.abs(played.axis_velocity).max() < 3 * np.abs(free.axis_velocity).max()


def test_frictions_at_one_axis_add_up(bench):
    model, command = block(), bench.commands(1, periods=1)
    both = bench.placed("coulomb_friction", {"level": 0.05}, 0) + bench.placed("coulomb_friction", {"level": 0.1}, 0)
    together = simulate_mechanism(model, command, 1000.0, both)
    one = simulate_mechanism(model, command, 1000.0, bench.placed("coulomb_friction", {"level": 0.15}, 0))
    moved = np.std(simulate_mechanism(model, command, 1000.0).axis_velocity - one.axis_velocity)
    assert np.std(together.axis_velocity - one.axis_velocity) < 0.02 * moved
