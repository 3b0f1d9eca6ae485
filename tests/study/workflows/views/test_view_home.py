"""What a data folder looks like from outside: a line per session, for all that may lie there."""

import json
import shutil
from pathlib import Path

import pytest

from study.devices.opening import DEVICES
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog
from study.workflows.session.withdraw_participant import plan_withdrawal, withdraw
from study.workflows.views.view_home import list_session_lines, make_home_view
from study.workflows.views.view_session import make_session_view


@pytest.fixture
def data(taken_data, tmp_path) -> Path:
    return Path(shutil.copytree(taken_data, tmp_path / "data"))


@pytest.fixture
def unfinished(data, session_logs) -> Path:
    """The same, cut off in the middle."""
    lines = (data / "P01_001" / "events.jsonl").read_bytes().splitlines()
    session_logs.cut(data / "P01_001", len(lines) // 2)
    return data


def only(data: Path):
    (line,) = list_session_lines(data)
    return line


@pytest.mark.slow
def test_a_finished_session_is_told_without_folding_it_and_like_folding_it(data):
    from study.workflows.results.fold_session import fold_session
    from study.workflows.views.session_line import make_line_from_state

    folder = SessionFolder(data / "P01_001")
    line = only(data)
    assert line == make_line_from_state(fold_session(folder).state, folder)
    assert (line.standing, line.observer, line.runs_done, line.runs) == ("finished", "ideal", 3, 3)


def test_an_unfinished_session_says_how_far_it_is(unfinished):
    line = only(unfinished)
    assert line.standing == "unfinished"
    assert line.answers > 0
    assert line.runs_done < line.runs == 3


def test_a_session_that_is_being_written_is_running_and_is_not_disturbed(unfinished):
    log = EventLog.reopen(unfinished / "P01_001" / "events.jsonl")
    try:
        assert only(unfinished).standing == "running"
    finally:
        log.close()
    assert only(unfinished).standing == "unfinished"
    assert only(unfinished).device == "simulated omega.3"


def test_looking_leaves_every_file_as_it_was(unfinished):
    before = {p: (p.stat().st_mtime_ns, p.stat().st_size) for p in unfinished.rglob("*")}
    make_home_view(unfinished)
    assert {p: (p.stat().st_mtime_ns, p.stat().st_size) for p in unfinished.rglob("*")} == before


def test_a_withdrawn_session_has_its_name_only(data):
    folder = SessionFolder(data / "P01_001")
    withdraw(data, plan_withdrawal(folder), "2026-05-04T09:30:00+00:00")
    line = only(data)
    assert (line.standing, line.answers, line.observer) == ("withdrawn", 0, None)
    assert line.begun_utc == "2026-05-04T09:30:00+00:00"
    assert "erased" in line.remark


@pytest.mark.parametrize(
    ("content", "remark"),
    [
        (b"", "no opening line"),
        (b"not json\n", "Line 1 of events.jsonl"),
        (b"\xff\xfe\x00\n" * 3, "Line 1 of events.jsonl"),
        (b'{"event":"session_closed"}\n', "Line 1 of events.jsonl"),
        (b"[" * 5000 + b"\n", "Line 1 of events.jsonl"),
        (b'{"format":"hapteq-session","version":99}\n', "does not know"),
    ],
)
def test_a_log_that_cannot_be_read_is_listed_with_a_remark(data, content, remark):
    (data / "P09_001").mkdir()
    (data / "P09_001" / "events.jsonl").write_bytes(content)
    lines = {line.name: line for line in list_session_lines(data)}
    assert lines["P01_001"].standing == "finished"
    assert lines["P09_001"].standing == "unreadable"
    assert remark in lines["P09_001"].remark


def test_damage_in_the_middle_of_a_finished_log_is_seen(data):
    log = data / "P01_001" / "events.jsonl"
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join([*lines[:9], b"\x00\x00\n", *lines[10:]]))
    line = only(data)
    assert line.standing == "unreadable"
    assert "Line 10" in line.remark


def test_a_folder_without_a_log_and_a_log_that_is_a_folder_are_listed(data):
    (data / "P08_001").mkdir()
    (data / "P09_001" / "events.jsonl").mkdir(parents=True)
    remarks = {line.name: line.remark for line in list_session_lines(data)}
    assert "no log" in remarks["P08_001"]
    assert remarks["P09_001"]


def test_a_renamed_copy_is_no_second_session(data):
    shutil.copytree(data / "P01_001", data / "P02_001")
    line = next(line for line in list_session_lines(data) if line.name == "P02_001")
    assert line.standing == "unreadable"
    assert "copied or renamed" in line.remark


def test_latest_first(data):
    (data / "P02_001").mkdir()  # younger than the simulated session's clock, or not: by its time
    begun = [line.begun_utc for line in list_session_lines(data)]
    assert begun == sorted(begun, reverse=True)


@pytest.mark.parametrize("name", ["nothing", "file"])
def test_a_data_folder_that_is_not_there_is_empty(tmp_path, name):
    (tmp_path / "file").write_text("")
    view = make_home_view(tmp_path / name)
    assert view.sessions == ()
    assert [protocol.name for protocol in view.protocols] == [
        "direction_threshold",
        "direction_training",
        "equalized_threshold",
    ]
    assert view.devices == DEVICES
    assert view.devices[0] == "simulated"


def test_protocols_beside_the_data_are_offered_and_bad_ones_with_their_problem(data, small_text):
    beside = data.parent
    (beside / "mine.toml").write_text(small_text.replace('name = "small"', 'name = "mine"'))
    (data / "bad.toml").write_text(small_text.replace("cap_n = 3.0", "cap_n = -3.0", 1))
    (beside / "pyproject.toml").write_text("[project]\nname = 'no protocol'\n")
    (beside / "torn.toml").write_text("kind = ")
    titles = {Path(line.name).name: line.title for line in make_home_view(data).protocols}
    assert titles["mine.toml"] == "A small study for tests"
    assert titles["bad.toml"].startswith("Cannot be used: staircase.cap_n")
    assert not {"pyproject.toml", "torn.toml", "sweep"} & set(titles)


def test_a_locked_protocol_is_said_to_be_locked(data):
    from study.store.formats.protocol_files import lock_protocol, read_protocol

    lock_protocol(read_protocol("direction_threshold"), data, "2026-05-04T09:30:00+00:00", "1.0")
    locked = {line.name: line.locked for line in make_home_view(data).protocols}
    assert locked.pop("direction_threshold")
    assert "direction_training" in locked and not any(locked.values())


def test_nothing_in_a_tombstone_reaches_the_terminal_as_a_command(data):
    folder = data / "P07_001"
    folder.mkdir()
    left = {"format": "hapteq-tombstone", "version": 1, "withdrawn_utc": "\x1b[2J", "begun": {"protocol": "\x1b]0;x"}}
    (folder / "withdrawn.json").write_text(json.dumps(left))
    line = next(line for line in list_session_lines(data) if line.name == "P07_001")
    assert (line.standing, line.begun_utc, line.protocol) == ("withdrawn", " [2J", " ]0;x")


def test_paths_stay_those_by_which_the_files_are_opened(data, small_text):
    folder = Path(shutil.copytree(data, data.parent / "my\u3000data\t"))  # neither character is printable
    (folder / "mine.toml").write_text(small_text)
    view = make_home_view(folder)
    assert Path(view.sessions[0].path) == folder / "P01_001"
    assert make_session_view(Path(view.sessions[0].path)).line.path == view.sessions[0].path
    assert str(folder / "mine.toml") in [protocol.name for protocol in view.protocols]
    assert "\t" not in view.data
