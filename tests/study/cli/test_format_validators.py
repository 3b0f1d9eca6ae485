"""Exported datasets, as the validator of their format sees them. `make prove-formats` installs that of BIDS.

That of Psych-DS is on npm: `npm install psychds-validator`, then its command in the environment variable
PSYCHDS_VALIDATOR.
"""

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from study.cli.main import main

BIDS = shutil.which("bids-validator-deno", path=str(Path(sys.executable).parent)) or shutil.which("bids-validator-deno")
WISHES = {
    "TOO_FEW_AUTHORS", "NO_AUTHORS", "JSON_KEY_RECOMMENDED", "SIDECAR_KEY_RECOMMENDED", "README_FILE_SMALL",
}  # fmt: skip
"""Warnings of what only the laboratory can say: authors, licence, institution, and what else belongs into a README."""
PSYCH_DS = shlex.split(os.environ.get("PSYCHDS_VALIDATOR", ""))
needs_bids = pytest.mark.skipif(BIDS is None, reason="needs bids-validator-deno: pip install 'hapteq[validators]'")
needs_psych_ds = pytest.mark.skipif(not PSYCH_DS, reason="needs psychds-validator (npm) in PSYCHDS_VALIDATOR")
QUESTIONS = """
[text]
language = "de"

[[before]]
key = "age"
question = "How old are you?"
number = [18, 99]
unit = "years"

[[before]]
key = "handedness"
question = "Which hand do you write with?"
choices = ["right", "left", "either"]

[[debrief]]
key = "strategy"
question = "How did you tell the two directions apart?"
"""


@pytest.fixture(scope="module")
def data(tmp_path_factory, small_text) -> Path:
    folder = tmp_path_factory.mktemp("formats")
    (folder / "asked.toml").write_text(f"{small_text}{QUESTIONS}", encoding="utf-8")
    for number in (1, 2):
        assert main(["study", "--protocol", str(folder / "asked.toml"), "--observer", "ideal", "--seed", str(number),
                     "--subject", f"P0{number}", "--data", str(folder / "data")]) == 0  # fmt: skip
    return folder / "data"


@pytest.fixture(scope="module", params=["without free text", "with free text"])
def exported(request, data) -> Path:
    free = ["--free-text"] if request.param == "with free text" else []
    out = data.parent / f"bids {request.param}"
    assert main(["export", str(data), "--format", "bids", "--out", str(out), *free]) == 0
    return out


def issues(folder: Path) -> list[tuple[str, str]]:
    """(severity, code)"""
    done = subprocess.run(
        [BIDS, str(folder), "--format", "json", "--max-rows", "-1"], capture_output=True, text=True, check=False
    )
    return [(each["severity"], each["code"]) for each in json.loads(done.stdout)["issues"]["issues"]]


@needs_bids
def test_the_bids_validator_finds_no_error_and_misses_only_what_the_laboratory_knows(exported):
    assert {code for severity, code in issues(exported) if severity == "error"} == set()
    assert {code for severity, code in issues(exported) if severity == "warning"} <= WISHES


@needs_bids
def test_the_bids_validator_finds_what_is_wrong(exported, tmp_path):
    spoiled = tmp_path / "bids"
    shutil.copytree(exported, spoiled)
    (spoiled / "dataset_description.json").write_text("{}")
    table = next(spoiled.glob("sub-*/ses-*/beh/*_beh.tsv"))
    table.rename(table.with_name("answers.tsv"))
    assert {code for severity, code in issues(spoiled) if severity == "error"} >= {"NOT_INCLUDED", "JSON_KEY_REQUIRED"}


def psych_ds_issues(folder: Path) -> dict[str, str]:
    """Severity by code."""
    done = subprocess.run([*PSYCH_DS, str(folder), "--json"], capture_output=True, text=True, check=False)
    return {each["key"]: each["severity"] for each in json.loads(done.stdout)["issues"]}


@needs_psych_ds
def test_the_psych_ds_validator_finds_no_error_and_finds_what_is_wrong(data):
    out = data.parent / "psych-ds"
    assert main(["export", str(data), "--out", str(out), "--free-text"]) == 0
    assert "error" not in psych_ds_issues(out).values()
    path = out / "dataset_description.json"
    description = json.loads(path.read_text("utf-8"))
    description["variableMeasured"] = description["variableMeasured"][1:]
    path.write_text(json.dumps(description), encoding="utf-8")
    assert psych_ds_issues(out)["CSV_COLUMN_MISSING_FROM_METADATA"] == "error"
