"""Requests to the running session: stop, pause and note, heard or not."""

import os
import threading
import time
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from study.devices.clock import RealClock
from study.errors import StudyError
from study.session.watching.live_state import LiveState
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog, read_log
from study.store.sessions.live_file import write_live
from study.store.sessions.request_inbox import RequestInbox
from study.store.sessions.session_lock import hold_session_lock
from study.workflows.files.validate import validate_file
from study.workflows.results.fold_session import fold_session
from study.workflows.views.send_request import send_request
from study.workflows.views.take_note import take_note
from study.workflows.views.watch_session import follow

pytestmark = pytest.mark.real_time

STOP, PAUSE = StopAsked("experimenter"), PauseAsked("experimenter")

NOTE = NoteAsked("experimenter", "asks for a lower chair")


def now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@pytest.fixture
def whole(finished) -> SessionFolder:
    return finished.folder


def test_a_fresh_live_state_saves_the_look_at_the_lock(sitter):
    folder = sitter.interrupted(after=3).folder
    lines = folder.log.read_bytes().splitlines(keepends=True)
    folder.log.write_bytes(b"".join(lines[:-1]))
    live = LiveState("2999-01-01T00:00:00.000+00:00", "trial", now(), "", 0.5, True, 1.0, False, 0)
    write_live(folder.path, live)
    view = follow(folder.path).look(now())
    assert (view.standing, view.live) == ("running", live)


class Session:
    """Holds the log as a running session does, and takes what is asked of it."""

    def __init__(self, folder: SessionFolder, hears: bool) -> None:
        self.folder, self.hears = folder, hears
        self.heard: list[object] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> "Session":
        self._log = EventLog.reopen(self.folder.log)
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._over.set()
        self._thread.join()
        self._log.close()

    def _run(self) -> None:
        inbox = RequestInbox(self.folder.path)
        while self.hears and not self._over.is_set():
            self.heard += inbox.take()
            time.sleep(0.01)


@pytest.fixture
def soon(monkeypatch):
    monkeypatch.setattr("study.workflows.views.send_request.RECEIVE_TIMEOUT_S", 0.1)


@pytest.mark.parametrize("request_", [STOP, PAUSE, NOTE])
def test_a_running_session_hears_what_is_asked(sitter, request_):
    with Session(sitter.interrupted(after=2).folder, hears=True) as session:
        assert send_request(session.folder, request_, RealClock())
        time.sleep(0.02)
    assert session.heard == [request_]


def test_where_nothing_runs_nothing_can_be_stopped(whole):
    with pytest.raises(StudyError) as told:
        send_request(whole, STOP, RealClock())
    assert told.value.title == "This session is not running"
    assert "No program has P01_001 open" in told.value.happened
    assert not (whole.path / "requests").exists() or RequestInbox(whole.path).take() == ()


def test_a_stop_that_is_not_heard_stays_and_says_what_to_do(sitter, soon):
    with Session(sitter.interrupted(after=2).folder, hears=False) as session:
        with pytest.raises(StudyError) as told:
            send_request(session.folder, STOP, RealClock())
        assert told.value.title == "The session did not respond to the stop"
        assert "accepted no request within 0.1 s" in told.value.happened
        assert "switch the device off" in told.value.do_now
        assert RequestInbox(session.folder.path).take() == (STOP,)


def test_a_pause_that_is_not_heard_is_taken_back(sitter, soon):
    with Session(sitter.interrupted(after=2).folder, hears=False) as session:
        with pytest.raises(StudyError, match="The session did not respond to the pause"):
            send_request(session.folder, PAUSE, RealClock())
        assert RequestInbox(session.folder.path).take() == ()


def test_a_note_that_is_not_heard_yet_waits(sitter, soon):
    with Session(sitter.interrupted(after=2).folder, hears=False) as session:
        assert not take_note(session.folder, NOTE, RealClock())
        assert RequestInbox(session.folder.path).take() == (NOTE,)


def test_a_note_on_a_session_that_does_not_run_is_written_into_its_log(whole):
    before = whole.log.read_bytes()
    assert take_note(whole, replace(NOTE, adverse=True), RealClock())
    assert whole.log.read_bytes().startswith(before)
    written = read_log(whole.log).events[-1]
    assert (written.event, written.who, written.text, written.adverse) == (
        "note_taken", "experimenter", NOTE.text, True,
    )  # fmt: skip
    assert fold_session(whole).state.closed
    assert validate_file(whole.path).problems == ()


def test_a_waiting_note_behind_many_unusable_files_is_written_too(whole):
    """A call of a running session's loop takes 50 files, and may set all of them aside."""
    inbox = RequestInbox(whole.path)
    inbox.clear()
    for number in range(60):
        (whole.path / "requests" / f"note-00{number:03d}.json").write_text("{")
    inbox.send(replace(NOTE, text="waits"))
    assert take_note(whole, NOTE, RealClock())
    assert [event.text for event in read_log(whole.log).events[-2:]] == ["waits", NOTE.text]


def test_a_torn_line_is_kept_as_a_note_before_the_note(brief):
    folder = brief.interrupted(after=2).folder
    folder.log.write_bytes(folder.log.read_bytes() + b'{"utc":"2026')
    take_note(folder, NOTE, RealClock())
    mended, note = read_log(folder.log).events[-2:]
    assert (mended.who, mended.text) == ("program", 'a torn last line was cut off: {"utc":"2026')
    assert note.text == NOTE.text
    assert brief.resumed(folder).state.closed


def test_an_empty_note_is_none(whole):
    with pytest.raises(StudyError, match="There is nothing to note"):
        take_note(whole, replace(NOTE, text="  "), RealClock())
    before = whole.log.read_bytes()
    with pytest.raises(StudyError, match="not UTF-8"):
        take_note(whole, replace(NOTE, text=os.fsdecode(b"caf\xe9")), RealClock())
    assert whole.log.read_bytes() == before


def test_a_note_that_the_session_did_not_hear_before_its_end_is_written_into_its_log(whole, monkeypatch):
    folder = whole
    earlier_texts = [f"an earlier one, {number}" for number in range(60)]  # more than the inbox hands out at once
    for text in earlier_texts:
        RequestInbox(folder.path).send(replace(NOTE, text=text))
    session = Session(folder, hears=False)

    class Clock(RealClock):
        def sleep(self, seconds: float) -> None:
            """The session ends while the note waits."""
            if session is not None and not session._over.is_set():
                session.__exit__()

    monkeypatch.setattr("study.workflows.views.send_request.RECEIVE_TIMEOUT_S", 0.1)
    session.__enter__()
    assert take_note(folder, NOTE, Clock())
    assert [event.text for event in read_log(folder.log).events[-61:]] == [*earlier_texts, NOTE.text]
    assert RequestInbox(folder.path).take() == ()
    assert validate_file(folder.path).problems == ()


def test_a_note_that_was_sent_is_not_said_to_be_lost_where_it_cannot_be_written_yet(whole, monkeypatch):
    def end_unheard(folder, note, clock):
        RequestInbox(folder.path).send(note)
        session.__exit__()
        return False

    monkeypatch.setattr("study.workflows.views.take_note.send_request", end_unheard)
    session = Session(whole, hears=False)
    session.__enter__()
    with hold_session_lock(whole.path), pytest.raises(StudyError, match="running elsewhere") as told:
        take_note(whole, NOTE, RealClock())
    assert told.value.saved == "The note is kept in the session's folder, and need not be written again."
    assert take_note(whole, replace(NOTE, text="another"), RealClock())
    assert [event.text for event in read_log(whole.log).events[-2:]] == [NOTE.text, "another"]
