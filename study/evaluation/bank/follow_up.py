"""Follow-up experiments for cases whose diagnosis returned several effects that the data could not separate.

The sealed device plays the experiments that the diagnosis proposed and, for comparison, as many drawn at random from
the same menu. Separate processes diagnose both, with the first recording. The number of effects that the diagnosis
still returns shows whether its proposals are better than chance.
"""

import json
import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analysis.diagnosis.document import diagnosis_from_json
from analysis.diagnosis.next_experiment.experiment_menu import Experiment, list_experiments
from analysis.evaluation.blind_test.follow_up import FollowUp
from analysis.evaluation.blind_test.outcome import Outcome
from study.evaluation.bank.answer_cases import hash_other_recordings
from study.evaluation.bank.ask_engine import Workers, diagnose_and_count
from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, publish_case
from study.evaluation.bank.proof_folder import (
    FURTHER_RECORDING_FILE,
    MODEL_FILE,
    RECORDING_FILE,
    SETTINGS_FILE,
    ProofFolder,
    open_proof_folder,
)
from study.evaluation.bank.proof_seals import (
    is_answer_to_sealed_case,
    make_broken_seal_error,
    read_answer,
    read_label,
    seal,
)
from study.evaluation.bank.seal_cases import SALT_BYTES, BankPlan, redraw_recording
from study.evaluation.challenge.drive_plan import RATE_HZ
from study.store.disk.provenance import compute_sha256
from study.store.disk.text_file import read_text, write_text
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import write_recording

FOLLOW_UP_FOLDER = "next"
"""Folder of the follow-up cases: a bank of its own, whose labels name the case they follow."""
PROPOSED_KEY, RANDOM_KEY = "proposed", "drawn"
"""Keys of the two follow-up cases in a label."""
NOISE_SEED = 7
"""Part of the seeds of a follow-up's noise and random order: makes them independent of all other draws of a case."""


def follow_up(
    folder: ProofFolder,
    plan: BankPlan,
    outcomes: Sequence[Outcome],
    options: tuple[Workers, bool],
    on_done: Callable[[int, int], None],
) -> tuple[FollowUp, ...]:
    """Follow up the cases with a single concealed effect for which the diagnosis returned more effects than it named,
    and named any. options: the workers, and whether to keep recordings after they are answered. After an
    interruption the same call continues. Raises StudyError."""
    workers, keep = options
    undecided = [
        outcome for outcome in outcomes if outcome.kind == "single" and len(outcome.returned) > len(outcome.named) > 0
    ]
    if not undecided:
        return ()
    next_bank = open_proof_folder(folder.path / FOLLOW_UP_FOLDER, plan.seed, plan.brief)
    with finish_begun_cases(next_bank):
        for start in undecided:
            if not next_bank.get_label_file(start.number).exists():
                _seal(folder, next_bank, plan, start)
    seal(next_bank)
    labels = [read_label(next_bank.get_label_file(undecided_case.number)) for undecided_case in undecided]
    names = [label[key]["name"] for label in labels for key in (PROPOSED_KEY, RANDOM_KEY) if key in label]
    diagnose_and_count(next_bank, names, workers, on_done, keep=keep)
    return tuple(
        _follow_up_outcome(next_bank, undecided_case, label)
        for undecided_case, label in zip(undecided, labels, strict=True)
    )


def _seal(folder: ProofFolder, next_bank: ProofFolder, plan: BankPlan, start: Outcome) -> None:
    """Write both follow-up cases of `start` and their label, which is written last, when both are complete."""
    first_label = read_label(folder.get_label_file(start.number))
    first_folder = folder.open / first_label["name"]
    proposal = read_answer(first_folder).get("proposal")
    label: dict[str, Any] = {"number": start.number, "salt": secrets.token_hex(SALT_BYTES)}
    if proposal is not None:
        model = read_mechanical_model(first_folder / MODEL_FILE)
        menu = list_experiments(model, RATE_HZ, proposal["axis"], proposal["level"])
        best = proposal["best"]
        proposed_words = [best] if isinstance(best, str) else best or ()  # a single text in answers of older versions
        proposed = [experiment for experiment in menu if experiment.words in proposed_words]
        order = np.random.default_rng([plan.seed, start.number, NOISE_SEED]).permutation(len(menu))
        random_experiments = [menu[number] for number in order[: max(len(proposed), 1)]]
        experiments_by_key = {RANDOM_KEY: random_experiments} | ({PROPOSED_KEY: proposed} if proposed else {})
        label |= {
            key: _write_case(next_bank, plan, (first_label, first_folder), experiments)
            for key, experiments in experiments_by_key.items()
        }
    write_text(next_bank.get_label_file(start.number), json.dumps(label, indent=1) + "\n")
    for key in {PROPOSED_KEY, RANDOM_KEY} & label.keys():
        publish_case(next_bank, next_bank.unfinished / label[key]["name"])


def _write_case(
    next_bank: ProofFolder, plan: BankPlan, start: tuple[dict[str, Any], Path], experiments: Sequence[Experiment]
) -> dict[str, Any]:
    """Write a follow-up case and return its part of the label. `redraw_recording` draws the first recording again and
    checks it against its label."""
    label, first_folder = start
    case_folder = begin_case(next_bank)
    case = redraw_recording(case_folder, plan, label)
    for number, experiment in enumerate(experiments):
        recording = case.record_again(experiment.commands, experiment.kind, experiment.added, NOISE_SEED + number)
        write_recording(case_folder / FURTHER_RECORDING_FILE.format(number + 2), recording, precision="float32")
    for file_name in (MODEL_FILE, SETTINGS_FILE):
        write_text(case_folder / file_name, read_text(first_folder / file_name))
    return {
        "name": case_folder.name,
        "words": "; ".join(experiment.words for experiment in experiments),
        "recording_sha256": compute_sha256(case_folder / RECORDING_FILE),
        "model_sha256": compute_sha256(case_folder / MODEL_FILE),
        "others_sha256": hash_other_recordings(case_folder),
    }


def _follow_up_outcome(next_bank: ProofFolder, start: Outcome, label: dict[str, Any]) -> FollowUp:
    """The effects returned after the proposed and after the random experiments. Raises StudyError for a broken seal."""

    def read_follow_up(key: str) -> tuple[str, tuple[str, ...]]:
        if key not in label:
            return "", ()
        answer = read_answer(next_bank.open / label[key]["name"])
        if not is_answer_to_sealed_case(label[key], answer):
            raise make_broken_seal_error([label[key]["name"]], next_bank.path)
        returned_effects = () if "failed" in answer else diagnosis_from_json(answer["diagnosis"]).returned_set
        return label[key]["words"], returned_effects

    proposed_words, after_proposed = read_follow_up(PROPOSED_KEY)
    random_words, after_random = read_follow_up(RANDOM_KEY)
    return FollowUp(
        start.number, start.names[0], start.returned, proposed_words, after_proposed, random_words, after_random
    )
