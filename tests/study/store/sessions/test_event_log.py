import os

import pytest

from study.errors import StudyError
from study.session.facts.events import NoteTaken
from study.session.facts.log_chain import append_checksum
from study.store.sessions.event_log import EventLog, read_log, remove_incomplete_line


def note(text: str) -> NoteTaken:
    return NoteTaken(utc="2026-01-01T00:00:00+00:00", who="program", text=text)


@pytest.fixture
def written(tmp_path):
    """A log of two facts, closed."""
    path = tmp_path / "P01_001" / "events.jsonl"
    path.parent.mkdir()
    log = EventLog.create(path)
    log.append(note("first"))
    log.append(note("second"))
    log.close()
    return path


def test_what_was_appended_is_read_back(written):
    contents = read_log(written)
    assert [event.text for event in contents.events] == ["first", "second"]
    assert contents.torn == ""


def test_an_existing_log_is_never_opened_again(written):
    before = written.read_bytes()
    with pytest.raises(StudyError, match="The session log cannot be made"):
        EventLog.create(written)
    assert written.read_bytes() == before


def test_a_log_that_cannot_be_made_is_a_clear_error(tmp_path):
    with pytest.raises(StudyError, match=r"The session log cannot be made.*No such file"):
        EventLog.create(tmp_path / "missing" / "events.jsonl")


@pytest.mark.parametrize("cut", [1, 2, 10, 40])
def test_a_torn_last_line_is_distinguished_and_mended(written, cut):
    whole = written.read_bytes()
    written.write_bytes(whole[:-cut])
    contents = read_log(written)
    assert [event.text for event in contents.events] == ["first"]
    assert contents.torn
    remove_incomplete_line(written, contents)
    assert whole.startswith(written.read_bytes())
    log = EventLog.reopen(written)
    log.append(note("third"))
    log.close()
    assert [event.text for event in read_log(written).events] == ["first", "third"]


def test_a_torn_line_that_cannot_be_removed_is_a_clear_error(written, monkeypatch):
    written.write_bytes(written.read_bytes()[:-2])

    def fail(descriptor: int, size: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "ftruncate", fail)
    with pytest.raises(StudyError) as error:
        remove_incomplete_line(written, read_log(written))
    assert error.value.happened == (
        "The incomplete last line of events.jsonl in P01_001 cannot be removed: Input/output error."
    )
    assert error.value.saved == "All complete lines are on disk."


def test_an_incomplete_line_is_removed_before_the_next_where_that_failed_at_first(written, monkeypatch):
    log, write = EventLog.reopen(written), os.write

    def write_half(descriptor: int, data: bytes) -> int:
        write(descriptor, bytes(data)[:10])
        raise OSError(28, "No space left on device")

    def fail(descriptor: int, size: int) -> None:
        raise OSError(5, "Input/output error")

    with monkeypatch.context() as full_disk:
        full_disk.setattr(os, "write", write_half)
        full_disk.setattr(os, "ftruncate", fail)
        with pytest.raises(StudyError):
            log.append(note("lost"))
    assert read_log(written).torn
    log.append(note("third"))
    log.close()
    contents = read_log(written)
    assert not contents.torn and [event.text for event in contents.events][-1] == "third"


def test_a_broken_line_in_the_middle_is_an_error_that_changes_nothing(written):
    first, second, _ = written.read_bytes().split(b"\n")
    damaged = first[:-5] + b"\n" + second + b"\n"
    written.write_bytes(damaged)
    with pytest.raises(StudyError) as error:
        read_log(written)
    assert error.value.happened == "Line 1 of events.jsonl in P01_001 is not an event that this version knows."
    assert error.value.saved == "The 0 lines before it are whole."
    assert written.read_bytes() == damaged


def test_a_log_of_a_newer_version_is_called_newer_and_not_damaged(tmp_path):
    path = tmp_path / "P01_001" / "events.jsonl"
    path.parent.mkdir()
    path.write_text('{"event": "session_opened", "format": "hapteq-session", "version": 2}\n')
    with pytest.raises(StudyError, match="written by a newer hapteq"):
        read_log(path)


