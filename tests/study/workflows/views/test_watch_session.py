"""Follow a log while it grows."""

import os
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from study.devices.clock import RealClock
from study.errors import StudyError
from study.session.watching.live_state import LiveState
from study.session.watching.requests import NoteAsked, StopAsked
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import LOG_NAME, EventLog
from study.store.sessions.live_file import write_live
from study.store.sessions.log_lock import is_log_locked
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.files.validate import validate_file
from study.workflows.views.take_note import take_note
from study.workflows.views.watch_session import follow

pytestmark = pytest.mark.real_time


def now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


class Growing:
    """A log that grows byte by byte, as a copy of a whole one."""

    def __init__(self, folder, data: bytes) -> None:
        self.data = data
        self.path = folder / LOG_NAME
        self.path.write_bytes(b"")

    def grow_to(self, length: int) -> None:
        with self.path.open("ab") as file:
            file.write(self.data[self.path.stat().st_size : length])


@pytest.fixture
def whole(finished) -> SessionFolder:
    return finished.folder


@pytest.fixture
def growing(tmp_path, whole) -> Growing:
    folder = tmp_path / "copy" / whole.name
    folder.mkdir(parents=True)
    return Growing(folder, whole.log.read_bytes())


def test_a_log_followed_while_it_grows_ends_at_the_view_of_the_whole(growing, whole):
    follower = follow(growing.path.parent)
    lengths = range(0, len(growing.data) + 1, 997)
    seen = []
    for length in [*lengths, len(growing.data)]:
        growing.grow_to(length)
        view = follower.look(now())
        seen += [view.answers] if view is not None else []
    at_once = follow(whole.path).look(view.utc)
    assert replace(view, alarms=()) == replace(at_once, alarms=())
    assert view.standing == "finished"
    assert seen == sorted(seen)


def test_a_torn_last_line_waits_until_it_is_whole(growing):
    lines = growing.data.splitlines(keepends=True)
    follower = follow(growing.path.parent)
    growing.grow_to(len(lines[0]) + len(lines[1]) - 1)
    assert follower.look(now()).open_trial is None
    growing.grow_to(len(lines[0]) + len(lines[1]))
    view = follower.look(now())
    assert view.open_trial.trial == 0
    assert "log" not in [alarm.kind for alarm in view.alarms]


def test_without_a_first_line_there_is_nothing_to_see(growing):
    assert follow(growing.path.parent).look(now()) is None
    growing.grow_to(10)
    assert follow(growing.path.parent).look(now()) is None


def test_a_line_that_its_writer_took_back_is_taken_back_here(growing):
    lines = growing.data.splitlines(keepends=True)
    growing.grow_to(sum(map(len, lines[:4])))
    follower = follow(growing.path.parent)
    assert follower.look(now()).answers == 1
    os.truncate(growing.path, sum(map(len, lines[:2])))
    assert follower.look(now()).answers == 0
    growing.grow_to(len(growing.data))
    assert follower.look(now()).standing == "finished"


def test_following_changes_nothing_in_the_folder(whole):
    before = {path: path.read_bytes() for path in whole.path.rglob("*") if path.is_file()}
    follower = follow(whole.path)
    for _ in range(3):
        follower.look(now())
    assert {path: path.read_bytes() for path in whole.path.rglob("*") if path.is_file()} == before


def test_a_contradiction_is_an_alarm_that_tells_nothing_of_the_draw(growing, session_logs):
    growing.grow_to(len(b"".join(growing.data.splitlines(keepends=True)[:2])))
    session_logs.as_older(growing.path.parent, lambda text: text.replace(b'"level_n":1.0', b'"level_n":2.0'))
    view = follow(growing.path.parent).look(now())
    assert view.alarms[0].sentence == "The log cannot be followed: it contradicts the rules."
    assert view.open_trial is None


def test_a_damaged_line_is_an_alarm(growing, session_logs):
    growing.grow_to(len(b"".join(growing.data.splitlines(keepends=True)[:2])))
    session_logs.as_older(growing.path.parent, lambda text: text.replace(b'"level_n"', b'"level_m"'))
    view = follow(growing.path.parent).look(now())
    assert "a line of it is no event that this version knows" in view.alarms[0].sentence


def test_a_line_that_was_changed_is_an_alarm(growing):
    whole = growing.data.splitlines(keepends=True)[:2]
    growing.path.write_bytes(b"".join(whole).replace(b'"level_n":1.0', b'"level_n":2.0'))
    view = follow(growing.path.parent).look(now())
    assert view.alarms[0].sentence == "The log cannot be followed: line 2 of it does not match its checksum."
    assert view.open_trial is None


def test_the_cut_end_of_a_finished_log_is_an_alarm(whole):
    assert follow(whole.path).look(now()).alarms == ()
    text = whole.log.read_bytes()
    whole.log.write_bytes(b"".join(text.splitlines(keepends=True)[:-1]))
    assert follow(whole.path).look(now()).alarms[0].sentence == "The log cannot be followed: its end is missing."


def test_a_first_line_of_another_kind_cannot_be_followed(growing):
    growing.path.write_bytes(growing.data.splitlines(keepends=True)[1])
    with pytest.raises(StudyError, match="This session cannot be followed"):
        follow(growing.path.parent).look(now())
    growing.path.write_bytes(b'{"format": "something"}\n')
    with pytest.raises(StudyError, match="first line of the log of P01_001 is none that this version knows"):
        follow(growing.path.parent).look(now())


def test_a_session_erased_under_the_watcher_is_reported(growing):
    growing.grow_to(len(growing.data.splitlines(keepends=True)[0]))
    follower = follow(growing.path.parent)
    follower.look(now())
    growing.path.unlink()
    view = follower.look(now())
    assert view.standing == "not running"
    assert view.alarms[0].kind == "log"


def test_a_killed_session_is_not_running_and_one_that_writes_is(sitter):
    folder = sitter.interrupted(after=3).folder
    lines = folder.log.read_bytes().splitlines(keepends=True)
    folder.log.write_bytes(b"".join(lines[:-1]))
    assert follow(folder.path).look(now()).standing == "not running"
    log = EventLog.reopen(folder.log)
    try:
        assert is_log_locked(folder.log) is True
        assert follow(folder.path).look(now()).standing == "running"
    finally:
        log.close()
    assert is_log_locked(folder.log) is False


def test_whether_a_missing_log_is_being_written_is_unknown(tmp_path):
    assert is_log_locked(tmp_path / "events.jsonl") is None


def test_live_state_and_requests_do_not_disturb_what_is_validated(whole):
    write_live(whole.path, LiveState(now(), "idle", now(), "", None, True, None, False, 0))
    RequestInbox(whole.path).send(StopAsked("experimenter"))
    assert validate_file(whole.path).problems == ()
    assert validate_file(whole.path / "live.json").kind == "live state of a session"
    request = next((whole.path / "requests").iterdir())
    assert (validate_file(request).kind, validate_file(request).problems) == ("request to a running session", ())


def test_control_characters_of_a_note_do_not_reach_the_terminal(whole):
    take_note(whole, NoteAsked("experimenter", "numb\x1b[2J\rthumb", adverse=True), RealClock())
    (note,) = follow(whole.path).look(now()).notes
    assert note.text == "numb [2J thumb"
