"""Commands counted the other way round: the turned model answers to them as the model did before."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.command_sign import CROSS_AXIS_TILTS, DIRECTION_PAIRS, SIGN_REVERSED, reverse_commands
from equalizer.effects.discovered_law import Channels
from equalizer.effects.placing import find_device_part, place_effects
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.laws.law import parse_law
from equalizer.plant.mechanical_model import ModelEffect

RATE_HZ, SAMPLES = 1000.0, 1500
INPUTS, OUTPUTS = ("fx", "fy", "fz"), ("ax", "ay", "az")
COMMANDS = 3 * sosfilt(
    butter(2, 40.0, fs=RATE_HZ, output="sos"), np.random.default_rng(5).normal(size=(SAMPLES, 3)), axis=0
)
WAY = np.array([1.0, -1.0, 1.0])

# Each number that may turn is far from what turning leaves alone.
NUMBERS = {
    "coulomb_friction": {"level": 0.1},
    "asymmetric_friction": {"level_positive": 0.05, "level_negative": 0.2},
    "stribeck_friction": {"coulomb": 0.05, "static": 0.1, "speed": 0.01},
    "position_dependent_friction": {"level": 0.1, "slope_per_m": 300.0, "bend_per_m2": 0.0},
    "presliding_hysteresis": {"level": 0.1, "stiffness": 2e3},
    "viscous_damping": {"damping": 3.0},
    "quadratic_damping": {"coefficient": 20.0},
    "hardening_stiffness": {"k3": 1e7},
    "asymmetric_stiffness": {"k2": 3e4},
    "constant_force": {"force": 0.3},
    "gravity_torque": {"torque": 0.3, "angle": 0.7},
    "cogging": {"amplitude": 0.2, "pitch": 0.002, "phase": 0.7},
    # Damped so that blows do not rebound: rebounds would grow rounding errors.
    "backlash": {"gap": 1e-4, "motor_mass": 0.1, "contact_stiffness": 1e5, "contact_damping": 50.0},
    "loose_joint": {"gap": 1e-4, "stiffness": 500.0, "slip": 0.01},
    "end_stop": {"position": 5e-4, "stiffness": 1e4, "opposite": 0.3},
    "pose_dependent_inertia": {"per_m": 50.0, "speed_share": 0.5},
    "extra_mode": {"frequency": 50.0, "mass": 0.05, "damping_ratio": 0.05, "tilt_next": 0.6, "tilt_after_next": -0.3},
    "added_mass": {"mass": 0.1},
    "hand_impedance": {"mass": 0.1, "damping": 1.0, "stiffness": 50.0},
    "time_varying_grip": {"rate_hz": 1.0, "depth": 0.5, "phase": 0.3, "stiffness_share": 1.0},
    "body_on_actuator": {"mass": 0.1, "damping": 2.0, "stiffness": 500.0},
    "force_saturation": {"limit": 0.5},
    "force_deadband": {"width": 0.2, "jump": 0.0},
    "slew_limit": {"rate": 50.0},
    "amplifier_lag": {"time_constant": 0.01},
    "transport_delay": {"delay": 0.01},
    "force_gain": {"gain": 1.3},
    "force_nonlinearity": {"square": 0.5, "reference": 1.0},
    "sensor_offset": {"offset": 0.3},
    "sensor_nonlinearity": {"cubic": 0.1},
}


def apart(bench, effect: ModelEffect) -> float:
    """What turning changes in the answer, over what the effect does; and the effect does something."""
    plain = bench.three_axes()
    model = replace(plain, effects=(effect,))
    turned = reverse_commands(model, WAY, INPUTS, OUTPUTS)
    before = simulate_mechanism(model, COMMANDS, RATE_HZ, place_effects(model, Channels(INPUTS, OUTPUTS)))
    after = simulate_mechanism(turned, COMMANDS * WAY, RATE_HZ, place_effects(turned, Channels(INPUTS, OUTPUTS)))
    without = simulate_mechanism(plain, COMMANDS, RATE_HZ)
    done = np.std(before.response - without.response)
    assert done > 0
    return float(np.std(after.response - before.response) / done)


@pytest.mark.parametrize(("side", "way"), [(2.5, 1.0), (-1.0, -1.0), (0.0, -1.0)])
def test_of_a_side_the_sign_counts_and_zero_is_as_none(bench, side, way):
    packed = EFFECTS["end_stop"].action.pack(bench.three_axes(), 0, FAR_STOP | {"side": side, "opposite": 0.3})
    assert packed.tolist() == [way * FAR_STOP["position"], FAR_STOP["stiffness"], way, -way, 0.0 if side else 0.3]


@pytest.mark.parametrize("kind", sorted(NUMBERS))
def test_the_turned_model_answers_to_the_turned_command_as_before(bench, kind):
    axis = None if "one" not in EFFECTS[kind].sites else "y"
    assert apart(bench, ModelEffect(kind, axis, NUMBERS[kind])) < 1e-6


FAR_STOP = {"position": -2e-4, "stiffness": 1e4, "side": 1.0}


def test_a_stop_beyond_zero_turns_with_its_side(bench):
    assert apart(bench, ModelEffect("end_stop", "y", FAR_STOP)) < 1e-6


def test_a_stop_beyond_zero_pushes_as_its_law_written_out(bench):
    law = parse_law("-1e4*maximum(y + 2e-4, 0)", "force", "y")
    answers = [
        simulate_mechanism(model, COMMANDS, RATE_HZ, place_effects(model, Channels(INPUTS, OUTPUTS))).response
        for effect in (
            ModelEffect("end_stop", "y", FAR_STOP | {"opposite": 0.5}),
            ModelEffect("discovered_law", "y", {}, law),
        )
        for model in [replace(bench.three_axes(), effects=(effect,))]
    ]
    without = simulate_mechanism(bench.three_axes(), COMMANDS, RATE_HZ).response
    assert np.std(answers[0] - answers[1]) < 0.02 * np.std(answers[1] - without)


def test_every_effect_that_pushes_or_is_pushed_was_turned():
    assert {each.name for each in CATALOGUE if find_device_part(each) != "sensor"} <= set(NUMBERS)
    assert {*SIGN_REVERSED, *DIRECTION_PAIRS, *CROSS_AXIS_TILTS} <= set(NUMBERS)


def test_an_effect_of_all_axes_is_split_where_some_turn(bench):
    effect = ModelEffect("constant_force", None, {"force": 0.3})
    assert apart(bench, effect) < 1e-9
    turned = reverse_commands(replace(bench.three_axes(), effects=(effect,)), WAY, INPUTS, OUTPUTS)
    assert [(each.axis, each.parameters["force"]) for each in turned.effects] == [("x", 0.3), ("y", -0.3), ("z", 0.3)]


@pytest.mark.parametrize("text", ["-1e4*y**2 - 0.3", "-5.0*vy*abs(vy) + 20.0*x", "-0.2*sign(vy) + 0.1*fy", "300.0*z"])
def test_a_law_without_a_name_turns_with_its_axis_and_its_signals(bench, text):
    assert apart(bench, ModelEffect("discovered_law", "y", {}, parse_law(text, "force", "y"))) < 1e-6
    assert apart(bench, ModelEffect("discovered_law", "x", {}, parse_law(text, "force", "x"))) < 1e-6


@pytest.mark.parametrize("text", ["1.3*fy + 0.2", "fy - 0.3*fy**2"])
def test_a_map_of_the_command_turns(bench, text):
    assert apart(bench, ModelEffect("discovered_law", "y", {}, parse_law(text, "command", "y"))) < 1e-9
