"""A bank of concealed physics from start to end: sealed, answered by processes that know nothing, revealed."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from analysis.proof.outcome import Outcome
from analysis.proof.score import Score, score
from study.errors import LeftError
from study.workflows.ask_engine import ask_engine
from study.workflows.proof_folder import ANSWER, RECORDING, ProofFolder, opened
from study.workflows.reveal_cases import engines, reveal_cases
from study.workflows.seal_cases import BankPlan, seal_cases, sealed_names, to_draw

Progress = Callable[[str, int, int], None]
"""What is being done; how many are done, of how many."""


@dataclass(frozen=True, slots=True)
class Proof:
    folder: ProofFolder
    plan: BankPlan
    seal: str
    """SHA-256 of labels.sha256 before anything was diagnosed."""
    outcomes: tuple[Outcome, ...]
    score: Score
    engines: tuple[str, ...]
    left_out: int
    """Cases of the second physics engine, where it is not installed."""


def prove(path: Path, plan: BankPlan, workers: int, on_progress: Progress, keep: bool = False) -> Proof:
    """Interrupted, the same call goes on. keep: recordings stay once they are answered. Raises StudyError."""
    folder = opened(path, plan.seed, plan.brief)
    numbers = [one.number for one in to_draw(plan)]
    try:
        seal = seal_cases(folder, plan, workers, lambda done: on_progress("sealing", done, len(numbers)))
        names = sealed_names(folder, numbers)
        answered = [name for name in names if (folder.open / name / ANSWER).exists()]
        done = len(answered)
        on_progress("diagnosing", done, len(names))

        def on_answered(name: str) -> None:
            nonlocal done
            done += 1
            if not keep:
                forget_recording(folder.open / name)
            on_progress("diagnosing", done, len(names))

        ask_engine(folder, names, workers, on_answered)
    except KeyboardInterrupt as interruption:
        raise LeftError(
            "Interrupted",
            "The bank is not finished.",
            "Run the same command again: it goes on where it stopped.",
            saved=f"All that is sealed and answered so far is in {path}.",
        ) from interruption
    outcomes = reveal_cases(folder, plan.cases)
    return Proof(folder, plan, seal, outcomes, score(outcomes), engines(folder, set(names)), plan.cases - len(numbers))


def forget_recording(place: Path) -> None:
    """Megabytes each; the label keeps their hash, and the seed gives them again."""
    with suppress(OSError):
        (place / RECORDING).unlink(missing_ok=True)
