"""Analysing from the command line: what is written, what is left out, and what of it goes when a participant does."""

import json
import re
import shutil
from pathlib import Path

import pytest

from study.workflows.results.collect_sessions import collect_sessions

pytestmark = pytest.mark.usefixtures("validated_here")


@pytest.mark.slow
def test_analyze_writes_everything_that_the_contract_names(run, data, tmp_path):
    code, out, _ = run("analyze", data, "--out", tmp_path / "out")
    assert code == 0
    assert "25 Hz" in out
    for name in ("thresholds.csv", "anova.json", "report.html", "figures/thresholds.png", "figures/thresholds.svg"):
        assert (tmp_path / "out" / name).stat().st_size > 0, name
    code, out, _ = run("validate", tmp_path / "out" / "thresholds.csv", tmp_path / "out" / "anova.json")
    assert code == 0, out
    document = json.loads((tmp_path / "out" / "anova.json").read_text())
    assert document["provenance"]["seeds"] == {"P01_001": 3}
    assert document["provenance"]["parents"][0]["file"] == "events.jsonl"


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_a_program_can_read_the_results(run, data):
    code, out, _ = run("analyze", data, "--json")
    assert code == 0
    document = json.loads(out)
    assert {row["frequency_hz"] for row in document["thresholds"]} == {25.0, 35.0}
    assert all(row["threshold_n"] > 0 for row in document["thresholds"])
    assert Path(document["report"]).exists()


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_analyze_again_replaces_its_own_results(run, data):
    assert run("analyze", data)[0] == 0
    assert run("analyze", data)[0] == 0


@pytest.mark.usefixtures("sketched")
def test_a_damaged_session_is_left_out_and_named(run, data):
    broken = Path(shutil.copytree(data / "P01_001", data / "P02_001"))
    (broken / "events.jsonl").write_text("not a log\n")
    code, out, err = run("analyze", data)
    assert code == 0
    assert "P02_001 cannot be used. Line 1 of events.jsonl" in err
    assert "25 Hz" in out


@pytest.mark.usefixtures("sketched")
def test_a_changed_protocol_that_kept_its_name_is_chosen_by_its_hash(run, data, small_text, tmp_path):
    changed = tmp_path / "small.toml"
    changed.write_text(re.sub(r'(?m)^title = ".*"$', 'title = "Changed"', small_text))
    assert run("study", "--protocol", changed, "--observer", "ideal", "--subject", "P02", "--data", data)[0] == 0
    (sentence,) = collect_sessions(data).exclusions
    (digits,) = re.findall(r"P02_001 follows another protocol, \w+ \(([0-9a-f]+)\)\.", sentence)
    assert [folder.name for folder in collect_sessions(data, digits).sessions] == ["P02_001"]


@pytest.mark.slow
def test_ellipsoids_enter_the_report(run, data, tmp_path):
    assert run("record", "ellipsoid", "--out", tmp_path / "e.h5")[0] == 0
    assert run("analyze", data, "--out", tmp_path / "out", "--ellipsoid", tmp_path / "e.h5")[0] == 0
    assert (tmp_path / "out" / "figures" / "ellipsoids.png").exists()
    other = data / "P01_001" / "recordings" / "run-00_trial-000_attempt-0.h5"
    code, _, err = run("analyze", data, "--ellipsoid", other)
    assert code == 1
    assert "hapteq record ellipsoid" in err


@pytest.mark.slow
def test_figures_of_a_participant_who_withdrew_do_not_stay(run, data, small_file, tmp_path):
    assert run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P02", "--data", data)[0] == 0
    out = tmp_path / "elsewhere"
    assert run("analyze", data, "--out", out)[0] == 0
    assert run("analyze", data)[0] == 0
    assert run("withdraw", "P02_001", "--data", data, "--yes")[0] == 0
    assert not (data / "analysis").exists()
    assert run("analyze", data, "--out", out)[0] == 0
    traces = [p for p in out.rglob("*") if p.is_file() and (b"P02_001" in p.read_bytes()) and p.suffix != ".html"]
    assert traces == []
    assert not list((out / "figures").glob("*P02*"))


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_a_copied_session_is_left_out_and_the_rest_is_analysed(run, data):
    shutil.copytree(data / "P01_001", data / "P02_001")
    code, out, err = run("analyze", data)
    assert code == 0
    assert "P02_001 holds the log of P01_001: the folder was copied or renamed." in err
    assert "25 Hz" in out
