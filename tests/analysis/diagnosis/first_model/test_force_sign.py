"""The sign of a force against its motion, and quantities guessed from the samples."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.first_model.one_motion_per_force import convert_to_driven_motions
from equalizer.signals.recording import Hold
from tests.analysis.diagnosis.first_model.short_recordings import RATE_HZ, make_recording, simulate_speed, smooth_noise


def simulate_position(push, mass=0.05, damping=0.3, stiffness=20.0):
    """(n,): of a body on a spring, in fine steps."""
    place = speed = 0.0
    found = []
    for force in push:
        found.append(place)
        for _ in range(10):
            speed += (force - damping * speed - stiffness * place) / mass / RATE_HZ / 10
            place += speed / RATE_HZ / 10
    return np.array(found)


@pytest.mark.parametrize(
    ("course", "quantity"),
    [(simulate_speed, "velocity"), (simulate_position, "position")],
    ids=["motor", "body on a spring"],
)
@pytest.mark.parametrize("unit", ["1", "V"])
def test_a_response_of_which_nothing_says_what_it_is_is_taken_for_what_its_course_suggests(course, quantity, unit):
    push = smooth_noise(4000, 3, width=9)
    own = "voltage" if unit == "V" else "1"
    recording = make_recording([("u", own, unit, push)], [("y", own, unit, course(push))])

    (found,), said = convert_to_driven_motions((recording,))

    if (quantity, unit) == ("position", "V"):  # a voltage counts as a position already
        assert (found, said) == (recording, ())
    else:
        assert found.response.quantities == (quantity,)
        assert "The recording does not state what y measures" in said[0]


def test_what_an_imposed_motion_meets_is_a_force_where_nothing_says_so():
    place = smooth_noise(2000, 5)
    recording = make_recording([("x", "position", "m", place)], [("y", "1", "1", 3 * place)])

    (found,), _ = convert_to_driven_motions((recording,))

    assert found.response.quantities == ("force",)


def reverse_command(recording):
    return replace(recording, command=replace(recording.command, samples=-recording.command.samples))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_a_command_that_is_counted_against_its_motion_is_turned_round(seed, friction):
    push = smooth_noise(2000, seed)
    speed = simulate_speed(np.sign(push) * np.maximum(np.abs(push) - friction, 0.0))
    recording = make_recording([("u", "force", "N", push)], [("v", "velocity", "m/s", speed)])

    assert convert_to_driven_motions((recording,)) == ((recording,), ())
    (found,), (said,) = convert_to_driven_motions((reverse_command(recording),))
    np.testing.assert_array_equal(found.command.samples, recording.command.samples)
    assert said.startswith("u is opposite in sign to the motion")


@pytest.mark.parametrize("hold", [Hold.BAND_LIMITED, Hold.LINEAR])
def test_what_was_decided_beforehand_is_turned_with_the_command(hold):
    """It tells of a controller where the command alone cannot."""
    push, decided = smooth_noise(2000, 1), smooth_noise(2000, 2)
    recording = make_recording([("u", "force", "N", push)], [("v", "velocity", "m/s", simulate_speed(push))])
    beside = replace(recording.command, samples=decided[:, None])
    recording = replace(reverse_command(recording), hold=hold, excitation=replace(beside, samples=-beside.samples))

    (found,), _ = convert_to_driven_motions((recording,))

    np.testing.assert_array_equal(found.excitation.samples, beside.samples)
    assert is_in_closed_loop(found)
    assert not is_in_closed_loop(replace(found, excitation=found.command))


def test_what_was_decided_beforehand_is_summed_with_the_commands():
    first, second = smooth_noise(2000, 1), smooth_noise(2000, 2)
    recording = make_recording(
        [("u1", "force", "N", first), ("u2", "force", "N", second)],
        [("v", "velocity", "m/s", simulate_speed(first + 0.5 * second))],
    )

    (found,), _ = convert_to_driven_motions((replace(recording, excitation=recording.command),))

    np.testing.assert_allclose(found.excitation.samples, found.command.samples)


@pytest.mark.parametrize("seed", range(4))
def test_a_loop_without_time_tells_which_way_a_force_is_counted(seed):
    """A spring with play, pulled to and fro: rising and falling branches."""
    way = np.concatenate([np.linspace(0, 1, 300), np.linspace(1, -1, 600), np.linspace(-1, 0, 300)])
    pulled = 20 * way + 3 * np.sign(np.gradient(way)) + 0.1 * np.random.default_rng(seed).standard_normal(1200)
    recording = make_recording([("u", "force", "N", pulled)], [("x", "position", "m", way)])
    recording = replace(recording, meta={"time": "unknown"})

    assert convert_to_driven_motions((recording,))[1] == ()
    (found,), _ = convert_to_driven_motions((reverse_command(recording),))
    np.testing.assert_array_equal(found.command.samples, recording.command.samples)


@pytest.mark.parametrize("seed", range(4))
def test_a_command_that_moves_nothing_and_a_spring_alone_are_left_as_they_are(seed):
    push = smooth_noise(2000, seed)
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(2000)  # without it, the force follows from the reading
    for moved in (smooth_noise(2000, seed + 100), noise - push):
        recording = make_recording([("u", "force", "N", push)], [("x", "position", "m", moved)])
        assert convert_to_driven_motions((recording,)) == ((recording,), ())


@pytest.mark.parametrize(("share", "is_reversed"), [(0.3, False), (0.8, True)])
def test_a_motion_that_explains_little_of_a_force_does_not_determine_its_sign(share, is_reversed):
    """As at a rigid wall, where the force comes and goes and hardly anything moves. share: of the force's power."""
    push, other = smooth_noise(4000, 1), smooth_noise(4000, 2)
    force = np.sqrt(1 - share) * other / other.std() - np.sqrt(share) * push / push.std()
    recording = make_recording([("v", "velocity", "m/s", simulate_speed(push))], [("f", "force", "N", force)])

    (found,), said = convert_to_driven_motions((recording,))

    np.testing.assert_array_equal(found.response.samples[:, 0], -force if is_reversed else force)
    assert (said != ()) == is_reversed


