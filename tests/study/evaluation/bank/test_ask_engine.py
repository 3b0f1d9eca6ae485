"""Processes of a diagnosis that are killed: a case is tried as often as is said, and what has no answer is counted."""

import subprocess
import sys

import pytest

from study.errors import StudyError
from study.evaluation.bank import ask_engine
from study.evaluation.bank.ask_engine import MAX_ATTEMPTS, DiagnosisProcess, diagnose_cases
from study.evaluation.bank.proof_folder import RECORDING_FILE, ProofFolder
from study.store.disk.file_errors import CannotWriteError

DYING = "import os, sys, time; sys.stdin.readline(); os.close(1); time.sleep(60)"
"""Has closed its pipe, as a killed process does at once, and is not gone yet."""
ANSWERING = "import sys; [print(line, end='', flush=True) for line in sys.stdin]"


class Replaced(DiagnosisProcess):
    """Starts these programs, one after another, and the last again and again."""

    def __init__(self, folder, programs):
        super().__init__(folder)
        self.left, self.started = list(programs), []

    def _start_process(self):
        program = self.left.pop(0) if len(self.left) > 1 else self.left[0]
        self.started.append(
            subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        )
        return self.started[-1]


@pytest.fixture
def engine(tmp_path):
    made = []

    def make(*programs):
        made.append(Replaced(ProofFolder(tmp_path), programs))
        return made[-1]

    yield make
    for each in made:
        each.end()
        each.close()


@pytest.mark.timeout(60)
def test_a_process_that_dies_costs_a_single_try(engine):
    asked = engine(DYING, ANSWERING)
    assert [asked.request_answer("a"), asked.request_answer("a"), asked.request_answer("b")] == [False, True, True]
    assert len(asked.started) == 2 and asked.started[0].poll() is not None


@pytest.mark.timeout(60)
def test_a_case_that_kills_every_process_is_given_up(engine):
    asked = engine(DYING)
    assert not any(asked.request_answer("a") for _ in range(MAX_ATTEMPTS))
    assert len(asked.started) == MAX_ATTEMPTS


@pytest.mark.timeout(60)
def test_a_failure_that_cannot_be_written_is_told_with_its_cause(engine, tmp_path, monkeypatch):
    """It once ended its thread, with a traceback and an error that did not say that the disk is full."""

    def refuse(path, text, overwrite):
        raise CannotWriteError(path, OSError(28, "No space left on device"))

    monkeypatch.setattr(ask_engine, "DiagnosisProcess", lambda folder: engine(DYING))
    monkeypatch.setattr(ask_engine, "write_text", refuse)
    for name in "ab":
        (tmp_path / "open" / name).mkdir(parents=True)
        (tmp_path / "open" / name / RECORDING_FILE).touch()
    with pytest.raises(CannotWriteError, match="The disk is full"):
        diagnose_cases(ProofFolder(tmp_path), ["a", "b"], 2, lambda name: None)


def test_a_case_without_answer_and_recording_is_told_and_not_counted_as_failed(tmp_path):
    """As of a follow-up or a control whose answer was removed."""
    (tmp_path / "open" / "a").mkdir(parents=True)
    with pytest.raises(StudyError, match=r"no recording\.h5 of a\.") as told:
        diagnose_cases(ProofFolder(tmp_path), ["a"], 1, lambda name: None)
    assert told.value.do_now.startswith(f"Delete the folder {tmp_path}")
    assert not (tmp_path / "open" / "a" / "answer.json").exists()
