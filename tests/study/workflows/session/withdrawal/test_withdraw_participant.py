"""Withdrawal erases this participant and nothing else."""

import errno
import json
import os
import shlex
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from study.cli.main import app
from study.errors import StudyError
from study.store.sessions.archive import SessionFolder, SessionWithdrawnError
from study.store.sessions.event_log import EventLog
from study.workflows.files.validate import validate_file
from study.workflows.results import session_results
from study.workflows.session.withdraw_participant import list_remaining_copies, plan_withdrawal, withdraw
from tests.study.workflows.session.withdrawal.data_folder import UTC, copy_session, erase, files, write_analysis

PART = ".anova.json.0123abcd.part"


def test_a_link_in_the_place_of_a_session_is_named_and_left_alone(data, elsewhere):
    shutil.rmtree(data / "P01_002")
    (data / "P01_002").symlink_to(elsewhere)
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    assert plan.sessions == ("P01_001",)
    assert "P01_002 is a link; neither it nor what it leads to was touched." in plan.doubtful
    withdraw(data, plan, UTC)
    assert (data / "P01_002").is_symlink()
    done = CliRunner().invoke(app, ["withdraw", "P01_002", "--data", str(data), "--yes"])
    assert isinstance(done.exception, StudyError)
    assert "P01_002 leads to another place, where nothing is erased." in str(done.exception)


def test_a_link_put_in_the_place_of_a_session_after_the_question_is_not_followed(data, elsewhere):
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    shutil.rmtree(data / "P01_002")
    (data / "P01_002").symlink_to(elsewhere)
    with pytest.raises(StudyError, match="Not everything could be erased"):
        withdraw(data, plan, UTC)
    assert (data / "P01_001" / "trials.csv").exists()


@pytest.mark.parametrize("kept", ["nothing", "a log of P02", "a log of another session", "a linked log"])
def test_a_folder_that_is_not_proved_to_be_the_participants_is_listed(data, elsewhere, kept):
    folder = data / "P01_003"
    folder.mkdir()
    (folder / "thesis.txt").write_text("all of it")
    match kept:
        case "a log of P02":
            shutil.copy(data / "P02_001" / "events.jsonl", folder)
        case "a log of another session":
            shutil.copy(data / "P01_001" / "events.jsonl", folder)
        case "a linked log":
            (folder / "events.jsonl").symlink_to(elsewhere / "events.jsonl")
    before = files(folder)
    done = CliRunner().invoke(app, ["withdraw", "P01_001", "--data", str(data), "--yes"])
    assert done.exit_code == 0, done.output
    said = {"a log of another session": "holds a log of P01 under another name: it was copied or renamed."}
    expected = said.get(kept, "holds no log that says it is a session of P01.")
    assert f"Not to be erased: P01_003 {expected}" in done.output
    assert files(folder) == before


@pytest.mark.parametrize("name", ["recordings", "trials.csv", "session.lock", "withdrawn.json", "notes", "figures/x"])
def test_a_link_inside_a_session_goes_and_what_it_leads_to_stays(data, elsewhere, name):
    link = data / "P01_001" / name
    link.parent.mkdir(exist_ok=True)
    if link.is_dir():
        shutil.rmtree(link)
    link.unlink(missing_ok=True)
    link.symlink_to(elsewhere if name != "trials.csv" else elsewhere / "trials.csv")
    # Recordings that were moved to another disk would stay there, and nothing would say where.
    told = f"P01_001/{name} is a link; what it leads to was not touched: {link.readlink()}."
    assert told in plan_withdrawal(SessionFolder(data / "P01_001")).doubtful
    erase(data)
    assert not link.is_symlink()
    assert {path.name for path in (data / "P01_001").iterdir()} <= {"withdrawn.json", "session.lock"}
    assert validate_file(data / "P01_001").problems == ()


@pytest.mark.parametrize("name", ["analysis", "analysis/figures"])
def test_a_linked_analysis_is_not_emptied(data, tmp_path, name):
    write_analysis(tmp_path / "mine", "P01")
    shutil.rmtree(data / name)
    link = tmp_path / "mine" / ("figures" if "/" in name else "")
    (data / name).symlink_to(link)
    before = files(tmp_path / "mine")
    erase(data)
    assert files(tmp_path / "mine") == before


def test_what_was_made_from_others_alone_stays(data):
    shutil.rmtree(data / "analysis")
    write_analysis(data / "analysis", "P02")
    write_analysis(data / "with_p01", "P02", "P01")
    (data / "with_p01" / PART).write_text("{")
    (data / PART).write_text("{")
    (data / ".found.89abcdef.part").mkdir()
    (data / ".found.89abcdef.part" / "diagnosis.json").write_text('{"recordings": ["P01_002"]}')
    others = files(data / "analysis")
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    assert plan.derived_roots == (".found.89abcdef.part", "with_p01")
    assert plan.doubtful == (f"{PART} does not say whose numbers it holds.",)
    withdraw(data, plan, UTC)
    assert files(data / "analysis") == others
    assert sorted(path.name for path in data.iterdir()) == sorted(
        [PART, "P01_001", "P01_002", "P02_001", "analysis"]
    )  # fmt: skip


