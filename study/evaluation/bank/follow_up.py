"""Follow-up experiments for cases whose diagnosis returned several effects that the data could not separate.

The simulated device of the sealed case plays the experiments that the diagnosis proposed and, for comparison, as many
(at least one) drawn at random from the same menu. Separate processes diagnose each set together with the first
recording. The number of effects that the diagnosis still returns shows whether its proposals are better than chance.
"""

import json
import secrets
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analysis.diagnosis.document import diagnosis_from_json
from analysis.diagnosis.next_experiment.experiment_menu import Experiment, list_experiments
from analysis.evaluation.blind_test.follow_up import FollowUp
from analysis.evaluation.blind_test.outcome import Outcome
from study.errors import StudyError
from study.evaluation.bank.ask_engine import Workers, diagnose_and_count
from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, publish_case
from study.evaluation.bank.proof_folder import (
    FURTHER_RECORDING_FILE,
    MODEL_FILE,
    SETTINGS_FILE,
    ProofFolder,
    open_proof_folder,
)
from study.evaluation.bank.proof_seals import (
    hash_case_files,
    is_answer_to_sealed_case,
    make_broken_seal_error,
    read_answer,
    read_label,
    seal,
)
from study.evaluation.bank.seal_cases import SALT_BYTES, BankPlan, redraw_recording
from study.evaluation.challenge.drive_plan import RATE_HZ
from study.store.disk.text_file import read_text, write_text
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import write_recording

FOLLOW_UP_FOLDER = "next"
"""Folder of the bank of follow-up cases in that of the first bank; each label has the number of the first case."""
PROPOSED_KEY, RANDOM_KEY = "proposed", "drawn"
"""Keys of the two follow-up cases in a label: with the proposed experiments, and with those drawn at random."""
PROPOSAL_KEY = "proposal"
"""Key in a label of the proposal in the answer to the first case."""
NOISE_SEED = 7
"""Constant in the seeds of a follow-up's noise and random order, which makes them independent of all other draws of a
case. Any value serves; chosen by hand."""


def follow_up(
    folder: ProofFolder,
    plan: BankPlan,
    outcomes: Sequence[Outcome],
    options: tuple[Workers, bool],
    on_done: Callable[[int, int], None],
) -> tuple[FollowUp, ...]:
    """Seal, diagnose and evaluate follow-up cases of all cases with a single concealed effect for which the diagnosis
    named an effect and returned more than it named; an empty tuple where there is no such case.

    folder: the bank of the first cases; options: the workers, and whether to keep recordings after they are answered;
    on_done: called with the numbers of answered and of all follow-up cases. After an interruption the same call
    continues. Raises StudyError, such as for a broken seal, or where a case was diagnosed again since its follow-up.
    """
    workers, keep_recordings = options
    undecided_cases = [
        outcome for outcome in outcomes if outcome.kind == "single" and len(outcome.returned) > len(outcome.named) > 0
    ]
    if not undecided_cases:
        return ()
    follow_up_bank = open_proof_folder(folder.path / FOLLOW_UP_FOLDER, plan.seed, plan.brief)
    with finish_begun_cases(follow_up_bank):
        for case_to_seal in undecided_cases:
            if not follow_up_bank.get_label_file(case_to_seal.number).exists():
                _seal_follow_up_cases(folder, follow_up_bank, plan, case_to_seal)
    seal(follow_up_bank)
    labels = [read_label(follow_up_bank.get_label_file(case.number)) for case in undecided_cases]
    for label in labels:
        _require_present_proposal(folder, follow_up_bank, label)
    case_names = list_case_names(labels)
    diagnose_and_count(follow_up_bank, case_names, workers, on_done, keep=keep_recordings)
    return tuple(
        _read_follow_up(follow_up_bank, case, label) for case, label in zip(undecided_cases, labels, strict=True)
    )


def list_case_names(labels: Iterable[Mapping[str, Any]]) -> list[str]:
    """List the names of the follow-up cases of these labels."""
    return [label[key]["name"] for label in labels for key in (PROPOSED_KEY, RANDOM_KEY) if key in label]


def _require_present_proposal(folder: ProofFolder, follow_up_bank: ProofFolder, label: Mapping[str, Any]) -> None:
    """Raise StudyError where a sealed follow-up plays what an earlier answer to its first case proposed: that case was
    diagnosed again since. A label of an older version does not state the proposal and is accepted."""
    first_label = read_label(folder.get_label_file(label["number"]))
    proposal = read_answer(folder.open / first_label["name"]).get("proposal")
    if label.get(PROPOSAL_KEY, proposal) != proposal:
        raise StudyError(
            "A follow-up belongs to an earlier answer",
            f"Case {label['number']} was diagnosed again, and now proposes other experiments than those in "
            f"{follow_up_bank.path}.",
            f"Delete the folder {follow_up_bank.path}, and run the same command again: the experiments are played and "
            "diagnosed again.",
            saved="All other answers are kept.",
        )


