"""One session looked at: what a folded log says, and what is still said of a damaged one."""

import shutil
from pathlib import Path

import pytest

from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog
from study.workflows.results.write_results import write_results
from study.workflows.session.withdraw_participant import plan_withdrawal, withdraw
from study.workflows.views.session_line import make_session_line
from study.workflows.views.view_session import make_session_view


@pytest.fixture
def taken(taken_data) -> Path:
    return taken_data / "P01_001"


@pytest.fixture
def session(taken, tmp_path) -> Path:
    return Path(shutil.copytree(taken, tmp_path / "P01_001"))


@pytest.mark.slow
def test_thresholds_are_those_of_thresholds_csv(taken):
    header, *rows = make_session_view(taken).thresholds
    written = [line.split(",") for line in (taken / "thresholds.csv").read_text().splitlines()]
    column = written[0].index("threshold_n")
    assert [row[header.index("threshold")].split()[-2] for row in rows] == [
        f"{float(line[column]):.3f}" for line in written[1:]
    ]


@pytest.mark.slow
def test_every_run_has_its_staircase_with_as_many_levels_as_answers(taken):
    view = make_session_view(taken)
    assert [s.title.split(":")[0] for s in view.staircases] == ["Run 1", "Run 2", "Run 3"]
    assert sum(len(s.levels_n) for s in view.staircases) == view.line.answers
    assert all(len(s.levels_n) == len(s.correct) == len(s.reversals) for s in view.staircases)
    assert [s.threshold_n is not None for s in view.staircases] == [False, True, True]
    assert sum(view.staircases[1].reversals) == 5


def test_facts_name_participant_protocol_and_seed(taken):
    facts = dict(make_session_view(taken).facts)
    assert facts["participant"] == "P01, simulated (ideal), number 1 of this protocol"
    assert facts["protocol"].startswith("small (")
    assert facts["runs"] == "3 of 3"
    assert facts["seed"] == "3"


def test_report_and_figures_are_found_where_they_were_written(taken):
    view = make_session_view(taken)
    assert Path(view.report).is_file()
    assert {Path(path).name for path in view.figures} >= {"thresholds.png"}


@pytest.mark.slow
def test_a_report_is_there_once_it_is_written(session):
    shutil.rmtree(session / "analysis")
    before = make_session_view(session)
    assert (before.report, before.figures) == ("", ())
    write_results(SessionFolder(session))
    assert make_session_view(session).report == str(session / "analysis" / "report.html")


def test_a_session_without_a_complete_run_has_no_thresholds_but_its_staircase(session, session_logs):
    session_logs.cut(session, 12)
    view = make_session_view(session)
    assert view.thresholds == ()
    assert view.line.standing == "unfinished"
    assert view.staircases[0].title.endswith("not complete")


def test_the_open_trial_of_a_running_session_keeps_its_direction(session, session_logs):
    lines = (session / "events.jsonl").read_bytes().splitlines()
    last = max(n for n, line in enumerate(lines) if b'"trial_presented"' in line)
    session_logs.cut(session, last + 1)
    log = EventLog.reopen(session / "events.jsonl")
    try:
        view = make_session_view(session)
    finally:
        log.close()
    assert view.line.standing == "running"
    assert "direction" not in view.events[-1]
    assert sum("direction" in line and "Run" in line for line in view.events) == view.line.answers


def test_a_torn_last_line_is_reported(session):
    with (session / "events.jsonl").open("ab") as log:
        log.write(b'{"utc":"2026')
    assert "A crash left the last line" in make_session_view(session).warnings[0]


def test_of_a_damaged_log_the_whole_lines_are_shown_and_the_damage_is_named(session):
    log = session / "events.jsonl"
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join([*lines[:5], b"{}\n", *lines[6:]]))
    view = make_session_view(session)
    assert view.line.standing == "unreadable"
    assert len(view.events) == 1 + 5
    assert "Line 6" in " ".join(view.warnings)
    assert view.staircases == ()


def test_a_log_that_contradicts_its_rules_cannot_be_read_in_the_list_either(session, session_logs):
    session_logs.as_older(session, lambda text: text.replace(b'"answer":1', b'"answer":2', 1))
    view = make_session_view(session)
    assert view.line.standing == "unreadable"
    assert "contradicts the rules" in view.warnings[0]
    assert "trial" in make_session_line(SessionFolder(session)).remark


@pytest.mark.slow
def test_a_log_of_an_older_version_says_that_it_has_no_checksums(session, session_logs):
    lines = len((session / "events.jsonl").read_bytes().splitlines())
    assert dict(make_session_view(session).facts)["log"] == f"{lines} lines, with checksums, sealed to line {lines}"
    session_logs.as_older(session)
    view = make_session_view(session)
    assert view.line.standing == "finished"
    assert "contains no checksums" in view.warnings[0]
    assert "without checksums" in dict(view.facts)["log"]


def test_a_withdrawn_session_is_its_name_and_a_sentence(session):
    withdraw(session.parent, plan_withdrawal(SessionFolder(session)), "2026-05-04T09:30:00+00:00")
    view = make_session_view(session)
    assert view.line.standing == "withdrawn"
    assert (view.events, view.thresholds, view.staircases) == ((), (), ())


def test_a_folder_that_is_not_there_is_a_view_too(tmp_path):
    assert make_session_view(tmp_path / "P01_001").line.standing == "unreadable"


@pytest.mark.parametrize("seed", range(8))
def test_a_log_with_damaged_bytes_can_be_viewed(session, seed):
    import numpy as np

    log = session / "events.jsonl"
    content = bytearray(log.read_bytes())
    random = np.random.default_rng(seed)
    for place in random.integers(0, len(content), 3):
        content[place] = random.integers(0, 256)
    log.write_bytes(bytes(content))
    assert make_session_view(session).line.name == "P01_001"


def test_a_simulated_session_that_ends_in_the_future_says_why(taken):
    finished = dict(make_session_view(taken).facts)["finished"]
    assert finished.endswith("+00:00, in simulated time, which runs ahead of the clock")
