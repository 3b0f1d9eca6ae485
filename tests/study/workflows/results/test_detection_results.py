"""A session with practice, catch trials and a detection run: what of it is written, and that it is checked."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from protocols.document.loading import load_protocol
from study.errors import WrongUseError
from study.store.formats.thresholds_file import read_thresholds
from study.workflows.files.validate import validate_file
from study.workflows.results.analysis_files import is_analysis_of, list_analysis_outputs
from study.workflows.results.analyze_data import analyze_data
from study.workflows.results.write_results import write_results

BESIDE = """
[practice]
frequencies_hz = [35.0]

[catch]
one_in = 5

[detection]
frequencies_hz = [35.0]
interval_s = 0.4
gap_s = 0.2
"""


@pytest.fixture(scope="module")
def taken(tmp_path_factory, sitter_of, small_text, sketching):
    """One finished session and its results; copied by tests that change it."""
    text = small_text + BESIDE
    sitter = sitter_of(tmp_path_factory.mktemp("beside") / "data", load_protocol(text, "beside.toml"), text)
    sitter.observer = "ideal"
    done = sitter.whole()
    with sketching():
        return done.folder.path, write_results(done.folder)


@pytest.fixture
def session(taken, tmp_path):
    return shutil.copytree(taken[0], tmp_path / "P01_001")


@pytest.mark.slow
def test_detection_has_a_table_of_its_own(session):
    (row,) = read_thresholds(session / "detection.csv")
    assert (row.frequency_hz, row.complete) == (35.0, True)
    assert row.threshold_n < 0.5
    assert sorted(r.frequency_hz for r in read_thresholds(session / "thresholds.csv")) == [25.0, 35.0]
    assert (session / "analysis" / "detection.csv").read_bytes() == (session / "detection.csv").read_bytes()


def test_the_summary_tells_practice_from_training(session):
    runs = json.loads((session / "session.json").read_text("utf-8"))["runs"]
    assert [(run["phase"], run["practice"]) for run in runs][:3] == [
        ("training", False),
        ("training", True),
        ("test", False),
    ]


def test_the_lines_of_results_say_from_where_it_is_felt(taken):
    _, written = taken
    assert any("felt from" in line for line in written.table)


def test_the_report_of_the_session_has_its_sections(session):
    html = (session / "analysis" / "report.html").read_text("utf-8")
    for heading in ("Is the vibration felt at all?", "Catch trials", "Practice"):
        assert f">{heading}</h2>" in html


def test_such_a_session_and_its_tables_are_valid(session):
    assert validate_file(session).problems == ()
    assert validate_file(session / "detection.csv").kind == "table of 1 detection threshold"


def test_a_changed_detection_table_is_found(session):
    table = session / "detection.csv"
    table.write_text(table.read_text("utf-8").replace("P01,35.0,0.", "P01,35.0,1."), "utf-8")
    (problem,) = validate_file(session).problems
    assert problem.startswith("detection.csv does not agree with the log")


@pytest.mark.slow
def test_a_detection_table_of_an_earlier_analysis_does_not_stay(sitter, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "detection.csv").write_text("of a participant who withdrew since")
    analyze_data(sitter.whole().folder.path, out)
    assert not (out / "detection.csv").exists()


def test_the_report_of_an_earlier_analysis_goes_first(session, monkeypatch):
    """Without its report, an analysis that broke off is not taken for a whole one."""
    out, own = session / "analysis", Path.unlink

    def unlink(path, missing_ok=False):
        if path.name != "report.html":
            raise KeyboardInterrupt
        own(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", unlink)
    with pytest.raises(KeyboardInterrupt):
        analyze_data(session, out)
    assert not is_analysis_of(out, session / "events.jsonl")


def test_a_withdrawal_takes_the_detection_table_of_an_analysis_too(session):
    assert session / "analysis" / "detection.csv" in list_analysis_outputs(session / "analysis")


def test_an_error_of_the_program_is_not_called_one_of_the_data(session, tmp_path, monkeypatch):
    """NumPy's LinAlgError is a ValueError, too."""

    def break_down(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("study.workflows.results.analyze_data.analyse_study", break_down)
    with pytest.raises(np.linalg.LinAlgError):
        analyze_data(session, tmp_path / "out")


def test_an_analysis_is_not_written_over_the_tables_of_a_session(session):
    """Those of a whole study replaced thresholds.csv of the session, or removed its detection.csv."""
    tables = {path.name: path.read_bytes() for path in session.glob("*.csv")}
    with pytest.raises(WrongUseError, match="is the folder of a session"):
        analyze_data(session, session)
    assert {path.name: path.read_bytes() for path in session.glob("*.csv")} == tables
    assert not (session / "anova.json").exists()