def _seal_follow_up_cases(
    folder: ProofFolder, follow_up_bank: ProofFolder, plan: BankPlan, undecided_case: Outcome
) -> None:
    """Write the follow-up cases of an undecided case and then, when they are complete, their label; only afterwards are
    they moved to the open cases. Without a proposal the label has no cases; where no experiment was proposed, only the
    random one is written."""
    first_label = read_label(folder.get_label_file(undecided_case.number))
    first_folder = folder.open / first_label["name"]
    proposal = read_answer(first_folder).get("proposal")
    label: dict[str, Any] = {
        "number": undecided_case.number,
        PROPOSAL_KEY: proposal,
        "salt": secrets.token_hex(SALT_BYTES),
    }
    if proposal is not None:
        model = read_mechanical_model(first_folder / MODEL_FILE)
        menu = list_experiments(model, RATE_HZ, proposal["axis"], proposal["level"])
        best_words = proposal["best"]
        # A list; in answers of older versions a single text, or None without a proposed experiment.
        proposed_words = [best_words] if isinstance(best_words, str) else best_words or ()
        proposed_experiments = [experiment for experiment in menu if experiment.words in proposed_words]
        random_order = np.random.default_rng([plan.seed, undecided_case.number, NOISE_SEED]).permutation(len(menu))
        random_experiments = [menu[menu_index] for menu_index in random_order[: max(len(proposed_experiments), 1)]]
        experiments_by_key = {RANDOM_KEY: random_experiments} | (
            {PROPOSED_KEY: proposed_experiments} if proposed_experiments else {}
        )
        label |= {
            case_key: _write_case(follow_up_bank, plan, (first_label, first_folder), experiments)
            for case_key, experiments in experiments_by_key.items()
        }
    write_text(follow_up_bank.get_label_file(undecided_case.number), json.dumps(label, indent=1) + "\n")
    for case_key in {PROPOSED_KEY, RANDOM_KEY} & label.keys():
        publish_case(follow_up_bank, follow_up_bank.unfinished / label[case_key]["name"])


def _write_case(
    follow_up_bank: ProofFolder,
    plan: BankPlan,
    first_case: tuple[dict[str, Any], Path],
    experiments: Sequence[Experiment],
) -> dict[str, Any]:
    """Write a follow-up case and return its part of the label. first_case: label and folder of the first case, whose
    recording `redraw_recording` draws again and checks against its label. Raises StudyError where they differ."""
    first_label, first_folder = first_case
    case_folder = begin_case(follow_up_bank)
    redrawn_case = redraw_recording(case_folder, plan, first_label)
    for experiment_index, experiment in enumerate(experiments):
        recording = redrawn_case.record_again(
            experiment.commands, experiment.kind, experiment.added, NOISE_SEED + experiment_index
        )
        write_recording(
            case_folder / FURTHER_RECORDING_FILE.format(experiment_index + 2), recording, precision="float32"
        )
    for file_name in (MODEL_FILE, SETTINGS_FILE):
        write_text(case_folder / file_name, read_text(first_folder / file_name))
    return {
        "name": case_folder.name,
        "words": "; ".join(experiment.words for experiment in experiments),
        **hash_case_files(case_folder),
    }


def _read_follow_up(follow_up_bank: ProofFolder, undecided_case: Outcome, label: dict[str, Any]) -> FollowUp:
    """Read the effects that are returned after the proposed and after the random experiments; none for a failed
    diagnosis, and where the label has no such case. Raises StudyError for a broken seal."""

    def read_words_and_effects(key: str) -> tuple[str, tuple[str, ...]]:
        """Read the description of the experiments of a follow-up case, and the effects returned after them."""
        if key not in label:
            return "", ()
        answer = read_answer(follow_up_bank.open / label[key]["name"])
        if not is_answer_to_sealed_case(label[key], answer):
            raise make_broken_seal_error([label[key]["name"]], follow_up_bank.path)
        returned_effects = () if "failed" in answer else diagnosis_from_json(answer["diagnosis"]).returned_set
        return label[key]["words"], returned_effects

    proposed_words, effects_after_proposed = read_words_and_effects(PROPOSED_KEY)
    random_words, effects_after_random = read_words_and_effects(RANDOM_KEY)
    return FollowUp(
        undecided_case.number,
        undecided_case.names[0],
        undecided_case.returned,
        proposed_words,
        effects_after_proposed,
        random_words,
        effects_after_random,
    )
