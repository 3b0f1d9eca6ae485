"""Files that earlier versions wrote, kept as they were: every later version reads them (docs/compatibility.md).

One folder per version that changed a format. Nothing in such a folder is ever edited or made again.
"""

import csv
import io
import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from study.cli.main import app
from study.workflows.files.validate import validate_file

pytestmark = pytest.mark.usefixtures("sketched")

FROZEN = Path(__file__).parent
VERSIONS = sorted(folder for folder in FROZEN.iterdir() if folder.name.startswith("v"))
SESSIONS = ("P01_001", "P03_001", "P04_001")
FILES = sorted(
    path
    for version in VERSIONS
    for path in version.rglob("*")
    if path.is_file() and "study" not in path.relative_to(version).parts and path.name != "lever.csv"
)


@pytest.fixture(params=VERSIONS, ids=lambda path: path.name)
def study(request, tmp_path) -> Path:
    """A copy of that version's data folder: a finished, a withdrawn and an interrupted session, and a lock."""
    shutil.copytree(request.param / "study", tmp_path / "data")
    return tmp_path / "data"


def run(*words: str | Path):
    return CliRunner().invoke(app, [str(word) for word in words])


def rows(table: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(table.read_text())))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(FROZEN)))
def test_a_file_of_an_earlier_version_is_sound(path):
    assert validate_file(path).problems == ()


@pytest.mark.parametrize("name", SESSIONS)
def test_a_session_of_an_earlier_version_is_sound(study, name):
    assert validate_file(study / name).problems == ()


def test_its_trials_and_thresholds_come_out_as_they_did_then(study, tmp_path):
    then = rows(study / "P01_001" / "thresholds.csv")
    shutil.rmtree(study / "P04_001")
    assert run("analyze", study, "--out", tmp_path / "out").exit_code == 0
    assert run("show", study / "P01_001").exit_code == 0
    (now,), (old,) = rows(tmp_path / "out" / "thresholds.csv"), then
    assert {key: now[key] for key in old if key in now} == {key: old[key] for key in old if key in now}
    assert now["threshold_n"] == old["threshold_n"]


def test_its_interrupted_session_continues_to_the_end(study):
    """It stopped between an answer and its measurement."""
    before = (study / "P04_001" / "events.jsonl").read_bytes()
    done = run("resume", "P04_001", "--data", study, "--json")
    assert done.exit_code == 0, done.output
    assert (study / "P04_001" / "events.jsonl").read_bytes().startswith(before)
    assert json.loads((study / "P04_001" / "session.json").read_text())["closed"]
    assert validate_file(study / "P04_001").problems == ()


def test_its_lock_still_fits_its_protocol(study):
    version = next(folder for folder in VERSIONS if (folder / "corpus_study.toml").exists())
    done = run(
        "study", "--protocol", version / "corpus_study.toml", "--observer", "ideal", "--subject", "P09",
        "--data", study, "--seed", "3", "--json",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    opening = json.loads((study / "P09_001" / "events.jsonl").read_text().splitlines()[0])
    assert opening["protocol_locked"] is True


def test_its_map_and_models_still_work(study, tmp_path):
    for version in VERSIONS:
        done = run("import", version / "lever.csv", "--map", version / "lever_map.toml", "--out", tmp_path / "l.h5")
        assert done.exit_code == 0, done.output
        forces = ("equalize", version / "model.h5", version / "wanted.csv", "--out", tmp_path / "forces.csv")
        done = run(*forces)
        assert done.exit_code == 0, done.output