def test_an_analysis_whose_report_says_that_the_participant_was_left_out_is_erased(data):
    """Such as of a person who was excluded: the numbers are those of others."""
    shutil.rmtree(data / "analysis")
    for folder, session in (("analysis", "P01_002"), ("others", "P010_002")):
        write_analysis(data / folder, "P02")
        (data / folder / "report.html").write_text(f"{session} does not take part: excluded.")
    (data / "notes").mkdir()
    (data / "notes" / "report.html").write_text("P01_001 was late")
    assert plan_withdrawal(SessionFolder(data / "P01_001")).derived_roots == ("analysis",)
    erase(data)
    assert not (data / "analysis").exists()
    assert (data / "others" / "report.html").exists()
    assert (data / "notes" / "report.html").exists()


def test_an_analysis_that_does_not_say_whose_it_is_is_listed(data):
    (data / "analysis" / "thresholds.csv").unlink()
    for figure in (data / "analysis" / "figures").iterdir():
        figure.unlink()
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    assert "analysis/report.html does not say whose numbers it holds." in plan.doubtful
    withdraw(data, plan, UTC)
    assert (data / "analysis" / "report.html").exists()


def test_a_session_of_a_very_long_protocol_is_the_participants(data):
    log = data / "P01_002" / "events.jsonl"
    log.write_text(log.read_text().replace('"protocol_text":"', f'"protocol_text":"#{"-" * 2**21}', 1))
    assert plan_withdrawal(SessionFolder(data / "P01_001")).sessions == ("P01_001", "P01_002")


def test_copies_that_name_the_participant_are_named(data, tmp_path):
    copied = shutil.copytree(data / "P01_001", data / "P01_001 (copy)")
    shutil.copytree(data / "P01_002", data / "backup of May" / "P01_002")
    (data / "todo.txt").write_text("call P01_002 again")
    (data / "P010_001.txt").write_text("P010_001 is another participant")
    for out in ("out", "other_study"):
        write_analysis(tmp_path / out, "P01" if out == "out" else "P02")
    (data / "written_elsewhere.txt").write_text(
        f"{tmp_path / 'out'}\n{tmp_path / 'other_study'}\n{tmp_path / 'gone'}\n"
    )
    done = CliRunner().invoke(app, ["withdraw", "P01_001", "--data", str(data), "--yes"])
    assert done.exit_code == 0, done.output
    assert "P01_001 (copy) holds a log of P01 under another name" in done.output
    assert "Not to be erased: backup of May/P01_002 is named like a session of P01." in done.output
    assert "Not to be erased: todo.txt names P01." in done.output
    assert "P010" not in done.output
    assert f"Written with --out, and not erased: {tmp_path / 'out'}" in done.output
    assert str(tmp_path / "other_study") not in done.output
    assert str(tmp_path / "gone") not in done.output
    assert (copied / "events.jsonl").exists()


def test_a_running_session_stops_the_withdrawal_before_anything_is_changed(data):
    before = files(data)
    log = EventLog.reopen(data / "P01_002" / "events.jsonl")
    with pytest.raises(StudyError, match="Another program is writing to P01_002") as told:
        erase(data)
    assert told.value.do_now == f"Close it there first. Then erase with: hapteq withdraw P01_002 --data {data}"
    log.close()
    assert {name: held for name, held in files(data).items() if not name.endswith("session.lock")} == before


def test_a_forged_withdrawal_intent_erases_nothing_of_others(data, elsewhere):
    left = {"subject": "P01", "withdrawn_utc": UTC, "sessions": {"../other/P01_002": None, "P02_001": None},
            "derived": ["../other/P01_002/trials.csv", str(elsewhere), "analysis"]}  # fmt: skip
    document = {"format": "hapteq-withdrawal", "version": 1, **left}
    (data / "P01.withdrawal.json").write_text(json.dumps(document))
    erase(data)
    assert (data / "P02_001" / "events.jsonl").exists()
    assert not (data / "analysis").exists()


def test_a_log_of_another_in_a_folder_that_was_the_participants_is_not_erased(data, elsewhere):
    shutil.rmtree(data / "P01_002")
    shutil.copytree(data / "P02_001", data / "P01_002")
    tombstone = {"format": "hapteq-tombstone", "version": 1, "session": "P01_002", "withdrawn_utc": UTC}
    (data / "P01_002" / "withdrawn.json").write_text(json.dumps(tombstone))
    (data / "P01_003").mkdir()
    (data / "P01_003" / "mine.txt").write_text("not of a session")
    sessions = {"P01_002": None, "P01_003": None}
    left = {"subject": "P01", "withdrawn_utc": UTC, "sessions": sessions, "derived": ["P02_001/events.jsonl"]}
    document = {"format": "hapteq-withdrawal", "version": 1, **left}
    (data / "P01.withdrawal.json").write_text(json.dumps(document))
    erase(data)
    assert (data / "P01_002" / "events.jsonl").read_bytes() == (data / "P02_001" / "events.jsonl").read_bytes()
    assert (data / "P01_003" / "mine.txt").exists()


