"""Run a blind test of the diagnosis: a bank of simulated cases with concealed effects (`hapteq prove`).

Order: draw and seal the cases, diagnose them in separate processes without access to the truth, reveal and pair labels
with answers, follow up undecided cases, run the controls if they are requested, score. Begin at `prove`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from analysis.evaluation.blind_test.control_claims import ControlOutcome
from analysis.evaluation.blind_test.follow_up import FollowUp
from analysis.evaluation.blind_test.outcome import ConcealedEffect, Outcome
from analysis.evaluation.blind_test.score import Score, compute_score
from study.errors import convert_interrupts
from study.evaluation.bank.ask_engine import diagnose_and_count
from study.evaluation.bank.follow_up import FOLLOW_UP_FOLDER, follow_up, list_case_names
from study.evaluation.bank.proof_folder import ProofFolder, hold_proof_folder, open_proof_folder
from study.evaluation.bank.proof_seals import read_label
from study.evaluation.bank.run_controls import run_controls
from study.evaluation.bank.seal_cases import (
    BankPlan,
    list_drawable_cases,
    read_case_names,
    redraw_recording,
    restore_recordings,
    seal_cases,
)
from study.evaluation.bank.sealed_bank import (
    BankOptions,
    Progress,
    collect_answered_fields,
    list_engine_digests,
    reveal_bank,
)


def make_outcome(label: dict[str, Any], answer: dict[str, Any]) -> Outcome:
    """Make the outcome of a case. label: its revealed label (JSON document); answer: that of the diagnosis."""
    concealed = tuple(
        ConcealedEffect(truth["effect"], truth["place"], truth["axis"], {**truth["values"], **truth["unseen"]})
        for truth in label["truth"]
    )
    return Outcome(
        bank=label["bank"],
        model=label["concealed"],
        concealed=concealed,
        strengths=tuple(label["strengths"]),
        **collect_answered_fields(label, answer),
    )


CONTROLS_FOLDER = "controls"
"""Folder of the controls in that of the bank, with a folder for each seed."""
CONTROL_REPETITIONS = 3
"""Number of repetitions of all controls, with the seeds plan.seed, plan.seed + 1, … Chosen."""


@dataclass(frozen=True, slots=True)
class BlindTest:
    """Result of a bank of concealed cases, with its score, follow-ups and controls."""

    folder: ProofFolder
    plan: BankPlan
    seal: str
    """SHA-256 of labels.sha256, taken before any diagnosis."""
    outcomes: tuple[Outcome, ...]
    score: Score
    engines: tuple[str, ...]
    """Digests of the code that diagnosed the bank."""
    other_engines: tuple[str, ...]
    """Digests of the code that diagnosed follow-ups and controls."""
    controls: tuple[ControlOutcome, ...]
    follow_ups: tuple[FollowUp, ...]
    """Cases that were followed up by further experiments."""
    omitted_cases: int
    """Number of cases that were not drawn, because the second physics engine is not installed; else 0."""


def prove(path: Path, plan: BankPlan, options: BankOptions, on_progress: Progress) -> BlindTest:
    """Run the bank in the folder `path`, or continue it after an interruption. on_progress: called with the name of the
    step, the number done and the total. Raises StudyError where the folder belongs to another bank or another process
    works on it, a sealed file has changed, or the run is interrupted."""
    folder = open_proof_folder(path, plan.seed, plan.brief)
    drawable_count = len(list_drawable_cases(plan))
    saved_text = f"All that is sealed and answered so far is in {path}."
    with convert_interrupts("The bank is not finished.", saved_text), hold_proof_folder(folder):
        seal = seal_cases(folder, plan, options.workers, lambda done: on_progress("sealing", done, drawable_count))
        # Not those that can be drawn here: the bank may have been sealed on a machine with MuJoCo.
        case_numbers = [number for number in range(plan.cases) if folder.get_label_file(number).exists()]
        case_names = read_case_names(folder, case_numbers)
        restore_recordings(
            folder,
            dict(zip(case_names, case_numbers, strict=True)),
            lambda case_folder, label: redraw_recording(case_folder, plan, label),
        )
        diagnose_and_count(
            folder, case_names, options.diagnosis_workers, partial(on_progress, "diagnosing"), keep=options.keep
        )
        outcomes = reveal_bank(folder, plan.cases, make_outcome)
        follow_ups = follow_up(
            folder, plan, outcomes, (options.diagnosis_workers, options.keep), partial(on_progress, "following up")
        )
        control_seeds = range(plan.seed, plan.seed + CONTROL_REPETITIONS) if options.controls else ()
        controls = tuple(
            control
            for seed in control_seeds
            for control in run_controls(
                path / CONTROLS_FOLDER / str(seed), seed, options.diagnosis_workers, partial(on_progress, "controls")
            )
        )
    return BlindTest(
        folder, plan, seal, outcomes, compute_score(outcomes, follow_ups), list_engine_digests(folder, case_names),
        _collect_other_digests(path, follow_ups, control_seeds), controls, follow_ups, plan.cases - len(case_numbers),
    )  # fmt: skip


def _collect_other_digests(path: Path, follow_ups: Sequence[FollowUp], control_seeds: Sequence[int]) -> tuple[str, ...]:
    """Collect the digests of the code that answered these follow-ups and controls, sorted, each once."""
    follow_up_bank = ProofFolder(path / FOLLOW_UP_FOLDER)
    labels = (read_label(follow_up_bank.get_label_file(follow_up.number)) for follow_up in follow_ups)
    digests = set(list_engine_digests(follow_up_bank, list_case_names(labels)))
    for seed in control_seeds:
        folder = ProofFolder(path / CONTROLS_FOLDER / str(seed))
        digests.update(list_engine_digests(folder, [case_folder.name for case_folder in folder.open.glob("*")]))
    return tuple(sorted(digests))
