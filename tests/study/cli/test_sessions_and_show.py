"""`hapteq sessions` and `hapteq show`: the same as on the screens, for a script or a screen reader."""

import errno
import json
import os
import shutil
from datetime import datetime
from pathlib import Path

import pytest

from study.cli.main import main


@pytest.fixture
def run(capsys):
    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main([str(a) for a in arguments])
        said = capsys.readouterr()
        return int(code), said.out, said.err

    return call


@pytest.fixture
def taken(finished) -> Path:
    return finished


@pytest.mark.slow
def test_sessions_are_a_table_with_a_word_for_how_each_stands(run, taken):
    code, out, err = run("sessions", "--data", taken)
    assert (code, err) == (0, "")
    assert out.splitlines()[0].split()[:2] == ["session", "standing"]
    assert out.splitlines()[1].split()[:3] == ["P01_001", "✓", "finished"]
    assert out.splitlines()[1].endswith("small (ideal)")


@pytest.mark.slow
def test_remarks_say_why_a_session_cannot_be_used(run, taken, tmp_path):
    data = Path(shutil.copytree(taken, tmp_path / "data"))
    (data / "P02_001").mkdir()
    _, out, _ = run("sessions", "--data", data, "--remarks")
    assert "It has no log" in out


def test_sessions_as_json_have_a_place_and_a_standing(run, taken):
    code, out, _ = run("sessions", "--data", taken, "--json")
    (line,) = json.loads(out)
    assert code == 0
    assert (line["name"], line["standing"], line["path"]) == ("P01_001", "finished", str(taken / "P01_001"))


def test_no_sessions_are_no_error_and_it_is_said_what_to_do(run, tmp_path):
    code, out, err = run("sessions", "--data", tmp_path / "nothing")
    assert (code, out) == (0, "")
    assert "hapteq rehearse" in err
    assert run("sessions", "--data", tmp_path / "nothing", "--json")[1] == "[]\n"


@pytest.mark.parametrize("by_name", [True, False])
def test_a_session_is_shown_by_name_or_folder(run, taken, by_name):
    code, out, _ = run("show", "P01_001" if by_name else taken / "P01_001", "--data", taken)
    assert code == 0
    assert "P01_001 (simulated: ideal) finished all 3 runs" in out
    assert "25 Hz" in out
    assert "○ right" in out
    assert "▼" in out
    assert "Session P01_001 began" not in out


def test_the_log_comes_when_it_is_asked_for(run, taken):
    assert "Session P01_001 began" in run("show", taken / "P01_001", "--log")[1]


def test_a_session_as_json_has_its_staircases(run, taken):
    view = json.loads(run("show", taken / "P01_001", "--json")[1])
    assert len(view["staircases"]) == 3
    assert view["line"]["standing"] == "finished"


def test_a_damaged_session_is_shown_with_what_is_wrong(run, taken, tmp_path):
    data = Path(shutil.copytree(taken, tmp_path / "data"))
    (data / "P01_001" / "events.jsonl").write_text("nonsense\n")
    code, out, _ = run("show", "P01_001", "--data", data)
    assert code == 0
    assert "P01_001 cannot be read." in out


def test_a_withdrawn_session_is_shown_as_such(run, taken, tmp_path):
    data = Path(shutil.copytree(taken, tmp_path / "data"))
    run("withdraw", "P01_001", "--data", data, "--yes")
    code, out, _ = run("show", "P01_001", "--data", data)
    assert code == 0
    assert "withdrew" in out


@pytest.mark.parametrize("what", ["P09_001", "/nowhere/at/all"])
def test_what_is_not_there_is_wrong_use(run, taken, what):
    code, out, err = run("show", what, "--data", taken)
    assert (code, out) == (2, "")
    assert "There is no such session" in err


def test_a_folder_that_is_no_session_is_wrong_use(run, taken, tmp_path):
    assert run("show", tmp_path, "--data", taken)[0] == 2


def test_a_diagnosis_is_shown_in_words(run, tmp_path):
    errors = {"before": 0.1, "retuned": 0.1, "after": 0.1, "noise": 0.1}
    document = {
        "format": "hapteq-diagnosis", "version": 1, "verdict": "no_mismatch", "mismatch": [], "effects": [],
        "retuned": {}, "remainder": [], "fit": {"fit": errors, "test": errors}, "error": "free simulation",
        "next_experiment": None,
    }  # fmt: skip
    path = tmp_path / "diagnosis.json"
    path.write_text(json.dumps(document))
    code, out, _ = run("show", path)
    assert code == 0
    assert out.startswith("The model agrees with the device")
    assert "repeats allow" in out
    assert json.loads(run("show", path, "--json")[1])["verdict"].startswith("The model agrees with the device")
    assert run("show", tmp_path) == (0, out, "")


def test_a_file_that_is_no_diagnosis_is_an_error_with_words(run, tmp_path):
    (tmp_path / "x.json").write_text("{}")
    code, out, err = run("show", tmp_path / "x.json")
    assert (code, out) == (1, "")
    assert "x.json" in err


def test_a_person_reads_local_times_and_a_script_reads_utc(run, taken, tmp_path, summer_and_winter):
    data = Path(shutil.copytree(taken, tmp_path / "data"))
    begun = datetime.fromisoformat(json.loads(run("sessions", "--data", data, "--json")[1])[0]["begun_utc"])
    local = begun.astimezone()
    header, row = run("sessions", "--data", data)[1].splitlines()
    assert f"begun (+0{local.utcoffset().seconds // 3600}:00)" in header
    assert f"{local:%Y-%m-%d %H:%M}" in row
    said = run("show", "P01_001", "--data", data, "--log")[1]
    assert f"{local:%Y-%m-%d %H:%M:%S} +0" in said
    assert f"{local:%H:%M:%S}  Session P01_001 began" in said
    facts = dict(json.loads(run("show", "P01_001", "--data", data, "--json")[1])["facts"])
    assert facts["begun"] == f"{begun:%Y-%m-%d %H:%M:%S} +00:00"


def test_the_plan_says_who_is_done_and_who_comes_next(run, taken, tmp_path):
    code, out, _ = run("study-plan", taken, "--simulated")
    assert code == 0
    assert out.splitlines()[0].startswith("small: ")
    assert "No sample size is declared" in out
    (study,) = json.loads(run("study-plan", taken, "--simulated", "--json")[1])["studies"]
    assert f"next: {study['next']['code']}" in out
    code, _, err = run("study-plan", tmp_path / "nothing")
    assert code == 2 and "There is no study to plan" in err


@pytest.mark.usefixtures("validated_here")
def test_a_folder_that_cannot_be_read_is_named_and_not_called_empty(run, taken, tmp_path, monkeypatch):
    data = Path(shutil.copytree(taken, tmp_path / "data"))
    (name,) = (path.name for path in data.iterdir() if path.is_dir())
    iterdir, stat = Path.iterdir, Path.stat

    def refuse(path):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    with monkeypatch.context() as closed:
        closed.setattr(Path, "iterdir", lambda path: refuse(path) if path == data else iterdir(path))
        code, out, err = run("sessions", "--data", data)
        assert (code, out) == (1, "")
        assert f"You have no right to read {data}." in err
    closed_folder = (data / name).resolve()
    monkeypatch.setattr(
        Path, "stat", lambda path, **how: refuse(path) if path.parent == closed_folder else stat(path, **how)
    )
    assert f"{name} cannot be used. events.jsonl in {name}: Permission denied." in run("analyze", data)[2]
    assert f"unreadable: not valid\n  You have no right to read {data / name}." in run("validate", data / name)[1]
