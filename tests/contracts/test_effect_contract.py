"""What every effect of the catalogue keeps to, on invented devices: see effect_bench.py."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import JointForce, OnResponse, Structure
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES, EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import ModelEffect, find_effect_problems

ALL = sorted(EFFECTS)
BY_WHOLE_RECORD = ("sensor_drift", "logger_offset", "lost_samples")
"""A slope from the first sample to the last; an interpolation by what comes before and after; chance."""
FRICTION = ("coulomb_friction", "asymmetric_friction", "stribeck_friction", "presliding_hysteresis", "cogging")
LINEAR = (
    "viscous_damping", "constant_force", "extra_mode", "added_mass", "hand_impedance", "body_on_actuator",
    "amplifier_lag", "transport_delay", "force_gain", "sensor_lag", "sensor_gain", "sensor_misalignment",
    "cross_axis_sensitivity", "sensor_offset",
)  # fmt: skip
NOTHING_DB = -200.0


@pytest.fixture(scope="module")
def bench(module_at) -> ModuleType:
    return module_at(Path(__file__).parent / "effect_bench.py")


@pytest.fixture(scope="module")
def played(bench):
    """The response to the bench's commands, by effect, as the effect's example is."""

    def play(name, placed, stop=None):
        model = bench.bench_of(name)
        return simulate_mechanism(model, bench.commands(model.inputs, periods=1)[:stop], bench.RATE_HZ, placed)

    return play


def test_the_catalogue_is_the_vocabulary_in_its_order():
    assert [effect.name for effect in CATALOGUE] == [effect.name for effect in EFFECT_ENTRIES if effect.name in EFFECTS]
    assert set(EFFECTS) == set(EFFECTS_BY_NAME)


@pytest.mark.parametrize("name", ALL)
def test_an_effect_says_what_it_is(name):
    effect = EFFECTS[name]
    assert effect.equation and effect.source and effect.signature
    assert all(simpler in EFFECTS for simpler in effect.simpler)
    assert any(number.none is not None for number in effect.parameters)
    assert all(number.lower < number.upper for number in effect.parameters)


@pytest.mark.parametrize("name", ALL)
def test_what_is_reported_is_a_valid_entry_of_the_vocabulary(name, bench):
    reported = EFFECTS[name].report(bench.EXAMPLES[name])
    assert not list(find_effect_problems(ModelEffect(name, None, reported)))
    assert EFFECTS_BY_NAME[name].main.name in reported


@pytest.mark.parametrize("name", ALL)
def test_without_strength_nothing_changes(name, bench, played):
    model = bench.bench_of(name)
    without, absent = played(name, ()), played(name, bench.absent(name, model))
    np.testing.assert_allclose(absent.response, without.response, atol=1e-9)
    np.testing.assert_allclose(absent.position, without.position, atol=1e-12)


@pytest.mark.parametrize("name", ALL)
def test_a_play_is_finite_repeats_and_knows_no_future(name, bench, played):
    placed = bench.example(name, bench.bench_of(name))
    once, again = played(name, placed), played(name, placed)
    assert np.isfinite(once.response).all() and np.isfinite(once.position).all()
    np.testing.assert_array_equal(once.response, again.response)
    if name not in BY_WHOLE_RECORD:
        half = len(once.response) // 2
        np.testing.assert_allclose(played(name, placed, half).response[:-9], once.response[: half - 9], atol=1e-8)


@pytest.mark.parametrize("name", [effect.name for effect in CATALOGUE if isinstance(effect.action, OnResponse)])
def test_a_sensor_leaves_the_motion_alone(name, bench, played):
    with_it, without = played(name, bench.example(name, bench.bench_of(name))), played(name, ())
    np.testing.assert_array_equal(with_it.axis_position, without.axis_position)
    assert np.abs(with_it.response - without.response).max() > 1e-3
    if EFFECTS[name].action.on_position is None:
        np.testing.assert_array_equal(with_it.position, without.position)


@pytest.mark.parametrize("name", LINEAR)
def test_linear_effects_leave_silent_lines_silent(name, bench):
    model = bench.bench_of(name)
    found = bench.distortion(model, bench.example(name, model))
    assert max(found.odd + found.even) < NOTHING_DB


@pytest.mark.parametrize("name", (*FRICTION, "force_deadband"))
def test_odd_harmonics_of_friction_fall_as_the_level_rises(name, bench):
    found = bench.distortion(bench.one_axis(), bench.example(name, bench.one_axis()))
    assert found.odd[0] > found.odd[1] + 6 > found.odd[2] + 9
    assert name in ("cogging", "asymmetric_friction") or max(found.even) < NOTHING_DB


@pytest.mark.parametrize("name", ("quadratic_damping", "hardening_stiffness", "slew_limit", "sensor_nonlinearity"))
def test_odd_harmonics_of_smooth_laws_rise_with_the_level(name, bench):
    found = bench.distortion(bench.one_axis(), bench.example(name, bench.one_axis()))
    assert found.odd[0] + 6 < found.odd[1] < found.odd[2] - 4
    assert max(found.even) < NOTHING_DB


@pytest.mark.parametrize("name", ("asymmetric_stiffness", "pose_dependent_inertia"))
def test_even_harmonics_of_even_laws_rise_with_the_level(name, bench):
    found = bench.distortion(bench.one_axis(), bench.example(name, bench.one_axis()))
    assert found.even[0] + 6 < found.even[1] < found.even[2] - 4
    assert all(even > odd for even, odd in zip(found.even, found.odd, strict=True))


def test_cogging_makes_odd_and_even_harmonics_alike(bench):
    found = bench.distortion(bench.one_axis(), bench.example("cogging", bench.one_axis()))
    np.testing.assert_allclose(found.odd, found.even, atol=4)


@pytest.mark.parametrize("name", ("force_saturation", "sensor_clipping", "end_stop"))
def test_limits_show_at_the_top_level_alone(name, bench):
    found = bench.distortion(bench.one_axis(), bench.example(name, bench.one_axis()))
    assert max(found.odd[:2]) < NOTHING_DB < -60 < found.odd[2]


def test_friction_that_depends_on_the_place_makes_even_harmonics_and_plain_friction_none(bench):
    found = bench.distortion(bench.one_axis(), bench.example("position_dependent_friction", bench.one_axis()))
    assert found.even[0] > -40 and found.odd[0] > found.odd[2] + 9


def test_asymmetric_friction_pulls_while_the_axis_moves(bench):
    model = bench.one_axis()
    played = bench.measured(model, bench.example("asymmetric_friction", model), bench.commands(1), None).played
    assert played.axis_force.mean() == pytest.approx(-(0.1 - 0.05) / 2, rel=0.2)


def test_play_shows_most_of_all_at_low_levels_and_hardly_in_the_position(bench):
    model = bench.one_axis()
    rattling = bench.example("backlash", model)
    response, position = (bench.distortion(model, rattling, of) for of in ("response", "position"))
    assert response.even[0] > response.even[2] > -20
    assert max(position.odd) < -30


def test_a_grip_that_comes_and_goes_makes_periods_differ_the_more_the_higher_the_level(bench):
    model, n = bench.one_axis(), int(bench.PERIOD_S * bench.RATE_HZ)
    differ = []
    for level in bench.LEVELS_N:
        command = np.tile(level * bench.odd_multisine(5), 4)[:, None]
        answer = simulate_mechanism(model, command, bench.RATE_HZ, bench.example("time_varying_grip", model)).response
        periods = answer[n:].reshape(3, n)
        differ.append(np.std(periods - periods.mean(axis=0)))
    np.testing.assert_allclose(np.divide(differ, bench.LEVELS_N), differ[0] / bench.LEVELS_N[0], rtol=1e-6)
    assert differ[0] > 0.01


def test_an_effect_at_an_axis_that_is_not_there_is_refused(bench):
    with pytest.raises(ValueError, match="coulomb_friction is placed at axis 4; the model has 1"):
        simulate_mechanism(
            bench.one_axis(), np.zeros((9, 1)), 1000.0, bench.placed("coulomb_friction", {"level": 1}, 3)
        )


def test_more_forces_than_can_be_played_are_refused(bench):
    model = bench.one_axis()
    names = ("coulomb_friction", "quadratic_damping", "hardening_stiffness", "asymmetric_stiffness", "constant_force",
             "cogging", "end_stop")  # fmt: skip
    many = tuple(each for name in names for each in bench.example(name, model))
    with pytest.raises(ValueError, match="7 different force laws act at once; simulate at most 6"):
        simulate_mechanism(model, np.zeros((9, 1)), 1000.0, many)


def test_structures_and_joints_keep_the_mass_that_was_there(bench):
    model = bench.one_axis()
    for effect in CATALOGUE:
        if not isinstance(effect.action, Structure | JointForce):
            continue
        changed = effect.action.change(model, 0, bench.EXAMPLES[effect.name])
        grown = changed[0] if isinstance(changed, tuple) else changed
        moving_together = [whole.mass.sum() for whole in (model, grown)]
        added = bench.EXAMPLES[effect.name].get("mass", 0.0)
        split = bench.EXAMPLES[effect.name].get("motor_mass", 0.0)
        assert moving_together[1] == pytest.approx(moving_together[0] + added), split
