"""The fact is on the disk before it is acted on: the order of disk and device, as they were really called."""

import os
import signal
from dataclasses import dataclass, field, replace

import pytest

from study.devices.device import Fault, Health, PlaybackResult
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.views.participant_views import Unanswered
from study.store.formats.recording_file import read_recording
from study.store.sessions.event_log import EventLog, read_log
from study.store.sessions.log_seal import check_seals
from study.workflows.results.fold_session import fold_session
from study.workflows.session import conduct_session
from study.workflows.session.conduct_session import conduct_new


@dataclass
class FollowedSession:
    """Notes what is asked of the device and of the disk, in order."""

    calls: list[str] = field(default_factory=list)
    fault: Fault = Fault.NONE
    missed: int = 0
    force_left: bool = False

    def wrap(self, device):
        watched = self

        class Device:
            def __getattr__(self, name):
                return getattr(device, name)

            def hold(self, stimulus):
                watched.calls.append("hold")
                device.hold(stimulus)

            def release(self) -> PlaybackResult:
                watched.calls.append("release")
                played = device.release()
                health: Health = replace(
                    played.health, fault=watched.fault, missed_ticks=watched.missed, late_ticks=7, latest_s=0.0042
                )
                return replace(played, health=health)

            def fault(self):
                return Fault.FORCE_LEFT if watched.force_left else device.fault()

            def stop(self):
                watched.calls.append("stop")
                device.stop()

        return Device()


@pytest.fixture
def sitter(brief):
    return brief


@pytest.fixture
def watched(monkeypatch, synchronising_disk) -> FollowedSession:
    notes = FollowedSession()
    real_open, real_append, real_fsync = conduct_session.open_device, EventLog.append, os.fsync

    def append(log, event) -> None:
        notes.calls.append(f"append {event.event}")
        real_append(log, event)
        notes.calls.append(f"appended {event.event}")

    def fsync(descriptor: int) -> None:
        notes.calls.append("fsync")
        real_fsync(descriptor)

    monkeypatch.setattr(conduct_session, "open_device", lambda *a: notes.wrap(real_open(*a)))
    monkeypatch.setattr(EventLog, "append", append)
    monkeypatch.setattr(os, "fsync", fsync)
    return notes


def test_every_fact_is_synced_before_its_append_returns(sitter, watched):
    sitter.interrupted(after=3)
    for i, call in enumerate(watched.calls):
        if call.startswith("append "):
            assert watched.calls[i + 1] == "fsync", watched.calls[i : i + 4]


def test_presented_is_on_disk_before_the_device_moves_and_answered_before_it_lets_go(sitter, watched):
    sitter.interrupted(after=3)
    acts = [c for c in watched.calls if c in ("hold", "release") or c.startswith("appended trial_p")
            or c == "appended answer_given" or c == "appended trial_measured"]  # fmt: skip
    one = ["appended trial_presented", "hold", "appended answer_given", "release", "appended trial_measured"]
    assert acts[:15] == one * 3


def test_the_device_stops_before_anything_else_when_the_disk_is_full(sitter, watched, monkeypatch):
    real = EventLog.append

    def full(log, event) -> None:
        if event.event == "answer_given":
            raise StudyError("The session cannot be written to disk", "No space left on device.", "Make room.")
        real(log, event)

    monkeypatch.setattr(EventLog, "append", full)
    with pytest.raises(StudyError) as error:
        sitter.whole()
    assert "stop" in watched.calls
    assert error.value.saved == "0 answers are on disk."
    assert "hapteq resume" in error.value.do_now


def test_an_empty_chair_is_not_shaken_for_ever(sitter, watched):
    """Every trial is void by the device: after three in a row the sitting ends, and can be resumed."""
    watched.fault = Fault.HELD_TOO_LONG
    silent = sitter.participant(0, lambda: Unanswered("the stimulus ended early", ends_sitting=False))
    silent.display._left = 0
    silent.display._instead = lambda: Unanswered("the stimulus ended early", ends_sitting=False)
    silent.display.ask = lambda *_: Unanswered("the stimulus ended early", ends_sitting=False)
    done = conduct_new(sitter.plan(), "simulated", silent)
    assert done.end_reason.startswith("3 trials in a row were void, the last because the stimulus was held longer")
    assert watched.calls.count("hold") == 3
    watched.fault = Fault.NONE
    assert sitter.resumed(done.folder).state.closed


def test_a_trial_with_too_many_missed_ticks_is_void(sitter, watched):
    watched.missed = 10_000
    done = sitter.whole()
    assert "ticks were missed" in done.end_reason
    assert {(row.missed_ticks, row.late_ticks, row.latest_s) for row in done.state.trials} == {(10_000, 7, 0.0042)}


def test_how_late_the_loop_was_stands_beside_each_trial_and_in_its_recording(sitter, watched):
    done = sitter.whole()
    assert {(row.late_ticks, row.latest_s) for row in done.state.trials} == {(7, 0.0042)}
    names = [event.recording for event in read_log(done.folder.log).events if event.event == "trial_measured"]
    meta = read_recording(done.folder.path / next(filter(None, names))).meta
    assert (meta["late_ticks"], meta["latest_s"]) == (7, 0.0042)


