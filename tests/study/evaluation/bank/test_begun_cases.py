"""A sealing that is killed leaves no case under `open` without a label, and no label without its case."""

import signal
import subprocess
import sys

import pytest

from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, publish_case
from study.evaluation.bank.proof_folder import RECORDING_FILE, open_proof_folder
from study.evaluation.bank.proof_seals import read_label
from study.evaluation.bank.seal_cases import BankPlan, seal_cases

PLAN = BankPlan(51_401, 1, brief=True)
KILLED = """
import os, signal, sys
from pathlib import Path
from study.evaluation.bank import seal_cases as sealing
from study.evaluation.bank.proof_folder import ProofFolder

write_text = sealing.write_text
def die(path, text):
    if path.name == sealing.SETTINGS_FILE or sys.argv[2] == "after":
        write_text(path, text)
    if path.name != sealing.SETTINGS_FILE:
        os.kill(os.getpid(), signal.SIGKILL)
sealing.write_text = die
(drawn,) = sealing.list_drawable_cases(sealing.BankPlan(51_401, 1, brief=True))
sealing.write_sealed_case(ProofFolder(Path(sys.argv[1])), drawn)
"""
"""Before or after the label is written."""


@pytest.fixture
def bank(tmp_path):
    return open_proof_folder(tmp_path / "bank", PLAN.seed, PLAN.brief)


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.parametrize("when", ["before", "after"])
def test_a_killed_sealing_goes_on_with_every_case_labelled(bank, when):
    killed = subprocess.run([sys.executable, "-c", KILLED, bank.path, when], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert not list(bank.open.iterdir())
    kept = {path: path.read_bytes() for path in bank.sealed.iterdir()}
    assert len(kept) == (when == "after")
    seal_cases(bank, PLAN, 1, lambda done: None)
    (place,) = bank.open.iterdir()
    assert place.name == read_label(bank.get_label_file(0))["name"]
    assert (place / RECORDING_FILE).exists()
    assert not bank.unfinished.exists()
    assert {path: path.read_bytes() for path in kept} == kept


def test_a_label_of_two_cases_finishes_both(bank):
    """Of follow-ups, whose label names the case of each kind."""
    shown, hidden, begun = (begin_case(bank) for _ in range(3))
    bank.get_label_file(0).write_text(
        f'{{"proposed": {{"name": "{shown.name}"}}, "drawn": {{"name": "{hidden.name}"}}}}'
    )
    publish_case(bank, shown)
    with finish_begun_cases(bank):
        new = begin_case(bank)
        publish_case(bank, new)
    assert {place.name for place in bank.open.iterdir()} == {shown.name, hidden.name, new.name}
    assert not begun.exists()
    assert not bank.unfinished.exists()
