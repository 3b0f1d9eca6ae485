"""The supervisor while a participant waits: signs of life, requests, buttons, the live state."""

import contextlib

import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.safe import SafeDevice
from study.session.views.participant_views import Answered, Unanswered
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.workflows.trial.requests_port import CombinedRequests, QueuedRequests
from study.workflows.trial.session_supervisor import SessionSupervisor

CUT = Unanswered("the stimulus ended early", ends_sitting=False)


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
def supervisor(device, clock, requests):
    return SessionSupervisor(device, clock, requests, publish=lambda live: None, buttons=(3, 5))


def test_a_button_answers_with_its_number_and_its_time(supervisor, pressed, clock):
    supervisor.start_activity("trial")
    assert supervisor.keep_alive()
    clock.sleep(0.7)
    pressed.add(5)
    assert not supervisor.keep_alive()
    assert supervisor.resolve(CUT) == Answered(2, clock.now_s())


def test_a_button_still_down_from_the_last_trial_answers_nothing(supervisor, pressed):
    pressed.add(3)
    supervisor.start_activity("trial")
    assert supervisor.keep_alive() and supervisor.keep_alive()
    pressed.clear()
    assert supervisor.keep_alive()
    pressed.add(3)
    assert not supervisor.keep_alive()
    assert supervisor.resolve(CUT).answer == 1


def test_both_buttons_at_once_and_other_buttons_answer_nothing(supervisor, pressed):
    supervisor.start_activity("trial")
    supervisor.keep_alive()
    pressed.update({3, 5})
    assert supervisor.keep_alive()
    pressed.clear()
    pressed.add(7)
    assert supervisor.keep_alive()


def test_buttons_mean_nothing_outside_a_trial(supervisor, pressed):
    supervisor.start_activity("rest")
    supervisor.keep_alive()
    pressed.add(3)
    assert supervisor.keep_alive()


def test_a_stop_takes_the_force_away_and_wins_over_an_answer(supervisor, device, requests, rigs):
    device.hold(rigs.sine(1.0))
    supervisor.start_activity("trial")
    requests.send(StopAsked("experimenter"))
    assert not supervisor.keep_alive()
    assert device.fault() is Fault.STOPPED
    reply = supervisor.resolve(Answered(1, 0.0))
    assert reply == Unanswered("the experimenter stopped the session", ends_sitting=True)
    device.release()


def test_an_answer_that_comes_with_a_pause_counts_and_the_pause_is_kept(supervisor, requests):
    supervisor.start_activity("trial")
    requests.send(PauseAsked("experimenter"))
    assert not supervisor.keep_alive()
    assert supervisor.resolve(Answered(2, 1.0)) == Answered(2, 1.0)
    assert supervisor.resolve(CUT).pause
    assert supervisor.pause_requester == "experimenter"


def test_notes_wait_until_they_are_taken(supervisor, requests):
    requests.send(NoteAsked("experimenter", "a door slammed"))
    supervisor.start_activity("trial")
    assert supervisor.keep_alive()
    assert supervisor.next_note == NoteAsked("experimenter", "a door slammed")
    supervisor.drop_note()
    assert supervisor.next_note is None


def test_a_fault_ends_a_trial_and_not_the_rest_after_it(supervisor, device, rigs, clock):
    device.hold(rigs.sine(1.0))
    supervisor.start_activity("trial")
    clock.sleep(5.0)  # no sign of life: the watchdog
    assert not supervisor.keep_alive()
    device.release()
    supervisor.start_activity("rest")
    assert supervisor.keep_alive()


def test_several_sources_are_heard_in_turn(requests):
    other = QueuedRequests()
    other.send(PauseAsked("participant"))
    requests.send(StopAsked("experimenter"))
    assert CombinedRequests(requests, other).take() == (StopAsked("experimenter"), PauseAsked("participant"))


@pytest.mark.real_time
@pytest.mark.may_be_late
def test_the_live_state_is_reported_in_real_time_a_few_times_a_second(rigs):
    told, clock = [], RealClock()
    with contextlib.closing(SafeDevice(rigs.compiled_rig(), rigs.SETTINGS, clock)) as device:
        supervisor = SessionSupervisor(device, clock, QueuedRequests(), told.append, place_m=(0.003, 0.004, 0.0))
        supervisor.start_activity("trial")
        until_s = clock.now_s() + 0.7
        while clock.now_s() < until_s:
            supervisor.keep_alive()
            clock.sleep(0.02)
    assert 2 <= len(told) <= 4
    assert told[0].activity == "trial"
    assert told[0].fault == ""
    assert told[0].offset_mm == pytest.approx(5.0, abs=0.01)


def test_in_virtual_time_no_live_state_is_reported(device, clock, requests):
    told = []
    supervisor = SessionSupervisor(device, clock, requests, told.append)
    supervisor.start_activity("trial")
    for _ in range(50):
        clock.sleep(0.1)
        supervisor.keep_alive()
    assert told == []
