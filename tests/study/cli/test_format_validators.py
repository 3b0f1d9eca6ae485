"""Exported datasets, as the validator of their format sees them. `make prove-formats` installs it."""

import json
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
pytestmark = pytest.mark.skipif(BIDS is None, reason="needs bids-validator-deno: pip install 'hapteq[validators]'")


@pytest.fixture(scope="module")
def exported(tmp_path_factory, small_text) -> Path:
    folder = tmp_path_factory.mktemp("bids")
    (folder / "small.toml").write_text(small_text)
    for number in (1, 2):
        assert main(["study", "--protocol", str(folder / "small.toml"), "--observer", "ideal", "--seed", str(number),
                     "--subject", f"P0{number}", "--data", str(folder / "data")]) == 0  # fmt: skip
    assert main(["export", str(folder / "data"), "--format", "bids", "--out", str(folder / "bids")]) == 0
    return folder / "bids"


def issues(folder: Path) -> list[tuple[str, str]]:
    """(severity, code)"""
    done = subprocess.run(
        [BIDS, str(folder), "--format", "json", "--max-rows", "-1"], capture_output=True, text=True, check=False
    )
    return [(each["severity"], each["code"]) for each in json.loads(done.stdout)["issues"]["issues"]]


def test_the_bids_validator_finds_no_error_and_misses_only_what_the_laboratory_knows(exported):
    assert {code for severity, code in issues(exported) if severity == "error"} == set()
    assert {code for severity, code in issues(exported) if severity == "warning"} <= WISHES


def test_the_bids_validator_finds_what_is_wrong(exported, tmp_path):
    spoiled = tmp_path / "bids"
    shutil.copytree(exported, spoiled)
    (spoiled / "dataset_description.json").write_text("{}")
    table = next(spoiled.glob("sub-*/ses-*/beh/*_beh.tsv"))
    table.rename(table.with_name("answers.tsv"))
    assert {code for severity, code in issues(spoiled) if severity == "error"} >= {"NOT_INCLUDED", "JSON_KEY_REQUIRED"}
