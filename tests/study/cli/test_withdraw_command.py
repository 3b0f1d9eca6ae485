"""Withdrawing from the command line: what is erased, and what is not."""

import errno
import io
import json
import os
import shutil
from pathlib import Path

import pytest

from study.cli.main import main
from study.errors import ExitCode
from study.store.disk.file_errors import CannotWriteError

pytestmark = pytest.mark.usefixtures("validated_here", "sketched")


@pytest.mark.slow
def test_withdrawal_erases_all_sessions_of_the_participant_and_no_others(run, data, small_file):
    for subject in ("P01", "P02"):
        who = ("--observer", "ideal", "--subject", subject)
        assert run("study", "--protocol", small_file, *who, "--data", data)[0] == 0
    other = {p: p.read_bytes() for p in (data / "P02_001").rglob("*") if p.is_file()}
    code, out, err = run("withdraw", "P01_002", "--data", data, "--yes")
    assert code == 0
    assert "Erased: P01_001, P01_002" in out
    assert "erase them" in err
    for name in ("P01_001", "P01_002"):
        left = {p.name for p in (data / name).iterdir()}
        assert left <= {"withdrawn.json", "session.lock"}
        document = json.loads((data / name / "withdrawn.json").read_text())
        assert set(document) == {"format", "version", "session", "withdrawn_utc", "begun"}
        assert set(document["begun"]) == {"protocol", "simulated", "number"}
        assert run("validate", data / name)[0] == 0
    assert {p: p.read_bytes() for p in (data / "P02_001").rglob("*") if p.is_file()} == other
    code, _, err = run("resume", "P01_001", "--data", data)
    assert code == 1
    assert "withdrew" in err
    code, _, err = run("analyze", data)
    assert "P01_001 was withdrawn by the participant." in err
    # No other participant gets the code.
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)
    assert code == 2
    assert "P01 withdrew" in err


def test_a_withdrawal_that_is_not_confirmed_erases_nothing(run, data, monkeypatch):
    monkeypatch.setattr("typer.confirm", lambda *_, **__: False)
    code, _, err = run("withdraw", "P01_001", "--data", data)
    assert code == 0
    assert "Nothing was erased." in err
    assert (data / "P01_001" / "events.jsonl").exists()


def test_a_question_without_an_answer_erases_nothing_and_says_so(run, data, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("P01\n"))
    code, _, err = run("withdraw", "P01_001", "--data", data)
    assert code == ExitCode.INTERRUPTED
    assert "Nothing was erased." in err and "--yes" in err
    assert (data / "P01_001" / "events.jsonl").exists()
    (data / "P01.withdrawal.json").write_text("{}")  # as an interrupted withdrawal leaves it
    _, _, err = run("withdraw", "P01_001", "--data", data)
    assert "Nothing was erased." not in err and "no session of P01 counts as data any more" in err


def test_withdrawal_leaves_what_others_put_beside_the_analysis(run, data):
    assert run("analyze", data)[0] == 0
    notes = data / "analysis" / "my_notes.R"
    notes.write_text("mine")
    code, _, err = run("withdraw", "P01_001", "--data", data, "--yes")
    assert code == 0
    assert "and the analysis in" in err.splitlines()[0]
    assert [p.name for p in (data / "analysis").iterdir()] == ["my_notes.R"]


def test_a_session_that_is_being_written_is_not_withdrawn(run, data):
    from study.store.sessions.event_log import EventLog

    log = EventLog.reopen(data / "P01_001" / "events.jsonl")
    code, _, err = run("withdraw", "P01_001", "--data", data, "--yes")
    log.close()
    assert code == 1
    assert "Another program is writing to P01_001" in err
    assert (data / "P01_001" / "trials.csv").exists()


def test_an_analysis_of_all_in_the_folder_of_another_session_is_named(run, data):
    """That participant's withdrawal alone would erase it."""
    shutil.copytree(data / "P01_001", data / "P02_001")
    log = data / "P02_001" / "events.jsonl"
    log.write_text(log.read_text().replace("P01", "P02"))
    assert run("analyze", data, "--out", data / "P02_001" / "all")[0] == 0
    code, _, err = run("withdraw", "P01_001", "--data", data, "--yes")
    assert code == 0
    assert f"Written with --out, and not erased: {data / 'P02_001' / 'all'}" in err


