"""A bank of concealed physics from start to end: sealed, answered by processes that know nothing, revealed."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.diagnosis.document import diagnosis_from_json
from analysis.evaluation.proof.controlled import Controlled
from analysis.evaluation.proof.follow_up import FollowUp
from analysis.evaluation.proof.outcome import Concealed, Outcome
from analysis.evaluation.proof.score import Score, score
from study.errors import LeftError
from study.evaluation.bank.ask_engine import ask_engine, forget_recording, is_answered
from study.evaluation.bank.follow_up import NEXT, follow_up
from study.evaluation.bank.proof_folder import ANSWER, RECORDING, ProofFolder, opened
from study.evaluation.bank.proof_seals import answer_at, broken_seal, is_of, label_at, seals_of
from study.evaluation.bank.run_controls import run_controls
from study.evaluation.bank.seal_cases import BankPlan, redrawn, seal_cases, sealed_names, to_draw
from study.store.disk.provenance import sha256_of


def reveal_cases(folder: ProofFolder, cases: int) -> tuple[Outcome, ...]:
    """Of the first so many numbers, all that are answered. Raises StudyError where a seal is broken."""
    seals = seals_of(folder)
    found, broken = [], []
    for path in sorted(folder.sealed.glob("*.json")):
        if seals.get(f"sealed/{path.name}") != sha256_of(path):
            broken.append(path.name)
            continue
        label = label_at(path)
        place = folder.open / label["name"]
        if label["number"] >= cases or not (place / ANSWER).exists():
            continue
        said = answer_at(place)
        if not is_of(label, said):
            broken.append(path.name)
        found.append(outcome_of(label, said))
    if broken:
        raise broken_seal(broken, folder.path)
    return tuple(found)


def outcome_of(label: dict[str, Any], said: dict[str, Any]) -> Outcome:
    concealed = tuple(
        Concealed(each["effect"], each["place"], each["axis"], {**each["values"], **each["unseen"]})
        for each in label["truth"]
    )
    return Outcome(
        number=label["number"],
        seed=label["seed"],
        kind=label["kind"],
        bank=label["bank"],
        axes=tuple(label["axes"]),
        model=label["concealed"],
        concealed=concealed,
        strengths=tuple(label["strengths"]),
        adds=label["adds"],
        said=None if "failed" in said else diagnosis_from_json(said["diagnosis"]),
        channel_errors=said.get("channel_errors", {}),
        seconds=said.get("cpu_seconds", float("nan")),
    )


def engines(folder: ProofFolder, names: Iterable[str]) -> tuple[str, ...]:
    """Digests of the code that gave the answers; more than one where it changed on the way."""
    answers = [answer_at(folder.open / name) for name in names if (folder.open / name / ANSWER).exists()]
    return tuple(sorted({answer["engine"] for answer in answers if "engine" in answer}))


CONTROL_TURNS = 3
"""Each with a seed of its own."""
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
    """Digests of the code that answered the bank,"""
    beside: tuple[str, ...]
    """and follow-ups and controls."""
    controls: tuple[Controlled, ...]
    followed: tuple[FollowUp, ...]
    left_out: int
    """Cases of the second physics engine, where it is not installed."""


@dataclass(frozen=True, slots=True)
class Wishes:
    workers: int = 2
    keep: bool = False
    """Recordings stay once they are answered."""
    controls: bool = False
    """What must change, or must not, is asked too."""


def prove(path: Path, plan: BankPlan, wishes: Wishes, on_progress: Progress) -> Proof:
    """Interrupted, the same call goes on. Raises StudyError."""
    folder = opened(path, plan.seed, plan.brief)
    numbers = [each.number for each in to_draw(plan)]
    try:
        seal = seal_cases(folder, plan, wishes.workers, lambda done: on_progress("sealing", done, len(numbers)))
        names = sealed_names(folder, numbers)
        _answered(folder, plan, wishes, dict(zip(names, numbers, strict=True)), on_progress)
        outcomes = reveal_cases(folder, plan.cases)
        followed = follow_up(
            folder,
            plan,
            outcomes,
            (wishes.workers, wishes.keep),
            lambda done, of: on_progress("following up", done, of),
        )
        controls = _controls(path, plan, wishes, on_progress)
    except KeyboardInterrupt as interruption:
        raise LeftError(
            "Interrupted",
            "The bank is not finished.",
            "Run the same command again: it goes on where it stopped.",
            saved=f"All that is sealed and answered so far is in {path}.",
        ) from interruption
    return Proof(
        folder, plan, seal, outcomes, score(outcomes, followed), engines(folder, names), _beside(path), controls,
        followed, plan.cases - len(numbers),
    )  # fmt: skip


def _beside(path: Path) -> tuple[str, ...]:
    folders = [ProofFolder(path / NEXT), *(ProofFolder(each) for each in sorted(path.glob("controls/*")))]
    found = {
        digest for folder in folders for digest in engines(folder, [place.name for place in folder.open.glob("*")])
    }
    return tuple(sorted(found))


def _answered(
    folder: ProofFolder, plan: BankPlan, wishes: Wishes, numbers: Mapping[str, int], on_progress: Progress
) -> None:
    """numbers: by the names of the cases."""
    for name, number in numbers.items():
        if not is_answered(folder.open / name) and not (folder.open / name / RECORDING).exists():
            redrawn(folder.open / name, plan, label_at(folder.label(number)))
    done = sum(is_answered(folder.open / name) for name in numbers)
    on_progress("diagnosing", done, len(numbers))

    def on_answered(name: str) -> None:
        nonlocal done
        done += 1
        if not wishes.keep:
            forget_recording(folder.open / name)
        on_progress("diagnosing", done, len(numbers))

    ask_engine(folder, tuple(numbers), wishes.workers, on_answered)


def _controls(path: Path, plan: BankPlan, wishes: Wishes, on_progress: Progress) -> tuple[Controlled, ...]:
    found: tuple[Controlled, ...] = ()
    for seed in range(plan.seed, plan.seed + CONTROL_TURNS) if wishes.controls else ():
        there = path / "controls" / str(seed)
        found += run_controls(there, seed, wishes.workers, lambda done, of: on_progress("controls", done, of))
    return found
