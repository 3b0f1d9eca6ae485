"""Run a bank of concealed laws, a blind test of the diagnosis: seal, diagnose in separate processes, reveal, score.

Each case is a simulated device with a law of motion or signals outside the catalogue of effects, or without one. The
labels, which state the true laws, are hashed before their cases are diagnosed, and checked when they are revealed. A
found law is compared with the true one on fresh test motions that were no input of the diagnosis (`compute_law_error`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from analysis.evaluation.laws.law_error import compute_law_error
from analysis.evaluation.laws.law_outcome import LawOutcome, TrueLaw
from analysis.evaluation.laws.law_score import LawScore, compute_law_score
from study.errors import convert_interrupts
from study.evaluation.bank.ask_engine import diagnose_and_count
from study.evaluation.bank.laws.seal_laws import (
    get_fresh_motions_path,
    read_fresh_motions,
    redraw_law_recording,
    seal_laws,
)
from study.evaluation.bank.proof_folder import ProofFolder, hold_proof_folder, open_proof_folder
from study.evaluation.bank.seal_cases import BankPlan, read_case_names, restore_recordings
from study.evaluation.bank.sealed_bank import (
    BankOptions,
    Progress,
    collect_answered_fields,
    list_engine_digests,
    reveal_bank,
)
from study.store.disk.provenance import compute_sha256

LAW_BANK_KIND = "laws"
"""Value of the kind of bank in bank.json for concealed laws."""


@dataclass(frozen=True, slots=True)
class LawBlindTest:
    """Result of a bank of concealed laws, with its score."""

    folder: ProofFolder
    plan: BankPlan
    seal: str
    """SHA-256 of labels.sha256, taken before the diagnoses of this run."""
    outcomes: tuple[LawOutcome, ...]
    """One per answered case."""
    score: LawScore
    engines: tuple[str, ...]
    """Digests of the code that gave the answers, sorted; several if it changed during the run."""


def prove_laws(path: Path, plan: BankPlan, options: BankOptions, on_progress: Progress) -> LawBlindTest:
    """Run a bank of laws in the folder `path`, or continue it after an interruption. Raises StudyError where the folder
    belongs to another bank or another process works on it, a sealed file has changed, or the run is interrupted.

    on_progress: called with the step ("sealing" or "diagnosing"), the number of finished cases, and of all cases.
    """
    folder = open_proof_folder(path, plan.seed, plan.brief, LAW_BANK_KIND)
    saved_text = f"All that is sealed and answered so far is in {path}."
    with convert_interrupts("The bank is not finished.", saved_text), hold_proof_folder(folder):
        seal = seal_laws(folder, plan, options.workers, lambda done: on_progress("sealing", done, plan.cases))
        case_names = read_case_names(folder, range(plan.cases))
        restore_recordings(
            folder,
            dict(zip(case_names, range(plan.cases), strict=True)),
            lambda case_folder, label: redraw_law_recording(case_folder, plan, label),
        )
        diagnose_and_count(
            folder, case_names, options.diagnosis_workers, partial(on_progress, "diagnosing"), keep=options.keep
        )
    outcomes = reveal_laws(folder, plan.cases)
    return LawBlindTest(
        folder, plan, seal, outcomes, compute_law_score(outcomes), list_engine_digests(folder, case_names)
    )


def reveal_laws(folder: ProofFolder, case_count: int) -> tuple[LawOutcome, ...]:
    """Reveal the answered cases among the numbers below `case_count`, and return their outcomes. Raises StudyError
    where a label or a fresh test motion differs from its seal, or an answer was given to other files."""

    def is_unchanged(label: Mapping[str, Any]) -> bool:
        """Whether the file of the fresh test motions has the hash that is stated in the label."""
        return compute_sha256(get_fresh_motions_path(folder, label["number"])) == str(label["fresh_sha256"])

    def make_outcome(label: Mapping[str, Any], answer: Mapping[str, Any]) -> LawOutcome:
        return _make_law_outcome(label, answer, get_fresh_motions_path(folder, label["number"]))

    return reveal_bank(folder, case_count, make_outcome, is_unchanged)


def _make_law_outcome(label: Mapping[str, Any], answer: Mapping[str, Any], fresh_path: Path) -> LawOutcome:
    """Make the outcome of one case: its true law (None where the case has none), the answer and, where there are both a
    true and a found law, the error of the found laws on each fresh test motion in the file `fresh_path`."""
    truth = None if label["truth"] is None else _read_true_law(label["truth"])
    outcome = LawOutcome(concealed=label["concealed"], truth=truth, **collect_answered_fields(label, answer))
    if truth is None or not outcome.laws:
        return outcome
    motions = read_fresh_motions(fresh_path, label["axes"], truth.axes, truth.acts_on == ("response",))
    return replace(outcome, errors=tuple(compute_law_error(outcome.laws, motion) for motion in motions))


def _read_true_law(truth: Mapping[str, Any]) -> TrueLaw:
    """Read the true law from the entry `truth` of a label."""
    return TrueLaw(
        truth["law"],
        truth["formula"],
        tuple(truth["axes"]),
        tuple(truth["acts_on"]),
        tuple(tuple(readings) for readings in truth["variables"]),
        truth["memory"],
        truth["numbers"],
    )
