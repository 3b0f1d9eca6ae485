"""Steps that all sealed banks (effects and laws) share: check the seals, reveal the labels, pair them with answers.

A label is revealed only if its SHA-256 is the sealed hash, and an answer counts only if it was given to the sealed
files (`proof_seals`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from math import isnan
from typing import Any, TypeVar

from analysis.diagnosis.document import diagnosis_from_json
from analysis.evaluation.blind_test.outcome import AnsweredCase
from study.evaluation.bank.ask_engine import Workers
from study.evaluation.bank.proof_folder import ANSWER_FILE, ProofFolder
from study.evaluation.bank.proof_seals import (
    is_answer_to_sealed_case,
    make_broken_seal_error,
    read_answer,
    read_label,
    read_seals,
)
from study.store.disk.provenance import compute_sha256

Progress = Callable[[str, int, int], None]
"""on_progress(step, done, total): the name of the current step, the number of cases done in it, and their total."""
OutcomeT = TypeVar("OutcomeT")
"""Type of the outcome of a case."""


@dataclass(frozen=True, slots=True)
class BankOptions:
    """Options for running a bank."""

    workers: int = 2
    """Number of processes of this computer that draw and seal cases, and diagnose them if there is no executor."""
    keep: bool = False
    """Whether recordings are kept after their cases are answered."""
    controls: bool = False
    """Whether the controls (`run_controls`) are run as well."""
    executor: Executor | None = None
    """Executor on whose workers the cases are diagnosed; None: on this computer."""

    @property
    def diagnosis_workers(self) -> Workers:
        """The executor, or without one the number of processes of this computer."""
        return self.workers if self.executor is None else self.executor


def reveal_bank(
    folder: ProofFolder,
    case_count: int,
    make_outcome: Callable[[dict[str, Any], dict[str, Any]], OutcomeT],
    is_unchanged: Callable[[dict[str, Any]], bool] = lambda label: True,
) -> tuple[OutcomeT, ...]:
    """Check the labels in the folder, and return the outcomes of the answered cases with numbers below `case_count`,
    sorted by number. make_outcome: makes an outcome from a label and its answer. is_unchanged:
    whether further files whose hashes the label holds are unchanged. Raises StudyError where a label is
    missing, a label or such a file has changed, or an answer was given to other files."""
    seals = read_seals(folder)
    outcomes: list[OutcomeT] = []
    # A label that was removed after it was sealed must not be left out of the score.
    broken_names = [name for name in seals if not (folder.path / name).exists()]
    for path in folder.labels:
        if seals.get(f"sealed/{path.name}") != compute_sha256(path):
            broken_names.append(path.name)
            continue
        label = read_label(path)
        # A copy under another number must not be counted twice.
        if path != folder.get_label_file(label["number"]) or not is_unchanged(label):
            broken_names.append(path.name)
            continue
        case_folder = folder.open / label["name"]
        if label["number"] >= case_count or not (case_folder / ANSWER_FILE).exists():
            continue
        answer = read_answer(case_folder)
        if is_answer_to_sealed_case(label, answer):
            outcomes.append(make_outcome(label, answer))
        else:
            broken_names.append(path.name)
    if broken_names:
        raise make_broken_seal_error(broken_names, folder.path)
    return tuple(outcomes)


def collect_answered_fields(label: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, Any]:
    """Collect the fields of an `AnsweredCase` from a revealed label and the answer of the diagnosis."""
    return {
        **{key: label[key] for key in ("number", "seed", "kind", "adds")},
        "axes": tuple(label["axes"]),
        "diagnosis": None if "failed" in answer else diagnosis_from_json(answer["diagnosis"]),
        "channel_errors": answer.get("channel_errors", {}),
        "seconds": answer.get("cpu_seconds", float("nan")),
    }


def count_unanswered_cases(outcomes: Iterable[AnsweredCase]) -> int:
    """Count the cases whose process ended without an answer or was killed at every attempt: they have no duration
    (NaN), whereas a diagnosis that raised an error has one."""
    return sum(outcome.diagnosis is None and isnan(outcome.seconds) for outcome in outcomes)


def describe_unanswered_cases(outcomes: Iterable[AnsweredCase]) -> Iterator[str]:
    """Yield a sentence on the cases that `count_unanswered_cases` counts, if there are any."""
    if unanswered_count := count_unanswered_cases(outcomes):
        subject = "1 case has no answer" if unanswered_count == 1 else f"{unanswered_count} cases have no answer"
        yield (
            f"{subject}, because the processes were killed or took too long: counted as failed diagnoses. Run the same "
            "command again to repeat them."
        )


def list_engine_digests(folder: ProofFolder, case_names: Iterable[str]) -> tuple[str, ...]:
    """List the digests of the code that gave the answers to the cases `case_names`, sorted; several if the code changed
    during the run. Cases without an answer, or whose answer names no digest, are left out."""
    answers = [
        read_answer(folder.open / case_name)
        for case_name in case_names
        if (folder.open / case_name / ANSWER_FILE).exists()
    ]
    return tuple(sorted({answer["engine"] for answer in answers if "engine" in answer}))
