"""Where starting values come from: an actuator's own data, with noise; and not from a device without the effect."""

import numpy as np
import pytest

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.force_deadband import EFFECT as DEADBAND
from equalizer.effects.force_saturation import EFFECT as SATURATION

ONE, ALL = (1,), (0, 1, 2)
STRONG = [
    ("force_saturation", {"limit": 1.7}, ONE, 0.05),
    ("force_saturation", {"limit": 2.6}, ALL, 0.05),
    ("force_deadband", {"width": 0.05}, ONE, 0.15),
    ("force_deadband", {"width": 0.3}, ALL, 0.15),
    ("force_nonlinearity", {"square": 0.3, "reference": 1.0}, ONE, 0.15),
    ("force_nonlinearity", {"square": -0.2, "reference": 3.0}, ALL, 0.3),
    ("slew_limit", {"rate": 150.0}, ONE, 0.3),
    ("amplifier_lag", {"time_constant": 2e-3}, ALL, 0.5),
    ("amplifier_lag", {"time_constant": 4e-3}, ONE, 0.5),
    ("transport_delay", {"delay": 3.4e-3}, ALL, 0.15),
    ("transport_delay", {"delay": 1.2e-3}, ONE, 0.3),
    ("force_gain", {"gain": 1.2}, ONE, 0.1),
    ("force_gain", {"gain": 0.85}, ALL, 0.1),
]


@pytest.fixture(scope="module")
def command(bench) -> np.ndarray:
    return bench.commands(3)


@pytest.mark.parametrize(("name", "values", "sites", "within"), STRONG, ids=lambda part: str(part))
def test_an_actuators_effect_is_found_near_its_strength(bench, command, name, values, sites, within):
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed(name, values, *sites), command, seed=3)
    evidence = bench.evidence(model, seen)
    main, strength = next(iter(values.items()))
    for site in sites:
        starts = EFFECTS[name].starts(evidence, site)
        assert min(abs(start[main] / strength - 1) for start in starts) < within


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["force_saturation", "slew_limit", "force_deadband", "force_nonlinearity"])
def test_a_device_without_it_suggests_no_strength(bench, command, name, seed):
    model = bench.three_axes()
    evidence = bench.evidence(model, bench.measured(model, (), command, seed))
    assert [EFFECTS[name].starts(evidence, axis) for axis in range(3)] == [(), (), ()]


def test_a_response_that_comes_early_is_no_delay(bench, command):
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed("logger_offset", {"offset": -2e-3}, *ALL), command)
    evidence = bench.evidence(model, seen)
    assert EFFECTS["transport_delay"].starts(evidence, 0) == EFFECTS["amplifier_lag"].starts(evidence, 0) == ()


def test_saturation_and_dead_band_share_a_command_between_them():
    commands = np.linspace(-3, 3, 61)
    cut = SATURATION.action.change(commands, 1e-3, {"limit": 0.8})
    rest = DEADBAND.action.change(commands, 1e-3, {"width": 0.8})
    np.testing.assert_allclose(cut + rest, commands)
    assert np.abs(cut).max() == 0.8
    assert not rest[np.abs(commands) < 0.8].any()


def test_a_gain_scales_the_motion_of_a_linear_device(bench, command):
    model = bench.three_axes()
    plain = bench.measured(model, (), command, seed=None).response
    scaled = bench.measured(model, bench.placed("force_gain", {"gain": 1.3}, *ALL), command, seed=None).response
    np.testing.assert_allclose(scaled, 1.3 * plain, atol=1e-9)


def test_a_dead_band_may_end_with_a_jump():
    commands = np.array([-2.0, -0.5, 0.5, 2.0])
    beyond = DEADBAND.action.change(commands, 1e-3, {"width": 0.8, "jump": 1.0})
    np.testing.assert_allclose(beyond, [-2.0, 0.0, 0.0, 2.0])


def test_a_dead_band_with_a_jump_is_found_as_one(bench, command):
    model = bench.three_axes()
    values = {"width": 0.2, "jump": 1.0}
    seen = bench.measured(model, bench.placed("force_deadband", values, 1), command, seed=3)
    starts = EFFECTS["force_deadband"].starts(bench.evidence(model, seen), 1)
    assert {start["jump"]: start["width"] for start in starts}[1.0] == pytest.approx(0.2, rel=0.1)
