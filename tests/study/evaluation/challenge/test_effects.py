"""Every concealed effect does what its name says, and at zero strength nothing."""

from functools import cache

import numpy as np
import pytest

from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from study.evaluation.challenge.concealed_effect import EffectContext
from study.evaluation.challenge.device import Device, record
from study.evaluation.challenge.draw_case import DECOYS, EFFECTS
from study.evaluation.challenge.sensor import NOISE_MPS2

NEUTRAL = {
    "end_stop": {"position": 1.0},
    "hand_impedance": {"mass": 0.0, "damping": 0.0, "stiffness": 0.0},
    "force_saturation": {"limit": 0.0},
    "slew_limit": {"rate": 0.0},
    "force_gain": {"gain": 1.0},
    "sensor_gain": {"gain": 1.0},
    "sensor_lag": {"bandwidth": 500.0},
    "sensor_clipping": {"limit": 29.43},
    "sensor_misalignment": {"about_x": 0.0, "about_y": 0.0, "about_z": 0.0},
    "asymmetric_friction": {"level_positive": 0.0, "level_negative": 0.0},
    "cross_axis_sensitivity": {"from_next": 0.0, "from_after_next": 0.0},
    "extra_mode": {"mass": 0.0},
    "time_varying_grip": {"depth": 0.0},
    "bending_sensor": {"bend": 0.0, "play": 0.0},
    "stiffness_in_time": {"depth": 0.0},
    "skipped_commands": {"every": 0.0},
}
"""What `no_equalization` means, where it is not the main number at zero."""
LINEAR = {
    "viscous_damping", "extra_mode", "added_mass", "hand_impedance", "amplifier_lag", "transport_delay", "force_gain",
    "sensor_lag", "sensor_misalignment", "cross_axis_sensitivity", "sensor_gain", "logger_offset",
}  # fmt: skip
ODD = {
    "coulomb_friction", "stribeck_friction", "presliding_hysteresis", "quadratic_damping", "hardening_stiffness",
    "backlash", "force_saturation", "force_deadband", "slew_limit", "sensor_clipping", "sensor_nonlinearity",
    "bending_sensor", "damping_of_place", "force_hysteresis",
}  # fmt: skip
EVEN = {
    "asymmetric_friction", "position_dependent_friction", "asymmetric_stiffness", "constant_force", "cogging",
    "pose_dependent_inertia", "sensor_offset", "crossed_axes",
}  # fmt: skip
STEPS = 6
"""Of the integration in each sample: what an effect does to the motion is seen with few."""
TRAVEL_M = 4e-3
"""Of the bench of these tests, about."""
ALL = {**EFFECTS, **DECOYS}


def drawn(bench, name, strength, seed=3):
    at = EffectContext(np.random.default_rng(seed), strength, bench, 0, np.full(3, TRAVEL_M), np.full(3, 12.0))
    return ALL[name].draw(at)


def heard(device, command):
    """The reading without its noise, (samples, 3), m/s^2, and the position, m."""
    response, position = record(device, command, np.random.default_rng(1))
    return response - at_rest(device.bench, len(command)), position


@cache
def at_rest(bench, samples):
    """The reading without a command and an effect, (samples, 3), m/s^2."""
    return record(Device(bench, steps=STEPS), np.zeros((samples, 3)), np.random.default_rng(1))[0]


@pytest.fixture(scope="module")
def plain(bench, command):
    """Reading and position of the device without an effect."""
    return record(Device(bench, steps=STEPS), command, np.random.default_rng(1))


@pytest.fixture(scope="module")
def plain_start(bench, command):
    return record(Device(bench, steps=STEPS), command[:1500], np.random.default_rng(1))


def with_effect(bench, name, strength=0.8):
    return ALL[name].build(Device(bench, steps=STEPS), 0, drawn(bench, name, strength))


# Without a gap the motor of a backlash still hangs on its contact spring.
@pytest.mark.parametrize("name", [name for name in ALL if name != "backlash"])
def test_at_zero_strength_nothing_changes(bench, command, plain_start, name):
    values = drawn(bench, name, 0.5)
    nothing = NEUTRAL.get(name, {next(iter(values)): 0.0})
    device = ALL[name].build(Device(bench, steps=STEPS), 0, values | nothing)
    there = record(device, command[:1500], np.random.default_rng(1))
    np.testing.assert_allclose(there[0], plain_start[0], atol=1e-6)
    np.testing.assert_allclose(there[1], plain_start[1], atol=1.01e-5)


@pytest.mark.parametrize("name", ALL)
def test_a_strong_effect_is_seen_above_the_noise_and_a_weak_one_is_weaker(bench, command, plain, name):
    devices = (with_effect(bench, name, strength) for strength in (0.0, 1.0))
    readings = (record(device, command, np.random.default_rng(1))[0] for device in devices)
    weak, strong = (np.sqrt(np.mean((reading - plain[0]) ** 2 / NOISE_MPS2, axis=0)) for reading in readings)
    assert strong.max() > max(0.05, 1.2 * weak.max())


@pytest.mark.parametrize("name", sorted(LINEAR))
def test_linear_effects_scale_with_the_command(bench, command, name):
    device = with_effect(bench, name)
    single, double = (heard(device, scale * command)[0] for scale in (0.5, 1.0))
    np.testing.assert_allclose(double, 2 * single, atol=1e-6)


@pytest.mark.parametrize("name", sorted(ODD | EVEN))
def test_nonlinear_effects_do_not_scale_with_the_command(bench, command, name):
    device = with_effect(bench, name)
    single, double = (heard(device, scale * command) for scale in (0.5, 1.0))
    assert np.abs(double[1] - 2 * single[1]).max() > 1e-4 or np.abs(double[0] - 2 * single[0]).max() > 0.05


@pytest.mark.parametrize("name", sorted(ODD - {"backlash"}))
def test_odd_effects_mirror_with_the_command(bench, command, name):
    device = with_effect(bench, name)
    np.testing.assert_allclose(mirrored(device, command), 0.0, atol=0.3)


@pytest.mark.parametrize("name", sorted(EVEN))
def test_even_effects_do_not_mirror(bench, command, name):
    device = with_effect(bench, name)
    one, other = (heard(device, sign * command) for sign in (1, -1))
    assert np.abs(one[0] + other[0]).max() > 0.05 or np.abs(one[1] + other[1]).max() > 1e-4


def mirrored(device, command):
    """Zero where the device answers the mirrored command with the mirrored motion."""
    return sum(heard(device, sign * command)[0] for sign in (1, -1))


@pytest.mark.parametrize("name", [name for name, effect in ALL.items() if effect.place == "sensor"])
def test_a_sensor_leaves_the_position_alone_but_for_the_clock_and_the_line(bench, command, plain, name):
    position = record(with_effect(bench, name), command, np.random.default_rng(1))[1]
    same = np.array_equal(position, plain[1])
    assert same == (name not in ("clock_drift", "lost_samples"))


@pytest.mark.parametrize("name", EFFECTS)
def test_values_have_the_names_of_the_vocabulary(bench, name):
    wanted = {part.name for part in EFFECTS_BY_NAME[name].parameters if not part.optional}
    assert wanted <= set(drawn(bench, name, 0.5))
    assert EFFECTS[name].place == EFFECTS_BY_NAME[name].place


def test_decoys_are_in_no_vocabulary():
    assert not set(DECOYS) & set(EFFECTS_BY_NAME)
