"""A bank of concealed laws from start to end: sealed, answered by processes that know nothing, revealed, scored."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from analysis.diagnosis.document import diagnosis_from_json
from analysis.evaluation.laws.law_error import law_error
from analysis.evaluation.laws.law_outcome import LawOutcome, TrueLaw
from analysis.evaluation.laws.law_score import LawScore, law_score
from study.errors import LeftError
from study.evaluation.bank.ask_engine import ask_engine, forget_recording, is_answered
from study.evaluation.bank.laws.seal_laws import fresh_file, fresh_motions, seal_laws
from study.evaluation.bank.proof_folder import ANSWER, RECORDING, ProofFolder, opened
from study.evaluation.bank.proof_seals import answer_at, broken_seal, is_of, label_at, seals_of
from study.evaluation.bank.prove import Progress, Wishes, engines
from study.evaluation.bank.seal_cases import BankPlan, sealed_names
from study.store.disk.provenance import sha256_of

LAWS = "laws"


@dataclass(frozen=True, slots=True)
class LawProof:
    folder: ProofFolder
    plan: BankPlan
    seal: str
    """SHA-256 of labels.sha256 before anything was diagnosed."""
    outcomes: tuple[LawOutcome, ...]
    score: LawScore
    engines: tuple[str, ...]


def prove_laws(path: Path, plan: BankPlan, wishes: Wishes, on_progress: Progress) -> LawProof:
    """Interrupted, the same call goes on. Raises StudyError."""
    folder = opened(path, plan.seed, plan.brief, LAWS)
    try:
        seal = seal_laws(folder, plan, wishes.workers, lambda done: on_progress("sealing", done, plan.cases))
        names = sealed_names(folder, range(plan.cases))
        _answered(folder, wishes, names, on_progress)
    except KeyboardInterrupt as interruption:
        raise LeftError(
            "Interrupted",
            "The bank is not finished.",
            "Run the same command again: it goes on where it stopped.",
            saved=f"All that is sealed and answered so far is in {path}.",
        ) from interruption
    outcomes = reveal_laws(folder, plan.cases)
    return LawProof(folder, plan, seal, outcomes, law_score(outcomes), engines(folder, names))


def _answered(folder: ProofFolder, wishes: Wishes, names: tuple[str, ...], on_progress: Progress) -> None:
    done = sum(is_answered(folder.open / name) for name in names)
    on_progress("diagnosing", done, len(names))

    def on_answered(name: str) -> None:
        nonlocal done
        done += 1
        if not wishes.keep:
            forget_recording(folder.open / name)
        on_progress("diagnosing", done, len(names))

    there = [name for name in names if is_answered(folder.open / name) or (folder.open / name / RECORDING).exists()]
    ask_engine(folder, there, wishes.workers, on_answered)


def reveal_laws(folder: ProofFolder, cases: int) -> tuple[LawOutcome, ...]:
    """Of the first so many numbers, all that are answered. Raises StudyError where a seal is broken."""
    seals, found, broken = seals_of(folder), [], []
    for path in sorted(folder.sealed.glob("*.json")):
        label = label_at(path)
        fresh = fresh_file(folder, label["number"])
        if seals.get(f"sealed/{path.name}") != sha256_of(path) or sha256_of(fresh) != label["fresh_sha256"]:
            broken.append(path.name)
            continue
        place = folder.open / label["name"]
        if label["number"] >= cases or not (place / ANSWER).exists():
            continue
        said = answer_at(place)
        if not is_of(label, said):
            broken.append(path.name)
        found.append(_outcome(label, said, fresh))
    if broken:
        raise broken_seal(broken, folder.path)
    return tuple(found)


def _outcome(label: Mapping[str, Any], said: Mapping[str, Any], fresh: Path) -> LawOutcome:
    truth = None if label["truth"] is None else _true_law(label["truth"])
    found = LawOutcome(
        number=label["number"],
        seed=label["seed"],
        kind=label["kind"],
        concealed=label["concealed"],
        axes=tuple(label["axes"]),
        truth=truth,
        adds=label["adds"],
        said=None if "failed" in said else diagnosis_from_json(said["diagnosis"]),
        channel_errors=said.get("channel_errors", {}),
        seconds=said.get("cpu_seconds", float("nan")),
    )
    if truth is None or not found.laws:
        return found
    motions = fresh_motions(fresh, label["axes"], truth.axes, truth.acts_on == ("response",))
    return replace(found, errors=tuple(law_error(found.laws, motion) for motion in motions))


def _true_law(label: Mapping[str, Any]) -> TrueLaw:
    return TrueLaw(
        label["law"],
        label["formula"],
        tuple(label["axes"]),
        tuple(label["acts_on"]),
        tuple(tuple(readings) for readings in label["variables"]),
        label["memory"],
        label["numbers"],
    )
