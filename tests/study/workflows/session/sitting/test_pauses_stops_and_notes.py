"""Pauses, stops and notes during a sitting, from the other terminal and from the participant."""

from dataclasses import replace

import pytest

from study.errors import StudyError, UserInterruptError
from study.session.facts.events import (
    AnswerGiven,
    FormFilled,
    NoteTaken,
    PauseTaken,
    RestTaken,
    TrialSpoiled,
)
from study.session.views.form_views import FormKind
from study.session.views.participant_views import AfterPause, Unanswered
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog, read_log
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.session.conduct_session import Participant, conduct_new, conduct_resumed
from tests.slow_instances import slow
from tests.study.workflows.session.sitting.person import Person, of


@pytest.mark.slow
def test_a_pause_from_the_other_terminal_frees_the_hand_and_the_trial_comes_again(plan, full, seat, person, tmp_path):
    inbox = lambda: RequestInbox(tmp_path / "data" / "P01_001")  # noqa: E731
    person.at_question = lambda q: inbox().send(PauseAsked("experimenter")) if len(person.questions) == 3 else None
    end = conduct_new(plan(full), "simulated", seat)
    assert "the experimenter asked for a pause" in person.calls
    assert [event.who for event in of(end, PauseTaken)] == ["experimenter"]
    spoiled = of(end, TrialSpoiled)
    assert [event.reason for event in spoiled] == ["the experimenter asked for a pause"]
    assert not end.end_reason


def test_a_stop_from_the_other_terminal_ends_the_sitting_and_can_be_resumed(plan, full, seat, person, tmp_path, clock):
    inbox = lambda: RequestInbox(tmp_path / "data" / "P01_001")  # noqa: E731
    person.at_question = lambda q: inbox().send(StopAsked("experimenter")) if len(person.questions) == 3 else None
    end = conduct_new(plan(full), "simulated", seat)
    assert end.end_reason == "the experimenter stopped the session"
    assert len(of(end, AnswerGiven)) == 2
    again = Person(clock)
    resumed = conduct_resumed(end.folder, "simulated", Participant(display=again, hand=again, clock=clock))
    assert not resumed.end_reason
    assert again.calls[:2] == [FormKind.SETUP, "device"]


def test_a_stop_during_a_rest_cuts_it_short(plan, small_protocol, seat, person, tmp_path):
    long_rest = replace(small_protocol, rests=replace(small_protocol.rests, after_run_s=600.0))
    resting = person.rest

    def rest(notice, sign_of_life):
        RequestInbox(tmp_path / "data" / "P01_001").send(StopAsked("experimenter"))
        return resting(notice, sign_of_life)

    person.rest = rest
    end = conduct_new(plan(long_rest), "simulated", seat)
    assert end.end_reason == "the experimenter stopped the session"
    assert of(end, RestTaken) == []


