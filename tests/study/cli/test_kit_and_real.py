"""`hapteq kit` and `hapteq real` on what is not what it should be: a sentence, an exit code, and nothing written.

Nothing is diagnosed here. An error without a name would leave `main` as it is, and fail the test.
"""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from analysis.diagnosis.document import Diagnosis, Errors, Fit
from study.cli.main import main
from study.store.formats.diagnosis_file import write_diagnosis
from tests.recording_maps import NOISE_ON_ONE_AXIS

ROOT = Path(__file__).resolve().parents[3]
LABELS = "recording,change,value,note,salt\nrec_01,added_mass,0.05,,a\nrec_02,nothing,,,b\n"
OTHERS = "mine\n"
HASH, OTHER_HASH = (hashlib.sha256(text.encode()).hexdigest() for text in (LABELS, OTHERS))
TORN = '{"format": "hapteq-'
FILES = {
    "a_file": OTHERS,
    "labels.csv": LABELS,
    "labels.csv.sha256": f"{HASH}  labels.csv\n",
    "unsealed.csv": LABELS,
    "resealed.csv": LABELS,
    "resealed.csv.sha256": f"{'0' * 64}  resealed.csv\n",
    "torn.csv": LABELS[:-4],
    "torn_diagnoses/rec_01/diagnosis.json": TORN,
    "recordings/axis/run.npz": "no archive",
    "recordings/axis/run.toml": NOISE_ON_ONE_AXIS,
    "answered/axis/run/answer.json": TORN,
}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    for name in ("empty", "diagnoses/rec_01"):
        (tmp_path / name).mkdir(parents=True)
    errors = Errors(0.1, 0.1, 0.1, 0.1)
    sound = Diagnosis("no_mismatch", (), (), {}, (), Fit(errors, errors), "free simulation", None)
    write_diagnosis(tmp_path / "diagnoses" / "rec_01" / "diagnosis.json", sound)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def everything_in(folder: Path) -> dict[str, bytes | None]:
    there = folder.rglob("*")
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in there}


REAL = {
    "nowhere --out out": (1, "nowhere is no folder of recordings"),
    "a_file --out out": (1, "a_file is no folder of recordings"),
    "empty --out out": (1, "There is no recording to diagnose"),
    "recordings --out a_file": (1, "a_file is there, and is no folder"),
    "recordings --out a_file/out": (1, "There is no folder a_file"),
    "recordings --out answered": (1, "axis/run/answer.json is not a usable hapteq-real-answer"),
    "recordings": (2, "--out"),
    "recordings --out out --seconds 0": (2, "--seconds"),
    "recordings --out out --seconds -180": (2, "--seconds"),
    "recordings --out out --seconds nan": (2, "--seconds"),
    "recordings --out out --seconds inf": (2, "--seconds is inf"),
    "recordings --out out --inject -1": (2, "--inject"),
    "recordings --out out --inject 10001": (2, "--inject"),
    "recordings --out out --seed -1": (2, "--seed"),
}
SCORE = "--diagnoses diagnoses --out score.csv"
KIT = {
    "draw --out a_file": (1, "a_file already exists"),
    "draw --out no/labels.csv": (1, "There is no folder no"),
    "draw --out new.csv --repeats 0": (2, "--repeats"),
    "draw --out new.csv --repeats 21": (2, "--repeats"),
    "draw --out new.csv --seed -1": (2, "--seed"),
    "seal nowhere.csv": (1, "There is no file nowhere.csv"),
    "seal empty": (1, "empty is a folder"),
    "seal a_file": (1, "a_file is not a usable table of labels"),
    "seal torn.csv": (1, "Line 3 has 3 fields, but the header names 5"),
    "seal resealed.csv": (1, f"resealed.csv.sha256 says {'0' * 64}"),
    f"score nowhere.csv {SCORE}": (1, "There is no file nowhere.csv"),
    f"score unsealed.csv {SCORE}": (1, "There is no seal in unsealed.csv.sha256"),
    f"score resealed.csv {SCORE}": (1, "The labels are not those that were sealed"),
    f"score labels.csv {SCORE} --seal {'0' * 64}": (1, f"--seal gives {'0' * 64}"),
    f"score labels.csv {SCORE} --seal {HASH[:-1]}": (2, "That is no SHA-256"),
    f"score a_file {SCORE} --seal {OTHER_HASH}": (1, "not a usable table of labels"),
    "score labels.csv --diagnoses nowhere --out score.csv": (1, "nowhere is no folder of diagnoses"),
    "score labels.csv --diagnoses a_file --out score.csv": (1, "a_file is no folder of diagnoses"),
    "score labels.csv --diagnoses empty --out score.csv": (1, "There is no diagnosis to score"),
    "score labels.csv --diagnoses torn_diagnoses --out score.csv": (1, "rec_01/diagnosis.json is not a usable"),
    "score labels.csv --diagnoses diagnoses --out a_file": (1, "a_file already exists"),
    "score labels.csv --diagnoses diagnoses --out no/score.csv": (1, "There is no folder no"),
    "score labels.csv --out score.csv": (2, "--diagnoses"),
}
CASES = {
    **{f"real {typed}": expected for typed, expected in REAL.items()},
    **{f"kit {typed}": expected for typed, expected in KIT.items()},
}


@pytest.mark.parametrize("typed", CASES)
def test_what_is_wrong_is_reported_and_nothing_is_written(
    place: Path, capsys: pytest.CaptureFixture[str], typed: str
) -> None:
    before, (code, sentence) = everything_in(place), CASES[typed]
    assert main(typed.split()) == code
    said = capsys.readouterr()
    assert sentence in " ".join(said.err.split())
    assert said.out == ""
    assert everything_in(place) == before


@pytest.mark.parametrize(
    "typed",
    [
        pytest.param("real recordings --out empty", marks=pytest.mark.slow),
        pytest.param("real recordings --out empty/out", marks=pytest.mark.slow),
        f"kit score labels.csv {SCORE}",
    ],
)
def test_a_place_that_may_not_be_written_to_is_reported(place: Path, typed: str) -> None:
    """The superuser, whom no mode of a folder stops, works without that right."""
    rights = "-dac_override,-dac_read_search"
    superuser = os.geteuid() == 0
    if superuser and not shutil.which("setpriv"):
        pytest.skip("the user who runs this may write anywhere, and there is no setpriv to give that up")
    given_up = ["setpriv", f"--inh-caps={rights}", f"--bounding-set={rights}"] if superuser else []
    closed = (place / "empty", place)
    for folder in closed:
        folder.chmod(0o555)
    try:
        done = subprocess.run(
            [*given_up, sys.executable, "-m", "study", *typed.split()],
            capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=120,
        )  # fmt: skip
    finally:
        for folder in closed:
            folder.chmod(0o755)
    assert done.returncode == 1
    assert "You have no right to write in" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert not any((place / "empty").iterdir())