def test_a_stall_after_the_answer_is_flagged_and_the_answer_counts(sitter, watched):
    """A slow disk holds the program up between answer and release."""
    watched.fault = Fault.STALLED
    done = sitter.whole()
    assert done.state.closed
    flags = [f for e in read_log(done.folder.log).events if e.event == "trial_measured" for f in e.flags]
    assert any(flag.startswith("after the answer: the program gave no sign of life") for flag in flags)


@pytest.mark.parametrize("fault", [Fault.LOST, Fault.FORCE_LEFT])
def test_a_device_lost_while_letting_go_ends_the_sitting_and_the_answer_counts(sitter, watched, fault):
    watched.fault = fault
    done = sitter.whole()
    assert (done.end_reason, done.fault) == (fault.value, fault)
    assert done.state.answers == 1
    assert watched.calls.count("hold") == 1


def test_ctrl_c_right_after_the_last_line_leaves_a_finished_session(sitter, watched, monkeypatch):
    real = EventLog.append

    def press(log, event) -> None:
        real(log, event)
        if event.event == "session_closed":
            raise KeyboardInterrupt

    monkeypatch.setattr(EventLog, "append", press)
    done = sitter.whole()
    assert done.state.closed
    assert fold_session(done.folder).state.closed


@pytest.mark.parametrize("kind", ["trial_presented", "answer_given", "trial_measured", "rest_taken"])
def test_ctrl_c_at_any_line_leaves_a_session_that_can_be_resumed(sitter, monkeypatch, kind):
    real = EventLog.append
    seen = []

    def press(log, event) -> None:
        real(log, event)
        if event.event == kind and not seen:
            seen.append(event)
            raise KeyboardInterrupt

    monkeypatch.setattr(EventLog, "append", press)
    with pytest.raises(UserInterruptError) as left:
        sitter.whole()
    from study.store.sessions.archive import find_session

    folder = find_session("P01_001", sitter.data)
    assert str(fold_session(folder).state.answers) == left.value.saved.split()[0]
    assert sitter.resumed(folder).state.closed


def test_a_force_that_stayed_on_is_reported_before_anything_is_written(sitter, watched, monkeypatch):
    told: list[str] = []
    monkeypatch.setattr(
        "study.workflows.session.simulated_display.SimulatedDisplay.trouble",
        lambda _, sentence: (told.append(sentence), watched.calls.append("told")),
    )
    watched.fault = Fault.FORCE_LEFT
    sitter.whole()
    assert told == [Fault.FORCE_LEFT.value]
    released = watched.calls.index("release")
    assert watched.calls[released + 1] == "told"


@pytest.mark.parametrize("is_damaged", [True, False])
@pytest.mark.parametrize("trouble", [KeyboardInterrupt(), StudyError("The disk is full", "", "Free space.")])
def test_a_force_that_may_remain_is_named_first_however_the_sitting_ends(sitter, watched, trouble, is_damaged):
    log = sitter.data / "P01_001" / "events.jsonl"

    def end():
        watched.force_left = True
        if is_damaged:
            log.write_bytes(log.read_bytes().replace(b"answer_given", b"answer_taken"))
        raise trouble

    with pytest.raises(DeviceError, match="^The force may still be on") as error:
        sitter.interrupted(2, end)
    assert error.value.happened.startswith(Fault.FORCE_LEFT.sentence)
    assert ("hapteq resume" in error.value.do_now) is not is_damaged


def test_a_stop_after_which_the_force_may_remain_says_so(sitter, watched, monkeypatch):
    def leave():
        watched.force_left = True
        return Unanswered("the experimenter stopped the session", ends_sitting=True)

    participant = sitter.participant(2, leave)
    monkeypatch.setattr(participant.display, "trouble", watched.calls.append)
    done = conduct_new(sitter.plan(), "simulated", participant)
    assert (done.end_reason.endswith(Fault.FORCE_LEFT.value), done.fault) == (True, Fault.FORCE_LEFT)
    assert watched.calls.index(Fault.FORCE_LEFT.value) < watched.calls.index("append session_interrupted")


def test_a_session_closed_while_the_force_may_remain_is_sealed_to_its_last_line(sitter, watched, monkeypatch):
    real = EventLog.append

    def press(log, event) -> None:
        real(log, event)
        if event.event == "session_closed":
            watched.force_left = True
            raise KeyboardInterrupt

    monkeypatch.setattr(EventLog, "append", press)
    with pytest.raises(DeviceError, match="The force may still be on"):
        sitter.whole()
    contents = read_log(sitter.data / "P01_001" / "events.jsonl")
    assert contents.events[-1].event == "session_closed"
    assert check_seals(sitter.data / "P01_001", contents) == len(contents.events)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_interruption_does_not_cut_off_the_first(sitter, monkeypatch, number):
    def interrupt(*_):
        raise KeyboardInterrupt

    def append(log, event, real=EventLog.append) -> None:
        if event.event == "session_interrupted":
            os.kill(os.getpid(), number)
        real(log, event)

    handler = signal.signal(number, interrupt)
    monkeypatch.setattr(EventLog, "append", append)
    try:
        with pytest.raises(UserInterruptError, match="The force was released"):
            sitter.interrupted(2, interrupt)
        assert signal.getsignal(number) is interrupt
    finally:
        signal.signal(number, handler)
    assert read_log(sitter.data / "P01_001" / "events.jsonl").events[-1].event == "session_interrupted"
