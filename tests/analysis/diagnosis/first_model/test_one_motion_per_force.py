"""Recordings of other forms than one motion per force are brought into one, and what was done is said."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.motion import find_motion_signals
from analysis.diagnosis.data.driven_response import compute_response_significance
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.data.measured_motion import convert_all_to_force_driven
from analysis.diagnosis.first_model import fit_without_model
from analysis.diagnosis.first_model.one_motion_per_force import convert_to_driven_motions
from analysis.diagnosis.limits import DRIVEN_DEVIATIONS
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitError
from equalizer.signals.recording_checks import list_recording_problems
from equalizer.signals.signal import Signal
from tests.analysis.diagnosis.first_model.short_recordings import RATE_HZ, make_recording, simulate_speed, smooth_noise


def test_a_plain_recording_stays_as_it_is():
    push = smooth_noise(2000, 1)
    recording = make_recording([("u", "force", "N", push)], [("v", "velocity", "m/s", simulate_speed(push))])

    assert convert_to_driven_motions((recording,)) == ((recording,), ())


def test_a_temperature_among_the_commands_is_a_condition():
    push, heat = smooth_noise(2000, 1), np.linspace(20, 50, 2000)
    recording = make_recording(
        [("u", "torque", "N m", push), ("T", "temperature", "degC", heat)],
        [("w", "angular velocity", "rad/s", simulate_speed(push))],
    )

    (found,), (said,) = convert_to_driven_motions((recording,))

    assert found.command.channels == ("u",)
    assert found.condition is not None
    assert found.condition.channels == ("T",)
    assert "T among the commands" in said


def test_a_commanded_temperature_beside_the_measured_one_keeps_a_name_of_its_own():
    push, heat = smooth_noise(2000, 1), np.linspace(20, 50, 2000)
    recording = make_recording(
        [("u", "torque", "N m", push), ("T", "temperature", "K", heat)],
        [("w", "angular velocity", "rad/s", simulate_speed(push))],
    )
    measured = Signal(heat[:, None] - 1, recording.sample_rate_hz, "temperature", "K", ("T",))

    (found,), _ = convert_to_driven_motions((replace(recording, condition=measured),))

    assert found.condition is not None
    assert found.condition.channels == ("T", "command T")
    assert list_recording_problems([found]) == ()


def test_two_commands_of_one_motion_become_one():
    first, second = smooth_noise(4000, 1), smooth_noise(4000, 2)
    recording = make_recording(
        [("u1", "voltage", "V", first), ("u2", "voltage", "V", second)],
        [("w", "angular velocity", "rad/s", simulate_speed(first + 0.4 * second))],
    )

    (found,), (said,) = convert_to_driven_motions((recording,))

    assert found.command.channels == ("u1",)
    assert found.command.samples[:, 0] == pytest.approx(first + 0.4 * second, abs=0.02 * first.std())
    assert "one command was made of them" in said


@pytest.mark.parametrize("seed", range(3))
def test_a_virtual_spring_and_the_hand_on_it_are_summed_as_their_unit_says(seed):
    """No gain of a command that is computed from the motion follows from the motion."""
    hand, speed, place, virtual, places = smooth_noise(4000, seed), 0.0, 0.0, [], []
    for push in hand:
        virtual.append(-20 * place)
        places.append(place)
        for _ in range(10):
            speed += (push + virtual[-1] - 0.3 * speed - 0.1 * np.tanh(100 * speed)) / 0.05 / RATE_HZ / 10
            place += speed / RATE_HZ / 10
    measured = np.array(places) + 1e-5 * np.random.default_rng(seed).standard_normal(4000)
    recording = make_recording(
        [("virtual", "force", "N", np.array(virtual)), ("hand", "force", "N", hand)],
        [("x", "position", "m", measured)],
    )

    (found,), _ = convert_to_driven_motions((recording,))

    np.testing.assert_allclose(found.command.samples[:, 0], np.array(virtual) + hand)


@pytest.mark.parametrize("level", [0.0, 0.5, 50.0])
def test_a_command_that_never_changes_is_left_out_and_the_others_are_summed(level):
    first, second = smooth_noise(4000, 1), smooth_noise(4000, 2)
    recording = make_recording(
        [("u1", "force", "N", first), ("u2", "force", "N", second), ("u3", "force", "N", np.full(4000, level))],
        [("v", "velocity", "m/s", simulate_speed(first + 0.4 * second))],
    )

    command = recording.command.samples.copy()
    command[2000:2010] = np.nan

    (found,), (left_out, summed) = convert_to_driven_motions(
        (replace(recording, command=replace(recording.command, samples=command)),)
    )

    known = np.isfinite(command).all(axis=1)
    assert found.command.channels == ("u1",)
    assert np.array_equal(np.isfinite(found.command.samples[:, 0]), known)
    assert found.command.samples[known, 0] == pytest.approx((first + 0.4 * second)[known], abs=0.02 * first.std())
    assert left_out == "u3 among the commands never changes, and was left out."
    assert summed.startswith("u2 drives the same motion as u1")


@pytest.mark.parametrize("share", [0.0, 1e-4])
def test_of_two_commands_with_a_constant_sum_the_difference_drives(share):
    """share: of the drive, that both have in common by chance, as by rounding."""
    push = smooth_noise(4000, 1)
    hum = share * push.std() * np.random.default_rng(4).standard_normal(4000)
    recording = make_recording(
        [("left", "force", "N", 50 + push + hum), ("right", "force", "N", 50 - push + hum)],
        [("v", "velocity", "m/s", simulate_speed(push + 40 * push.std()))],
    )

    (found,), _ = convert_to_driven_motions((recording,))

    drive = found.command.samples[:, 0] - found.command.samples[:, 0].mean()
    assert np.abs(drive) == pytest.approx(np.abs(2 * (push - push.mean())), abs=0.02 * push.std())


def test_a_command_that_never_changes_is_left_out_with_the_motion_of_its_axis():
    """A device of two axes of which only the first was driven."""
    push = smooth_noise(2000, 1)
    recording = make_recording(
        [("fx", "force", "N", push), ("fy", "force", "N", np.zeros(2000))],
        [("x", "velocity", "m/s", simulate_speed(push)), ("y", "velocity", "m/s", 1e-3 * smooth_noise(2000, 3))],
    )

    (found,), said = convert_to_driven_motions((recording,))

    assert (found.command.channels, found.response.channels) == (("fx",), ("x",))
    assert said == ("fy among the commands never changes, and was left out with y, which no command moves.",)
    in_turn = replace(recording, command=replace(recording.command, samples=recording.command.samples[:, ::-1]))
    assert convert_to_driven_motions((recording, in_turn)) == ((recording, in_turn), ())


def test_of_motions_of_several_kinds_the_lowest_is_kept():
    push = smooth_noise(2000, 1)
    speed = simulate_speed(push)
    angle = np.cumsum(speed) / RATE_HZ
    recording = make_recording(
        [("u", "torque", "N m", push)],
        [("q", "angle", "rad", angle), ("w", "angular velocity", "rad/s", speed), ("i", "current", "A", push)],
    )

    (found,), (said,) = convert_to_driven_motions((recording,))

    assert found.response.channels == ("q",)
    assert "w and i" in said


def test_of_several_forces_along_one_motion_the_strongest_is_balanced():
    way = smooth_noise(2000, 1)
    recording = make_recording(
        [("q", "displacement", "m", way)], [("a", "force", "N", 2 * way), ("b", "force", "N", 5 * way)]
    )

    formed, (said,) = convert_to_driven_motions((recording,))
    (driven,) = convert_all_to_force_driven(formed)

    assert (driven.command.channels, driven.response.channels) == (("b",), ("q",))
    assert "for a, import the recording" in said


def test_a_channel_without_a_single_number_is_no_motion_and_no_force():
    """Without a warning, which would be an error here."""
    push, none = smooth_noise(2000, 1), np.full(2000, np.nan)
    moved = make_recording([("f", "force", "N", push)], [("x", "position", "m", none), ("y", "position", "m", push)])
    assert find_motion_signals([moved])[0].channels == ("y",)
    pushed = make_recording([("x", "position", "m", push)], [("f1", "force", "N", none), ("f2", "force", "N", push)])
    assert convert_to_driven_motions((pushed,))[0][0].response.channels == ("f2",)


def test_one_force_along_two_imposed_motions_keeps_both():
    way, far = smooth_noise(2000, 1), smooth_noise(2000, 2)
    recording = make_recording(
        [("q", "displacement", "m", way), ("r", "displacement", "m", far)], [("f", "force", "N", way - far)]
    )

    (driven,) = convert_all_to_force_driven(convert_to_driven_motions((recording,))[0])

    assert (driven.command.channels, driven.response.channels) == (("f",), ("q", "r"))


@pytest.mark.parametrize("seed", range(4))
def test_the_sign_of_an_absolute_speed_is_restored(seed):
    rng = np.random.default_rng(seed)
    push = np.repeat(rng.uniform(-2, 2, 25), 20)
    speed = simulate_speed(push, mass=0.1)
    seen = np.abs(speed) + 0.005 * speed.std() * rng.standard_normal(len(speed))

    (found,), (said,) = convert_to_driven_motions(
        (make_recording([("u", "voltage", "V", push)], [("w", "speed", "m/s", seen)]),)
    )

    assert np.linalg.norm(found.response.samples[:, 0] - speed) < 0.1 * np.linalg.norm(speed)
    assert "sensor measures the absolute value only" in said


def test_a_speed_in_one_direction_is_not_taken_for_an_absolute_speed():
    push = 3.0 + np.abs(smooth_noise(1000, 3))
    recording = make_recording([("u", "voltage", "V", push)], [("w", "speed", "m/s", simulate_speed(push))])

    assert convert_to_driven_motions((recording,)) == ((recording,), ())


def test_a_device_whose_memory_is_longer_than_a_stretch_answers_its_command():
    rng = np.random.default_rng(5)
    push = np.repeat(rng.uniform(-2, 2, 25), 20)
    moved = make_recording([("u", "voltage", "V", push)], [("w", "speed", "m/s", simulate_speed(push, mass=0.3))])
    other = replace(moved, response=replace(moved.response, samples=rng.standard_normal((len(push), 1))))

    sure, unsure = compute_response_significance([moved]), compute_response_significance([other])

    assert sure is None or sure >= DRIVEN_DEVIATIONS
    assert unsure is not None
    assert unsure < DRIVEN_DEVIATIONS


@pytest.mark.parametrize(
    ("mixing", "is_exchanged"),
    [([[1, 0], [0, 1]], False), ([[0, 1], [1, 0]], True), ([[1, 1], [1, -1]], False)],
    ids=["in order", "exchanged", "both move with both"],
)
def test_a_refusal_names_responses_that_were_exchanged(monkeypatch, mixing, is_exchanged):
    def refuse(*_):
        raise MechanicalFitError("the matrix is singular")

    pushes = [smooth_noise(3000, seed) for seed in (1, 2)]
    speeds = mixing @ np.array([simulate_speed(push, mass) for push, mass in zip(pushes, (0.05, 0.1), strict=True)])
    recording = make_recording(
        [(name, "force", "N", push) for name, push in zip(("fx", "fy"), pushes, strict=True)],
        [(name, "velocity", "m/s", speed) for name, speed in zip(("vx", "vy"), speeds, strict=True)],
    )
    monkeypatch.setattr(fit_without_model, "fit_mechanical_model", refuse)
    monkeypatch.setattr(fit_without_model, "_try_rigid_model", lambda *_: None)
    with pytest.raises(NothingToDiagnoseError) as refusal:
        fit_without_model.fit_first_linear_model([recording], lambda share: None)
    said = "vy moves with fx and vx moves with fy: state the responses in the order of the commands that move them"
    assert refusal.value.problems[1:] == ((said,) if is_exchanged else ())