def test_an_event_of_a_newer_version_is_not_called_damage(written):
    line = append_checksum(read_log(written).chain, b'{"utc":"2026-01-01T00:00:00Z","event":"pulse_counted"}')[1]
    written.write_bytes(written.read_bytes() + line)
    with pytest.raises(StudyError) as told:
        read_log(written)
    assert told.value.title == "The session log holds an unknown event"
    assert told.value.happened == "Line 3 of events.jsonl in P01_001 is not an event that this version knows."
    assert told.value.do_now.startswith("It is not damaged: use the newer hapteq that wrote it.")


@pytest.mark.parametrize("version", ["0", "-1", "true", '"2"', "null", "1.5"])
def test_a_log_of_no_version_is_damaged_and_not_newer(tmp_path, version):
    path = tmp_path / "P01_001" / "events.jsonl"
    path.parent.mkdir()
    path.write_text(f'{{"event": "session_opened", "format": "hapteq-session", "version": {version}}}\n')
    with pytest.raises(StudyError, match="The session log is damaged|is not an event that this version knows"):
        read_log(path)


def test_ctrl_c_in_the_middle_of_a_write_leaves_no_half_line(written, monkeypatch):
    before = written.read_bytes()
    real = os.write

    def interrupted(descriptor: int, data: bytes) -> int:
        real(descriptor, data[:10])
        raise KeyboardInterrupt

    log = EventLog.reopen(written)
    monkeypatch.setattr("study.store.sessions.event_log.os.write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        log.append(note("half"))
    log.close()
    assert written.read_bytes() == before


def test_a_log_has_one_writer_even_when_the_lock_file_is_gone(written):
    log = EventLog.reopen(written)
    with pytest.raises(StudyError, match="Another program is writing to P01_001"):
        EventLog.reopen(written)
    log.close()
    EventLog.reopen(written).close()


def test_a_log_that_cannot_be_opened_for_writing_is_said_so(tmp_path):
    """A folder in its place: refused by the system for every user, root included."""
    (tmp_path / "events.jsonl").mkdir()
    with pytest.raises(StudyError, match="cannot be written to.*Is a directory") as error:
        EventLog.reopen(tmp_path / "events.jsonl")
    assert error.value.saved == "Nothing was changed."


def test_a_missing_log_is_said_so(tmp_path):
    with pytest.raises(StudyError, match="cannot be read.*No such file"):
        read_log(tmp_path / "events.jsonl")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")  # noqa: PTH110
def test_a_full_disk_is_an_error_that_says_what_is_safe(tmp_path):
    path = tmp_path / "events.jsonl"
    path.symlink_to("/dev/full")
    log = EventLog(path, os.open(path, os.O_WRONLY))
    with pytest.raises(StudyError) as error:
        log.append(note("lost"))
    log.close()
    assert "No space left on device" in error.value.happened
    assert error.value.saved == "Everything logged before is on disk."


def test_a_write_that_fails_half_way_leaves_no_half_line(written):
    """The file's size limit tears the line; the log takes the torn part back."""
    script = f"""
import resource, signal
from pathlib import Path
from study.errors import StudyError
from study.session.facts.events import NoteTaken
from study.store.sessions.event_log import EventLog
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
path = Path({str(written)!r})
log = EventLog.reopen(path)
resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 20,) * 2)
try:
    log.append(NoteTaken(utc="2026-01-01T00:00:00+00:00", who="program", text="x" * 100))
except StudyError as error:
    print(error.title)
"""
    import subprocess
    import sys

    before = written.read_bytes()
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "The session cannot be written to disk", done.stderr
    assert written.read_bytes() == before


@pytest.mark.parametrize("is_replaced", [False, True])
def test_nothing_is_logged_into_a_folder_that_was_moved_away(written, is_replaced):
    log, away = EventLog.reopen(written), written.parent.with_name("away")
    written.parent.rename(away)
    if is_replaced:
        written.parent.mkdir()
        written.write_bytes((away / written.name).read_bytes())
    with pytest.raises(StudyError, match="The session log is gone"):
        log.append(note("third"))
    assert len(read_log(away / written.name).events) == 2
    if is_replaced:
        written.unlink()
        written.parent.rmdir()
    away.rename(written.parent)
    log.append(note("third"))
    log.close()
    assert len(read_log(written).events) == 3