def test_a_stop_during_a_pause_ends_it(plan, small_protocol, seat, person):
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    person.at_pause = lambda: seat.requests.send(StopAsked("experimenter"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert end.end_reason == "the experimenter stopped the session"
    assert len(of(end, PauseTaken)) == 1


def test_a_note_is_on_the_disk_before_the_pause_is_over(plan, small_protocol, seat, person, tmp_path):
    seen = []

    def pause(notice, sign_of_life):
        seat.requests.send(NoteAsked("participant", "my thumb is numb", adverse=True))
        sign_of_life()
        seen.append((tmp_path / "data" / "P01_001" / "events.jsonl").read_text())
        return AfterPause.CONTINUE_SITTING

    person.pause = pause
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant")) if len(person.questions) == 2 else None
    conduct_new(plan(small_protocol), "simulated", seat)
    assert "my thumb is numb" in seen[0]


@pytest.mark.slow
def test_notes_of_participant_and_experimenter_reach_the_log(plan, small_protocol, seat, person):
    def noted(question):
        if len(person.questions) == 2:
            seat.requests.send(NoteAsked("participant", "my thumb is numb", adverse=True))

    person.at_question = noted
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert [(note.who, note.text, note.adverse) for note in of(end, NoteTaken)] == [
        ("participant", "my thumb is numb", True)
    ]


def test_a_withdrawal_in_a_pause_ends_the_sitting(plan, small_protocol, seat, person):
    person.decisions = [AfterPause.WITHDRAW]
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert end.withdrawn
    assert end.end_reason == "the participant withdrew"


def test_a_stop_does_not_override_a_withdrawal_in_a_pause(plan, small_protocol, seat, person):
    def withdraw(notice, sign_of_life):
        seat.requests.send(StopAsked("experimenter"))
        return AfterPause.WITHDRAW

    person.pause = withdraw
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert (end.end_reason, end.withdrawn) == ("the participant withdrew", True)


def test_a_log_that_cannot_be_written_does_not_hide_a_withdrawal(plan, small_protocol, seat, person, monkeypatch):
    def fail(log, event):
        raise StudyError("The session cannot be written to disk", "The disk is full.", "Make room.")

    def withdraw(notice, sign_of_life):
        monkeypatch.setattr(EventLog, "append", fail)
        return AfterPause.WITHDRAW

    person.pause = withdraw
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert (end.end_reason, end.withdrawn) == ("the participant withdrew", True)


@pytest.mark.slow
def test_a_pause_asked_for_during_a_pause_makes_no_second_one(plan, small_protocol, seat, person):
    person.at_pause = lambda: seat.requests.send(PauseAsked("participant"))
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant")) if len(person.questions) == 3 else None
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert len(of(end, PauseTaken)) == 1


@pytest.mark.slow
def test_what_is_noted_during_the_goodbye_is_in_the_log(plan, small_protocol, seat, person):
    person.goodbye = lambda notice: seat.requests.send(NoteAsked("experimenter", "a rash", adverse=True))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert not end.end_reason
    assert [note.text for note in of(end, NoteTaken)] == ["a rash"]


@pytest.mark.slow
def test_ctrl_c_at_the_goodbye_of_a_finished_session_leaves_it_finished(plan, small_protocol, seat, person):
    def goodbye(notice):
        raise KeyboardInterrupt

    person.goodbye = goodbye
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert not end.end_reason
    assert end.state.closed


def test_leaving_from_a_pause_can_be_resumed(plan, small_protocol, seat, person):
    person.decisions = [AfterPause.END_SITTING]
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert (end.end_reason, end.withdrawn) == ("the participant left", False)


def test_a_person_who_comes_back_is_told_of_the_runs_that_are_left_alone(plan, small_protocol, seat, person, clock):
    def leave(notice, sign_of_life):
        raise KeyboardInterrupt

    person.rest = leave  # after the training
    with pytest.raises(UserInterruptError):
        conduct_new(plan(small_protocol), "simulated", seat)
    again = Person(clock)
    folder = SessionFolder(plan(small_protocol).data_folder / "P01_001")
    conduct_resumed(folder, "simulated", Participant(display=again, hand=again, clock=clock))
    (first,), (second,) = person.welcomes, again.welcomes
    assert (first.training_runs, second.training_runs) == (1, 0)
    assert first.runs == second.runs == len(small_protocol.stimulus.frequencies_hz)


def test_a_note_is_not_lost_where_the_program_ends_before_it_was_logged(plan, small_protocol, seat, person, tmp_path):
    folder = SessionFolder(tmp_path / "data" / "P01_001")

    def rest(notice, sign_of_life):
        RequestInbox(folder.path).send(NoteAsked("experimenter", "pale", adverse=True))
        sign_of_life()
        raise KeyboardInterrupt

    person.rest = rest
    with pytest.raises(UserInterruptError):
        conduct_new(plan(small_protocol), "simulated", seat)
    again = Person(seat.clock)
    resumed = conduct_resumed(folder, "simulated", Participant(display=again, hand=again, clock=seat.clock))
    assert [note.text for note in of(resumed, NoteTaken)] == ["pale"]
    assert list((folder.path / "requests").iterdir()) == []


@pytest.mark.parametrize("error", [KeyboardInterrupt(), StudyError("The disk is full", "", "Free space.")])
def test_a_note_is_in_the_log_however_the_sitting_ends(plan, small_protocol, seat, person, tmp_path, error):
    def note_and_end(question):
        seat.requests.send(NoteAsked("experimenter", "pain in a finger", adverse=True))
        raise error

    person.at_question = note_and_end
    with pytest.raises(StudyError):
        conduct_new(plan(small_protocol), "simulated", seat)
    assert "pain in a finger" in SessionFolder(tmp_path / "data" / "P01_001").log.read_text()


@pytest.mark.parametrize("lost", ["typed on the screen", "second"])
def test_notes_come_once_each_where_the_disk_was_full_for_a_moment(
    plan, small_protocol, seat, person, monkeypatch, lost
):
    append, folder = EventLog.append, SessionFolder(plan(small_protocol).data_folder / "P01_001")

    def fill_disk(log, event):
        if isinstance(event, NoteTaken) and event.text == lost:
            monkeypatch.setattr(EventLog, "append", append)
            RequestInbox(folder.path).send(NoteAsked("experimenter", "fourth"))
            raise StudyError("The session cannot be written to disk", "The disk is full.", "Make room.")
        append(log, event)

    def note(question):
        for text in ("first", "second", "third"):
            RequestInbox(folder.path).send(NoteAsked("experimenter", text))
        seat.requests.send(NoteAsked("participant", "typed on the screen"))
        monkeypatch.setattr(EventLog, "append", fill_disk)

    person.at_question = note
    with pytest.raises(StudyError, match="The disk is full"):
        conduct_new(plan(small_protocol), "simulated", seat)
    again = Person(seat.clock)
    resumed = conduct_resumed(folder, "simulated", Participant(display=again, hand=again, clock=seat.clock))
    notes = [note.text for note in of(resumed, NoteTaken)]
    assert notes == ["typed on the screen", "first", "second", "third", "fourth"]
    assert list((folder.path / "requests").iterdir()) == []


@pytest.mark.parametrize("closed", [OSError(5, "Input/output error"), KeyboardInterrupt()])
def test_a_screen_that_was_closed_does_not_hide_an_interruption(
    plan, small_protocol, seat, person, tmp_path, monkeypatch, closed
):
    """A step of the clock, such as after sleep, is shown when a note is logged."""

    def report(steps, sitting):
        raise closed

    def interrupt(question):
        seat.requests.send(NoteAsked("experimenter", "pale"))
        monkeypatch.setattr("study.workflows.trial.sitting.report_clock_steps", report)
        raise KeyboardInterrupt

    person.at_question = interrupt
    with pytest.raises(UserInterruptError, match="The force was released"):
        conduct_new(plan(small_protocol), "simulated", seat)
    note, interrupted = read_log(tmp_path / "data" / "P01_001" / "events.jsonl").events[-2:]
    assert (note.text, interrupted.event) == ("pale", "session_interrupted")


def test_a_note_is_logged_where_ctrl_c_comes_after_the_session_was_closed(plan, small_protocol, seat, monkeypatch):
    def interrupt(log):
        seat.requests.send(NoteAsked("experimenter", "a rash", adverse=True))
        raise KeyboardInterrupt

    monkeypatch.setattr("study.workflows.session.run_session.seal_log", interrupt)
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert end.state.closed
    assert [note.text for note in of(end, NoteTaken)] == ["a rash"]


@pytest.mark.parametrize("call", ["fill_in", "await_return", *slow("device_checked", "welcome", "practice_over")])
def test_a_stop_ends_each_screen_that_waits_for_the_participant(plan, full, seat, person, tmp_path, call):
    listeners = []

    def wait(notice):
        RequestInbox(tmp_path / "data" / "P01_001").send(StopAsked("experimenter"))
        listeners[-1]()

    person.listen_with = listeners.append
    setattr(person, call, wait)
    if call == "await_return":
        person.ask = lambda question, sign_of_life: Unanswered("no answer within the time limit", ends_sitting=False)
    end = conduct_new(plan(full), "simulated", seat)
    assert end.end_reason == "the experimenter stopped the session"
    assert len(of(end, FormFilled)) == (0 if call == "fill_in" else 3)
    listeners[-1]()  # the goodbye stays on the screen
    again = Person(seat.clock)
    resumed = conduct_resumed(end.folder, "simulated", Participant(display=again, hand=again, clock=seat.clock))
    assert resumed.state.closed
