"""What a process that answers cannot open."""

import subprocess
import sys
from pathlib import Path

import pytest

from study.evaluation.bank.proof_folder import BANK_FILE, ProofFolder

ROOT = Path(__file__).parents[4]


@pytest.mark.parametrize("is_linked", [False, True])
def test_a_path_that_leads_out_of_another_bank_or_behind_a_link_reaches_no_label(tmp_path: Path, is_linked: bool):
    """The bank of a command that runs in another bank's folder was once taken for that one."""
    bank, other = ProofFolder(tmp_path / "first" / "bank"), ProofFolder(tmp_path / "second" / "bank")
    for folder in (bank, other):
        folder.open.mkdir(parents=True)
        (folder.path / BANK_FILE).write_text("{}")
    bank.sealed.mkdir()
    bank.get_label_file(0).write_text("the label")
    cases = Path("..", "..", "first", "bank", "open")
    if is_linked:
        (other.path / "linked").symlink_to(bank.path)
        cases = other.path / "linked" / "open"
    script = (
        "import os, sys\nfrom pathlib import Path\nfrom study.evaluation.bank import answer_cases\n"
        f"os.chdir({str(other.path)!r})\nsys.stdin = ['']\n"
        f"answer_cases.answer_case = lambda *_: print(Path({str(bank.get_label_file(0))!r}).read_text())\n"
        f"answer_cases.main([{str(cases)!r}])"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False)
    assert "PermissionError: a diagnosis must not open" in done.stderr
    assert "the label" not in done.stdout
