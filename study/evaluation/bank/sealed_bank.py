"""Steps that all sealed banks share: answer the open cases, check the seals, reveal the labels."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, TypeVar

from study.evaluation.bank.ask_engine import Workers, ask_engine, forget_recording, is_answered
from study.evaluation.bank.proof_folder import ANSWER, ProofFolder
from study.evaluation.bank.proof_seals import (
    answers_sealed_case,
    broken_seal_error,
    read_answer,
    read_label,
    read_seals,
)
from study.store.disk.provenance import sha256_of

Progress = Callable[[str, int, int], None]
"""Called with the current step, the number done, the total."""
Found = TypeVar("Found")


@dataclass(frozen=True, slots=True)
class BankOptions:
    """How a bank is run."""

    workers: int = 2
    """Processes of this computer that draw and seal, and diagnose where there is no executor."""
    keep: bool = False
    """Keep recordings after they are answered."""
    controls: bool = False
    """Also run the controls."""
    executor: Executor | None = None
    """Diagnoses on its workers."""

    @property
    def answering(self) -> Workers:
        """Who diagnoses: the executor, or that many processes of this computer."""
        return self.workers if self.executor is None else self.executor


def answer_bank(
    folder: ProofFolder, names: Iterable[str], asked: Sequence[str], options: BankOptions, on_progress: Progress
) -> None:
    """Diagnose the cases in `asked` that have no answer. names: all cases, for the progress."""
    every = tuple(names)
    done = sum(is_answered(folder.open / name) for name in every)
    on_progress("diagnosing", done, len(every))

    def on_answered(name: str) -> None:
        nonlocal done
        done += 1
        if not options.keep:
            forget_recording(folder.open / name)
        on_progress("diagnosing", done, len(every))

    ask_engine(folder, asked, options.answering, on_answered)


def reveal_bank(
    folder: ProofFolder,
    cases: int,
    outcome_of: Callable[[dict[str, Any], dict[str, Any]], Found],
    is_whole: Callable[[dict[str, Any]], bool] = lambda label: True,
) -> tuple[Found, ...]:
    """Outcomes of the answered cases among the first `cases` numbers. outcome_of: makes an outcome from a label and
    its answer. is_whole: whether further files under the label's seal are unchanged. Raises StudyError where a seal
    is broken."""
    seals = read_seals(folder)
    found: list[Found] = []
    broken: list[str] = []
    for path in sorted(folder.sealed.glob("*.json")):
        if seals.get(f"sealed/{path.name}") != sha256_of(path):
            broken.append(path.name)
            continue
        label = read_label(path)
        if not is_whole(label):
            broken.append(path.name)
            continue
        place = folder.open / label["name"]
        if label["number"] >= cases or not (place / ANSWER).exists():
            continue
        answer = read_answer(place)
        if not answers_sealed_case(label, answer):
            broken.append(path.name)
        found.append(outcome_of(label, answer))
    if broken:
        raise broken_seal_error(broken, folder.path)
    return tuple(found)


def engines(folder: ProofFolder, names: Iterable[str]) -> tuple[str, ...]:
    """Digests of the code that gave the answers; more than one if the code changed during the run."""
    answers = [read_answer(folder.open / name) for name in names if (folder.open / name / ANSWER).exists()]
    return tuple(sorted({answer["engine"] for answer in answers if "engine" in answer}))