def test_an_analysis_that_is_called_like_a_session_is_erased(data):
    (data / "analysis").rename(data / "results_2026")
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    assert plan.derived_roots == ("results_2026",)
    left = {"subject": "P01", "withdrawn_utc": UTC, "sessions": {}, "derived": plan.derived}
    document = {"format": "hapteq-withdrawal", "version": 1, **left}
    (data / "P01.withdrawal.json").write_text(json.dumps(document))
    (data / "results_2026" / "thresholds.csv").unlink()
    for figure in (data / "results_2026" / "figures").iterdir():
        figure.unlink()
    erase(data)
    assert not (data / "results_2026").exists()


def test_what_was_written_after_the_question_is_erased_too(data):
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    copy_session(data, "P01_003")
    write_analysis(data / "late", "P02", "P01")
    erased = withdraw(data, plan, UTC)
    assert (erased.sessions, erased.derived_roots) == (("P01_001", "P01_002", "P01_003"), ("analysis", "late"))
    assert not (data / "late").exists()
    assert [path.name for path in (data / "P01_003").iterdir() if path.name != "session.lock"] == ["withdrawn.json"]


def test_an_export_that_was_killed_and_an_analysis_of_an_export_are_named(data, tmp_path):
    export, unfinished, report = tmp_path / "export", tmp_path / ".export.0123abcd.part", tmp_path / "report"
    unfinished.mkdir()
    (data / "written_elsewhere.txt").write_text(f"{export}\n")
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    assert list_remaining_copies(data, plan)[:-1] == (f"Written with --out, and not erased: {unfinished}",)
    unfinished.rename(export)
    write_analysis(report, "P01")
    (export / "written_elsewhere.txt").write_text(f"{report}\n{export}\n")
    named = list_remaining_copies(data, plan)[:-1]
    assert named == tuple(f"Written with --out, and not erased: {path}" for path in (export, report))


def test_a_folder_that_cannot_be_looked_into_does_not_keep_a_withdrawal_from_going_on(data, tmp_path, monkeypatch):
    """Such as lost+found on a disk of its own, or an export that another account made."""
    closed, iterdir, lstat = data / "lost+found", Path.iterdir, Path.lstat

    def refuse(path):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    closed.mkdir()
    monkeypatch.setattr(Path, "iterdir", lambda path: refuse(path) if path == closed else iterdir(path))
    monkeypatch.setattr(Path, "lstat", lambda path: refuse(path) if path.parent == tmp_path / "out" else lstat(path))
    (data / "written_elsewhere.txt").write_text(f"{tmp_path / 'out' / 'a'}\n")
    erase(data)
    plan = plan_withdrawal(SessionFolder(data / "P01_001"))
    assert plan.doubtful == ("lost+found cannot be looked into: Permission denied.",)
    assert list_remaining_copies(data, plan)[0] == f"Written with --out, and not erased: {tmp_path / 'out' / 'a'}"


def test_a_session_that_was_begun_after_the_question_and_runs_stops_the_withdrawal(data):
    plan, before = plan_withdrawal(SessionFolder(data / "P01_001")), files(data / "P01_001")
    copy_session(data, "P01_003")
    log = EventLog.reopen(data / "P01_003" / "events.jsonl")
    with pytest.raises(StudyError, match="Another program is writing to P01_003") as told:
        withdraw(data, plan, UTC)
    assert told.value.saved == "Nothing was erased now, but no session of P01 counts as data any more."
    assert before.items() <= files(data / "P01_001").items()
    assert SessionFolder(data / "P01_001").withdrawn
    log.close()
    erase(data)
    assert not (data / "P01_003" / "events.jsonl").exists()


def test_tables_written_while_the_participant_withdrew_are_removed(data, monkeypatch):
    """The results of a sitting that had just ended stayed in the erased session."""
    folder, write_trials = SessionFolder(data / "P01_001"), session_results.write_trials

    def erase_first(*arguments):
        erase(data)
        write_trials(*arguments)

    monkeypatch.setattr(session_results, "write_trials", erase_first)
    with pytest.raises(SessionWithdrawnError, match="This session was withdrawn"):
        session_results.write_tables(folder)
    assert {path.name for path in folder.path.iterdir()} == {"session.lock", "withdrawn.json"}


def test_the_command_that_continues_a_withdrawal_holds_where_the_path_has_blanks(data, monkeypatch):
    data = data.rename(data.with_name("my data"))
    monkeypatch.setattr(
        "study.workflows.session.withdraw_participant.write_tombstone", lambda *_: (data / "none").stat()
    )
    with pytest.raises(StudyError, match="Not everything could be erased") as told:
        erase(data)
    monkeypatch.undo()
    continued = f"hapteq withdraw P01_001 --data '{data}'"
    assert told.value.do_now == f"Correct this and continue with: {continued}"
    assert continued in validate_file(data / "P01_001").problems[1]
    done = CliRunner().invoke(app, [*shlex.split(continued)[1:], "--yes"])
    assert done.exit_code == 0, done.output
    assert validate_file(data / "P01_001").problems == ()