def test_an_analysis_of_linked_sessions_is_named_where_the_sessions_are(run, data):
    combined, export = data.parent / "combined", data.parent / "export"
    combined.mkdir()
    (combined / "P01_001").symlink_to(data / "P01_001")
    assert run("analyze", combined)[0] == run("export", combined, "--out", export)[0] == 0
    code, _, err = run("withdraw", "P01_001", "--data", data, "--yes")
    assert code == 0
    for path in (combined / "analysis", export):
        assert f"Written with --out, and not erased: {path}" in err


@pytest.mark.parametrize("where", ["data/analysis", "data/P01_001/analysis", "elsewhere"])
def test_an_analysis_that_was_under_way_during_a_withdrawal_leaves_nothing(run, data, where, monkeypatch):
    from study.workflows.results import analyze_data

    write_pictures, out = analyze_data.write_pictures, data.parent / where

    def withdraw_meanwhile(folder, pictures):
        assert main(["withdraw", "P01_001", "--data", str(data), "--yes"]) == 0
        folder.mkdir(parents=True, exist_ok=True)  # an analysis in the session's folder was erased with that
        return write_pictures(folder, pictures)

    monkeypatch.setattr(analyze_data, "write_pictures", withdraw_meanwhile)
    code, _, err = run("analyze", data if where != "data/P01_001/analysis" else data / "P01_001", "--out", out)
    assert (code, "P01_001 was withdrawn while its data were read." in err) == (1, True)
    assert not out.exists()
    assert run("validate", data / "P01_001")[0] == 0


@pytest.mark.parametrize("form", ["psych-ds", "bids", "mat", "csv"])
def test_an_export_that_was_under_way_during_a_withdrawal_leaves_nothing(run, data, form, monkeypatch):
    from study.workflows.results import export_study

    write, said = export_study.WRITERS[form], []

    def withdraw_meanwhile(folder, *content):
        files = write(folder, *content)
        assert main(["withdraw", "P01_001", "--data", str(data), "--yes"]) == 0
        said.append(folder)
        return files

    monkeypatch.setitem(export_study.WRITERS, form, withdraw_meanwhile)
    code, _, err = run("export", data, "--out", data.parent / "ds", "--format", form)
    assert (code, "P01_001 was withdrawn while its data were read." in err) == (1, True)
    assert f"Written with --out, and not erased: {said[0]}" in err  # it was there at that time
    assert not said[0].exists() and not (data.parent / "ds").exists()


@pytest.mark.parametrize("is_kept", [False, True])
def test_an_analysis_that_fails_during_a_withdrawal_leaves_nothing_or_names_it(run, data, monkeypatch, is_kept):
    """The withdrawal may erase the folder of figures, so that they cannot be written, after the tables were."""
    from study.workflows.results import analyze_data

    out, unlink = data / "analysis", Path.unlink

    def refuse(path, missing_ok=False):
        if path == out / "anova.json":
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        unlink(path, missing_ok)

    def fail(folder, pictures):
        assert main(["withdraw", "P01_001", "--data", str(data), "--yes"]) == 0
        out.mkdir(exist_ok=True)
        for name in ("anova.json", "thresholds.csv"):
            (out / name).write_text("P01")
        if is_kept:
            monkeypatch.setattr(Path, "unlink", refuse)
        raise CannotWriteError(folder, FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT)))

    monkeypatch.setattr(analyze_data, "write_pictures", fail)
    code, _, err = run("analyze", data)
    assert (code, "P01_001 was withdrawn while its data were read." in err) == (1, True)
    assert [path.name for path in out.glob("*.*")] == (["anova.json"] if is_kept else [])
    assert (f"Could not be removed, erase them: {out / 'anova.json'}." in err) == is_kept
    assert ("Nothing of this run was kept." in err) != is_kept
