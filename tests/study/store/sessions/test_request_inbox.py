"""Requests to a running session: a stop wins, garbage does not matter, nothing raises."""

import os
import threading
import time

import pytest

from study.errors import StudyError
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.store.sessions.request_inbox import REQUESTS_NAME, RequestInbox

STOP, PAUSE = StopAsked("experimenter"), PauseAsked("experimenter")
NOTE = NoteAsked("experimenter", "numb thumb – “a bit”", adverse=True)


@pytest.fixture
def inbox(tmp_path):
    inbox = RequestInbox(tmp_path)
    inbox.clear()
    return inbox


@pytest.fixture
def folder(tmp_path, inbox):
    return tmp_path / REQUESTS_NAME


@pytest.mark.parametrize("request_", [STOP, PAUSE, NOTE])
def test_what_is_sent_is_taken_once(inbox, request_):
    name = inbox.send(request_)
    assert inbox.is_unread(name)
    assert inbox.take() == (request_,)
    assert not inbox.is_unread(name)
    assert inbox.take() == ()


def test_the_oldest_comes_first(inbox):
    sent = [NoteAsked("experimenter", str(number)) for number in range(20)]
    for note in sent:
        inbox.send(note)
    assert inbox.take() == tuple(sent)


def test_a_stop_comes_before_everything_that_was_asked_earlier(inbox):
    inbox.send(PAUSE)
    inbox.send(NOTE)
    inbox.send(STOP)
    assert inbox.take() == (STOP, PAUSE, NOTE)


def test_a_stop_wins_over_a_flood(inbox):
    for _ in range(120):
        inbox.send(NOTE)
    inbox.send(STOP)
    first = inbox.take()
    assert first[0] == STOP
    assert len(first) == 50
    assert len(inbox.take()) == 50


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\x00", b'{"format": "hapteq-request", "version": 9}'])
def test_a_stop_is_a_stop_with_any_content_of_its_file(inbox, folder, content):
    (folder / "stop").write_bytes(content)
    assert inbox.take() == (STOP,)
    assert inbox.take() == ()


def test_yesterdays_stop_does_not_end_todays_sitting_and_its_notes_are_not_lost(tmp_path, inbox):
    inbox.send(STOP)
    inbox.send(PAUSE)
    inbox.send(NOTE)
    today = RequestInbox(tmp_path)
    today.clear()
    assert today.take() == (NOTE,)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not json",
        b"[1, 2]",
        b"[" * 50_000,
        b'{"format": "hapteq-request", "version": 1, "request": "erase", "who": "experimenter"}',
        b'{"format": "hapteq-request", "version": 1, "request": "pause", "who": "a stranger"}',
        b'{"format": "hapteq-request", "version": 1, "request": "pause"}',
        b'{"format": "hapteq-request", "version": 1, "request": "note", "who": "program", "text": 3, "adverse": false}',
        b'{"format": "hapteq-request", "version": 2, "request": "pause", "who": "experimenter"}',
    ],
)
def test_garbage_is_set_aside_and_what_comes_after_it_is_heard(inbox, folder, content):
    (folder / "note-1.json").write_bytes(content)
    inbox.send(PAUSE)
    assert inbox.take() == (PAUSE,)
    inbox.clear()  # at the next sitting
    assert (folder / ".unusable-note-1.json").read_bytes() == content
    assert inbox.take() == ()


@pytest.mark.real_time
def test_a_folder_a_pipe_and_a_dangling_link_do_not_hold_it_up(inbox, folder):
    (folder / "note-folder").mkdir()
    os.mkfifo(folder / "note-pipe")
    (folder / "note-link").symlink_to(folder / "nowhere")
    began = time.monotonic()
    assert inbox.take() == ()
    assert time.monotonic() - began < 1.0


def test_half_written_requests_are_not_looked_at(inbox, folder):
    (folder / ".stop-1.json.part").write_text("{")
    assert inbox.take() == ()


def test_without_its_folder_nothing_was_asked(tmp_path):
    assert RequestInbox(tmp_path / "gone").take() == ()
    RequestInbox(tmp_path / "gone").clear()


