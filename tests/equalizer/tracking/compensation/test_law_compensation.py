"""Laws without a name in the feedforward: taken off where the catalogue's same law is, undone where a map can be."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import parse_law
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from equalizer.tracking.compensation.effect_compensation import compensate, find_effect_axes
from equalizer.tracking.compensation.law_compensation import (
    HAS_MEMORY,
    NOT_INVERTIBLE,
    NOT_OF_MOTION_ALONE,
    NOT_OF_OWN_COMMAND_ALONE,
    SENSOR_ERROR,
    explain_law_not_compensated,
)
from equalizer.tracking.compensation.subtract_effects import subtract_effects

RATE_HZ, BAND_HZ, N = 1000.0, (5.0, 35.0), 1000
FORCES, ACCELERATIONS = ("fx", "fy", "fz"), ("ax", "ay", "az")
MODEL = IdentifiedModel(
    np.zeros((1, 1)), np.zeros((1, 3)), np.zeros((3, 1)), 4 * np.eye(3), RATE_HZ, BAND_HZ, "N", "m/s^2", FORCES,
    ACCELERATIONS,
)  # fmt: skip
TIME_S = np.arange(N) / RATE_HZ
WANTED = np.hanning(N)[:, None] * np.column_stack([np.sin(2 * np.pi * hz * TIME_S) for hz in (11, 17, 23)])
PUSHED = WANTED / 4


def physics(*effects: ModelEffect) -> MechanicalModel:
    one = np.eye(3)
    return MechanicalModel("device", "acceleration", 0.25 * one, one, one, one, one, effects=effects)


def found(text: str, acts_on: str = "force") -> ModelEffect:
    return ModelEffect("discovered_law", "y", {}, parse_law(text, acts_on, "y"))


SAME = [
    ("-5.0*vy*abs(vy)", ModelEffect("quadratic_damping", "y", {"coefficient": 5.0})),
    ("-3e7*y**3", ModelEffect("hardening_stiffness", "y", {"k3": 3e7})),
    ("-0.1*sign(vy)", ModelEffect("coulomb_friction", "y", {"level": 0.1})),
]


@pytest.mark.parametrize("identified_with_n", [None, 0.3])
@pytest.mark.parametrize(("text", "named"), SAME, ids=[named.kind for _, named in SAME])
def test_a_force_law_is_compensated_as_the_catalogues_same_law(text, named, identified_with_n):
    one, other = (
        compensate(PUSHED, WANTED, MODEL, physics(effect), identified_with_n) for effect in (found(text), named)
    )
    changed = np.std(other.forces - PUSHED)
    assert changed > 0
    assert np.std(one.forces - other.forces) < 1e-6 * changed
    assert [effect.kind for effect in one.used] == ["discovered_law"]


@pytest.mark.parametrize(("text", "named"), SAME, ids=[named.kind for _, named in SAME])
def test_a_recording_is_freed_of_a_law_as_of_the_catalogues_same_law(text, named):
    recording = Recording(
        "device",
        Signal(PUSHED, RATE_HZ, "force", "N", FORCES),
        Signal(WANTED, RATE_HZ, "acceleration", "m/s^2", ACCELERATIONS),
    )
    one, other = (
        subtract_effects(recording, physics(effect), (5.0, 35.0)).command.samples for effect in (found(text), named)
    )
    assert np.std(other - PUSHED) > 0
    assert one == pytest.approx(other, abs=1e-9)


def test_a_force_between_axes_is_taken_off_along_the_motion_of_the_other():
    done = compensate(PUSHED, WANTED, MODEL, physics(found("-30.0*vx*x")), None)
    added = done.forces - PUSHED
    assert np.std(added[:, 1]) > 0
    assert not added[:, [0, 2]].any()
    # At twice the other axis's frequency.
    lines = np.abs(np.fft.rfft(added[:, 1]))
    assert np.argmax(lines[5:]) + 5 == 22


def test_a_command_map_is_undone():
    law = "0.8*fy + 0.6*fy**3"
    done = compensate(PUSHED, WANTED, MODEL, physics(found(law, "command")), None)
    played = done.forces[:, 1]
    assert 0.8 * played + 0.6 * played**3 == pytest.approx(PUSHED[:, 1], abs=1e-5)
    assert done.forces[:, [0, 2]] == pytest.approx(PUSHED[:, [0, 2]])
    small = compensate(PUSHED, WANTED, MODEL, physics(found(law, "command")), 0.001).forces[:, 1]
    assert small[np.abs(PUSHED[:, 1]) < 0.02] == pytest.approx(PUSHED[np.abs(PUSHED[:, 1]) < 0.02, 1], abs=1e-4)


def test_a_weak_actuator_gets_a_command_far_above_the_force():
    done = compensate(PUSHED, WANTED, MODEL, physics(found("0.1*fy", "command")), None)
    assert done.not_used == ()
    assert 0.1 * done.forces[:, 1] == pytest.approx(PUSHED[:, 1], abs=1e-9)


@pytest.mark.parametrize("width", [0.05, 3.0])
def test_a_dead_band_is_crossed_as_the_catalogues_is(width):
    law = f"maximum(fy - {width}, 0.0) + minimum(fy + {width}, 0.0)"
    named = ModelEffect("force_deadband", "y", {"width": width})
    by_law, by_name = (
        compensate(PUSHED, WANTED, MODEL, physics(effect), None).forces[:, 1]
        for effect in (found(law, "command"), named)
    )
    assert by_law == pytest.approx(by_name, abs=0.02 * width)
    assert by_law[0] == by_law[-1] == 0.0
    assert np.abs(np.diff(by_law)).max() <= 1.1 * np.abs(np.diff(by_name)).max()


def test_a_dead_band_on_one_side_is_at_rest_without_force():
    law = "maximum(fy - 0.2, 0.0) + minimum(fy, 0.0)"
    commands = compensate(PUSHED, WANTED, MODEL, physics(found(law, "command")), None).forces[:, 1]
    assert commands[0] == 0.0 and commands.min() == pytest.approx(PUSHED[:, 1].min(), rel=0.01)
    assert commands.max() == pytest.approx(PUSHED[:, 1].max() + 0.2, rel=0.01)


def test_a_map_near_saturation_does_not_use_up_the_cap_of_other_effects():
    peak = np.abs(PUSHED[:, 1]).max()
    near = found(f"{peak * 1.0001} * 0.63662 * atan(fy/{peak * 0.63662})", "command")
    alone = compensate(PUSHED, WANTED, MODEL, physics(near), None, cap_n=3.0)
    assert alone.share == 1.0
    assert np.abs(alone.forces[:, 1]).max() <= 2 * peak * (1 + 1e-9)


def test_a_force_beyond_saturation_gets_the_smallest_range_of_commands():
    done = compensate(PUSHED, WANTED, MODEL, physics(found("0.1*tanh(fy/0.1)", "command")), None)
    assert np.abs(done.forces[:, 1]).max() <= 2 * np.abs(PUSHED[:, 1]).max() * (1 + 1e-9)


@pytest.mark.parametrize("text", ["1.0*fy - 0.5*fy**3", "0.2*sin(5*fy)"])
def test_a_map_that_falls_only_beyond_the_commands_needed_is_inverted(text):
    weak = PUSHED * (0.05 / np.abs(PUSHED[:, 1]).max())
    law = found(text, "command")
    done = compensate(weak, WANTED, MODEL, physics(law), None)
    assert not done.not_used
    played = evaluate(law.law, {"fy": done.forces[:, 1]}, RATE_HZ)
    assert np.abs(played - weak[:, 1]).max() < 1e-3 * np.abs(weak[:, 1]).max()


def test_a_map_that_falls_among_the_commands_needed_is_refused():
    strong = PUSHED * (2.0 / np.abs(PUSHED[:, 1]).max())
    with pytest.raises(ValueError, match="decreases somewhere, so it has no inverse"):
        compensate(strong, WANTED, MODEL, physics(found("1.0*sin(fy)", "command")), None)


@pytest.mark.parametrize(
    ("text", "acts_on", "why"),
    [
        ("0.1*fy*sin(y/0.01)", "force", NOT_OF_MOTION_ALONE),
        ("lag(fy, 0.01)", "command", HAS_MEMORY),
        ("fy + 0.1*fx", "command", NOT_OF_OWN_COMMAND_ALONE),
        ("-1.0*abs(fy)", "command", NOT_INVERTIBLE),
        ("2.0*ay", "response", SENSOR_ERROR),
        ("0*fy", "command", NOT_INVERTIBLE),
    ],
)
def test_what_cannot_be_compensated_says_why(text, acts_on, why):
    known = physics(found(text, acts_on))
    done = compensate(PUSHED, WANTED, MODEL, known, None)
    assert done.not_used == ((known.effects[0], why),)
    assert done.forces == pytest.approx(PUSHED)


@pytest.mark.parametrize(("axis", "inputs"), [("u", ("u",)), ("m2", ("m1", "m2")), ("x", ("a", "x"))])
def test_a_command_map_is_of_its_own_axis_also_where_channels_are_not_named_by_letters(axis, inputs):
    """A formula calls the commands fx, fy, fz in their order."""
    own, other = f"f{'xyz'[len(inputs) - 1]}", "fx"
    law = parse_law(f"{own} + 0.1*{own}*abs({own})", "command", axis)
    assert explain_law_not_compensated(law, inputs) == ""
    if other != own:
        law = parse_law(f"{other} + 0.1*{other}*abs({other})", "command", axis)
        assert explain_law_not_compensated(law, inputs) == NOT_OF_OWN_COMMAND_ALONE


TURNED = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("text", ["-5.0*vy*abs(vy) - 30.0*y", "-30.0*vx*x"])
@pytest.mark.parametrize("identified_with_n", [None, 0.5])
def test_the_motion_of_a_turned_sensor_is_turned_back_to_the_axes(text, identified_with_n):
    """The sensor's first channel measures the axis y, its second one -x; so do the outputs of a model, from which the
    motion in its identification follows."""
    straight = physics(found(text))
    along_axes = compensate(PUSHED, WANTED, MODEL, straight, identified_with_n).forces
    turned, turned_model = replace(straight, output=TURNED), replace(MODEL, C=TURNED @ MODEL.C, D=TURNED @ MODEL.D)
    by_sensor = compensate(PUSHED, WANTED @ TURNED.T, turned_model, turned, identified_with_n).forces
    assert np.std(along_axes - PUSHED) > 0
    assert by_sensor == pytest.approx(along_axes, abs=1e-9)


def test_the_cosines_of_a_turned_sensor_may_be_rounded():
    straight, cosine = physics(found("-5.0*vy*abs(vy) - 30.0*y")), np.sqrt(0.5)
    along_axes = compensate(PUSHED, WANTED, MODEL, straight, None).forces
    exact = np.array([[cosine, cosine, 0.0], [-cosine, cosine, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(straight, output=exact.round(3))
    by_sensor = compensate(PUSHED, WANTED @ exact.T, MODEL, turned, None).forces
    assert np.abs(by_sensor - along_axes).max() < 1e-3 * np.abs(along_axes - PUSHED).max()


@pytest.mark.parametrize("gains", [2.0 * TURNED, TURNED * [1.0, 0.5, 4.0], np.diag([1.0, -3.0, 1.0])])
@pytest.mark.parametrize("identified_with_n", [None, 0.5])
def test_the_motion_of_a_sensor_that_is_turned_and_scaled_is_that_of_the_axes(gains, identified_with_n):
    straight = physics(found("-5.0*vy*abs(vy) - 30.0*y"))
    along_axes = compensate(PUSHED, WANTED, MODEL, straight, identified_with_n).forces
    scaled, scaled_model = replace(straight, output=gains), replace(MODEL, C=gains @ MODEL.C, D=gains @ MODEL.D)
    by_sensor = compensate(PUSHED, WANTED @ gains.T, scaled_model, scaled, identified_with_n).forces
    assert by_sensor == pytest.approx(along_axes, abs=1e-9)


def test_an_axis_is_found_by_its_command_where_responses_have_another_order():
    effect = found("-5.0*vy")
    assert find_effect_axes(effect, ("fx", "fy"), ("ay", "ax")) == (1,)
    assert find_effect_axes(effect, ("m1", "m2"), ("ay", "ax")) == (0,)
    assert find_effect_axes(replace(effect, axis="a"), ("ba", "a"), ("s", "t")) == (1,)