def test_of_an_imposed_motion_the_measured_force_is_turned_round():
    push = smooth_noise(2000, 1)
    recording = make_recording([("v", "velocity", "m/s", simulate_speed(push))], [("f", "force", "N", -push)])

    (found,), _ = convert_to_driven_motions((recording,))
    np.testing.assert_array_equal(found.response.samples[:, 0], push)


def move_by_hand(spring, damper, decided, stiffness=0.0):
    """(n,) command and position: of a body that a hand moves, with a virtual spring and damper and a decided force."""
    hand, place, speed, before, mass = smooth_noise(4000, 2, width=100), 0.0, 0.0, 0.0, 0.05
    commands, places = [], []
    for push, force in zip(hand, decided, strict=True):
        command = force - spring * place - damper * (place - before) * RATE_HZ
        commands.append(command)
        places.append(place)
        before = place
        for _ in range(10):
            speed += (command + push - 0.5 * speed - stiffness * place) / mass / RATE_HZ / 10
            place += speed / RATE_HZ / 10
    return np.array(commands), np.array(places)


@pytest.mark.parametrize(("spring", "damper"), [(20.0, 0.0), (20.0, 0.5), (0.0, 1.0)])
def test_a_virtual_spring_under_a_hand_is_not_taken_for_the_device(spring, damper):
    command, place = move_by_hand(spring, damper, np.zeros(4000))
    recording = make_recording([("u", "force", "N", command)], [("x", "position", "m", place)])

    with pytest.raises(NothingToDiagnoseError, match="u only resists the measured position and speed"):
        convert_to_driven_motions((recording,))


@pytest.mark.parametrize("stiffness", [0.0, -15.0], ids=["free body", "upside-down pendulum"])
def test_a_device_under_feedback_with_an_excitation_of_its_own_is_kept(stiffness):
    command, place = move_by_hand(20.0, 0.5, 3 * smooth_noise(4000, 3), stiffness)
    recording = make_recording([("u", "force", "N", command)], [("x", "position", "m", place)])

    assert convert_to_driven_motions((recording,)) == ((recording,), ())


@pytest.mark.parametrize(("hand_share", "is_kept"), [(0.0, True), (1.0, False)], ids=["excited", "moved by hand"])
def test_a_slow_device_that_pushes_itself_away_is_kept_where_its_excitation_was_recorded(hand_share, is_kept):
    """Without a visible mass, such a device and a virtual spring under a hand have one law; the excitation differs."""
    pushes, mass, place, speed = 3 * smooth_noise(8000, 2, width=300), 0.05, 0.0, 0.0
    commands, places = [], []
    for push in pushes:
        command = (1 - hand_share) * push - 20 * place - 0.5 * speed
        commands.append(command)
        places.append(place)
        for _ in range(10):
            speed += (command + hand_share * push - 0.05 * speed + 15 * place) / mass / RATE_HZ / 10
            place += speed / RATE_HZ / 10
    recording = make_recording([("u", "force", "N", np.array(commands))], [("x", "position", "m", np.array(places))])
    excitation = replace(recording.command, samples=(1 - hand_share) * pushes[:, None])
    recording = replace(recording, excitation=excitation)
    assert is_in_closed_loop(recording)

    if is_kept:
        assert convert_to_driven_motions((recording,)) == ((recording,), ())
    else:
        with pytest.raises(NothingToDiagnoseError, match="only resists the measured position and speed"):
            convert_to_driven_motions((recording,))