def test_sending_a_request_makes_the_folder(tmp_path):
    RequestInbox(tmp_path).send(STOP)
    assert RequestInbox(tmp_path).take() == (STOP,)


def test_a_request_that_cannot_be_written_says_what_else_to_do(tmp_path):
    with pytest.raises(StudyError) as told:
        RequestInbox(tmp_path / "gone").send(STOP)
    assert told.value.title == "The session could not be reached"
    assert "A stop could not be put into" in told.value.happened
    assert "switch the device off" in told.value.do_now


def test_an_unread_request_can_be_taken_back(inbox):
    name = inbox.send(STOP)
    assert inbox.take_back(name)
    assert inbox.take() == ()
    assert not inbox.take_back(name)


def test_what_cannot_be_removed_is_heard_once(inbox, folder, monkeypatch):
    inbox.send(PAUSE)
    monkeypatch.setattr("pathlib.Path.unlink", _refuse)
    assert inbox.take() == (PAUSE,)
    assert inbox.take() == ()


def _refuse(*_args, **_kwargs):
    raise PermissionError(1, "not permitted")


def test_many_senders_at_once_lose_nothing(tmp_path, inbox):
    each, senders = 25, 4

    def send(number: int) -> None:
        mine = RequestInbox(tmp_path)
        for place in range(each):
            mine.send(NoteAsked("experimenter", f"{number} {place}"))

    threads = [threading.Thread(target=send, args=(number,)) for number in range(senders)]
    for thread in threads:
        thread.start()
    heard: list[str] = []
    while any(t.is_alive() for t in threads) or len(heard) < each * senders:
        heard += [note.text for note in inbox.take()]
    for number in range(senders):
        assert [text for text in heard if text.startswith(f"{number} ")] == [f"{number} {p}" for p in range(each)]


@pytest.mark.real_time
def test_an_empty_inbox_costs_next_to_nothing(inbox):
    looks = 200
    began = time.perf_counter()
    for _ in range(looks):
        inbox.take()
    assert (time.perf_counter() - began) / looks < 0.002


def test_an_inbox_that_is_a_link_is_neither_read_nor_emptied(tmp_path):
    """The session that looks into it at the start of a sitting removes what is there."""
    elsewhere, session = tmp_path / "elsewhere", tmp_path / "P01_001"
    elsewhere.mkdir()
    session.mkdir()
    (elsewhere / "thesis.txt").write_text("all of it")
    (session / "requests").symlink_to(elsewhere)
    inbox = RequestInbox(session)
    inbox.clear()
    assert inbox.take() == ()
    with pytest.raises(StudyError, match="it is a link"):
        inbox.send(StopAsked("experimenter"))
    assert [path.name for path in elsewhere.iterdir()] == ["thesis.txt"]


def test_a_note_that_was_taken_and_not_logged_comes_again_at_the_next_sitting(tmp_path, inbox, folder):
    """The program may end between both: within a trial, a rest or a form."""
    inbox.send(NOTE)
    assert inbox.take() == (NOTE,)
    again = RequestInbox(tmp_path)
    again.clear()
    assert again.take() == (NOTE,)
    again.forget_logged(NOTE)
    assert list(folder.iterdir()) == []


def test_a_note_that_no_session_would_read_is_refused(inbox, folder):
    long_note = NoteAsked("experimenter", "麻" * 11_000)
    with pytest.raises(StudyError, match="This note is too long for a running session"):
        inbox.send(long_note)
    assert list(folder.iterdir()) == []
    inbox.send(NoteAsked("experimenter", "麻" * 10_000))
    assert len(inbox.take()) == 1


def test_only_the_note_that_is_in_the_log_is_forgotten(tmp_path, inbox):
    """Another one may have been taken and lost, where the disk was full or the program was interrupted."""
    later = NoteAsked("experimenter", "a later one")
    for note in (NOTE, later, later):
        inbox.send(note)
    assert len(inbox.take()) == 3
    inbox.forget_logged(later)
    again = RequestInbox(tmp_path)
    again.clear()
    assert again.take() == (NOTE, later)
