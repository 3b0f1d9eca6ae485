"""Whoever looks after everything while somebody waits: signs of life, requests, buttons, the live state."""

import contextlib

import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.safe import SafeDevice
from study.session.views.views import Answered, Unanswered
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.workflows.trial.attendant import Attendant
from study.workflows.trial.requests_port import ManyRequests, QueuedRequests

CUT = Unanswered("the stimulus ended early", leave=False)


@pytest.fixture
def pressed():
    return set()


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def device(rigs, clock, pressed):
    with contextlib.closing(SafeDevice(rigs.compiled_rig(pressed=pressed), rigs.SETTINGS, clock)) as opened:
        yield opened


@pytest.fixture
def requests():
    return QueuedRequests()


@pytest.fixture
def attendant(device, clock, requests):
    return Attendant(device, clock, requests, tell=lambda live: None, buttons=(3, 5))


def test_a_button_answers_with_its_number_and_its_time(attendant, pressed, clock):
    attendant.begin("trial")
    assert attendant.glance()
    clock.sleep(0.7)
    pressed.add(5)
    assert not attendant.glance()
    assert attendant.resolve(CUT) == Answered(2, clock.now_s())


def test_a_button_still_down_from_the_last_trial_answers_nothing(attendant, pressed):
    pressed.add(3)
    attendant.begin("trial")
    assert attendant.glance() and attendant.glance()
    pressed.clear()
    assert attendant.glance()
    pressed.add(3)
    assert not attendant.glance()
    assert attendant.resolve(CUT).answer == 1


def test_both_buttons_at_once_and_other_buttons_answer_nothing(attendant, pressed):
    attendant.begin("trial")
    attendant.glance()
    pressed.update({3, 5})
    assert attendant.glance()
    pressed.clear()
    pressed.add(7)
    assert attendant.glance()


def test_buttons_mean_nothing_outside_a_trial(attendant, pressed):
    attendant.begin("rest")
    attendant.glance()
    pressed.add(3)
    assert attendant.glance()


def test_a_stop_takes_the_force_away_and_wins_over_an_answer(attendant, device, requests, rigs):
    device.hold(rigs.sine(1.0))
    attendant.begin("trial")
    requests.send(StopAsked("experimenter"))
    assert not attendant.glance()
    assert device.fault() is Fault.STOPPED
    reply = attendant.resolve(Answered(1, 0.0))
    assert reply == Unanswered("the experimenter stopped the session", leave=True)
    device.release()


def test_an_answer_that_comes_with_a_pause_counts_and_the_pause_is_kept(attendant, requests):
    attendant.begin("trial")
    requests.send(PauseAsked("experimenter"))
    assert not attendant.glance()
    assert attendant.resolve(Answered(2, 1.0)) == Answered(2, 1.0)
    assert attendant.resolve(CUT).pause
    assert attendant.pause_asked == "experimenter"


def test_notes_wait_until_somebody_takes_them(attendant, requests):
    requests.send(NoteAsked("experimenter", "a door slammed"))
    attendant.begin("trial")
    assert attendant.glance()
    assert [note.text for note in attendant.take_notes()] == ["a door slammed"]
    assert attendant.take_notes() == ()


def test_a_fault_ends_a_trial_and_not_the_rest_after_it(attendant, device, rigs, clock):
    device.hold(rigs.sine(1.0))
    attendant.begin("trial")
    clock.sleep(5.0)  # no sign of life: the watchdog
    assert not attendant.glance()
    device.release()
    attendant.begin("rest")
    assert attendant.glance()


def test_several_sources_are_heard_in_turn(requests):
    other = QueuedRequests()
    other.send(PauseAsked("participant"))
    requests.send(StopAsked("experimenter"))
    assert ManyRequests(requests, other).take() == (StopAsked("experimenter"), PauseAsked("participant"))


@pytest.mark.real_time
@pytest.mark.may_be_late
def test_the_live_state_is_told_in_real_time_a_few_times_a_second(rigs):
    told, clock = [], RealClock()
    with contextlib.closing(SafeDevice(rigs.compiled_rig(), rigs.SETTINGS, clock)) as device:
        attendant = Attendant(device, clock, QueuedRequests(), told.append, place_m=(0.003, 0.004, 0.0))
        attendant.begin("trial")
        until_s = clock.now_s() + 0.7
        while clock.now_s() < until_s:
            attendant.glance()
            clock.sleep(0.02)
    assert 2 <= len(told) <= 4
    assert told[0].activity == "trial"
    assert told[0].fault == ""
    assert told[0].offset_mm == pytest.approx(5.0, abs=0.01)


def test_nobody_watches_in_virtual_time(device, clock, requests):
    told = []
    attendant = Attendant(device, clock, requests, told.append)
    attendant.begin("trial")
    for _ in range(50):
        clock.sleep(0.1)
        attendant.glance()
    assert told == []
