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
from analysis.diagnosis.next_experiment.experiment_menu import Experiment, experiment_menu
from analysis.evaluation.blind_test.follow_up import FollowUp
from analysis.evaluation.blind_test.outcome import Outcome
from study.evaluation.bank.answer_cases import others_sha256
from study.evaluation.bank.ask_engine import Workers, ask_and_count
from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, show_case
from study.evaluation.bank.proof_folder import FURTHER, MODEL, RECORDING, SETTINGS, ProofFolder, open_proof_folder
from study.evaluation.bank.proof_seals import answers_sealed_case, broken_seal_error, read_answer, read_label, seal
from study.evaluation.bank.seal_cases import SALT_BYTES, BankPlan, redraw_recording
from study.evaluation.challenge.drive_plan import RATE_HZ
from study.store.disk.provenance import sha256_of
from study.store.disk.text_file import read_text, write_text
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import write_recording

NEXT = "next"
"""Folder of the follow-up cases: a bank of its own, whose labels name the case they follow."""
PROPOSED, DRAWN = "proposed", "drawn"
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
    starts = [
        outcome for outcome in outcomes if outcome.kind == "single" and len(outcome.returned) > len(outcome.named) > 0
    ]
    if not starts:
        return ()
    again = open_proof_folder(folder.path / NEXT, plan.seed, plan.brief)
    with finish_begun_cases(again):
        for start in starts:
            if not again.label(start.number).exists():
                _seal(folder, again, plan, start)
    seal(again)
    labels = [read_label(again.label(each.number)) for each in starts]
    names = [label[which]["name"] for label in labels for which in (PROPOSED, DRAWN) if which in label]
    ask_and_count(again, names, workers, on_done, keep=keep)
    return tuple(_follow_up_outcome(again, each, label) for each, label in zip(starts, labels, strict=True))


def _seal(folder: ProofFolder, again: ProofFolder, plan: BankPlan, start: Outcome) -> None:
    """Write both follow-up cases of `start` and their label, which is written last, when both are complete."""
    first = read_label(folder.label(start.number))
    place = folder.open / first["name"]
    proposal = read_answer(place).get("proposal")
    label: dict[str, Any] = {"number": start.number, "salt": secrets.token_hex(SALT_BYTES)}
    if proposal is not None:
        model = read_mechanical_model(place / MODEL)
        menu = experiment_menu(model, RATE_HZ, proposal["axis"], proposal["level"])
        best = proposal["best"]
        wanted_words = [best] if isinstance(best, str) else best or ()  # a single text in answers of older versions
        proposed = [each for each in menu if each.words in wanted_words]
        order = np.random.default_rng([plan.seed, start.number, NOISE_SEED]).permutation(len(menu))
        drawn = [menu[number] for number in order[: max(len(proposed), 1)]]
        wanted = {DRAWN: drawn} | ({PROPOSED: proposed} if proposed else {})
        label |= {which: _write_case(again, plan, (first, place), several) for which, several in wanted.items()}
    write_text(again.label(start.number), json.dumps(label, indent=1) + "\n")
    for which in {PROPOSED, DRAWN} & label.keys():
        show_case(again, again.begun / label[which]["name"])


def _write_case(
    again: ProofFolder, plan: BankPlan, start: tuple[dict[str, Any], Path], experiments: Sequence[Experiment]
) -> dict[str, Any]:
    """Write a follow-up case and return its part of the label. `redraw_recording` draws the first recording again and
    checks it against its label."""
    label, first = start
    place = begin_case(again)
    case = redraw_recording(place, plan, label)
    for number, each in enumerate(experiments):
        further = case.again(each.commands, each.kind, each.added, NOISE_SEED + number)
        write_recording(place / FURTHER.format(number + 2), further, precision="float32")
    for kept in (MODEL, SETTINGS):
        write_text(place / kept, read_text(first / kept))
    return {
        "name": place.name,
        "words": "; ".join(each.words for each in experiments),
        "recording_sha256": sha256_of(place / RECORDING),
        "model_sha256": sha256_of(place / MODEL),
        "others_sha256": others_sha256(place),
    }


def _follow_up_outcome(again: ProofFolder, start: Outcome, label: dict[str, Any]) -> FollowUp:
    """The effects returned after the proposed and after the random experiments. Raises StudyError for a broken seal."""

    def read_follow_up(which: str) -> tuple[str, tuple[str, ...]]:
        if which not in label:
            return "", ()
        answer = read_answer(again.open / label[which]["name"])
        if not answers_sealed_case(label[which], answer):
            raise broken_seal_error([label[which]["name"]], again.path)
        returned = () if "failed" in answer else diagnosis_from_json(answer["diagnosis"]).returned_set
        return label[which]["words"], returned

    proposed, after_proposed = read_follow_up(PROPOSED)
    drawn, after_drawn = read_follow_up(DRAWN)
    return FollowUp(start.number, start.names[0], start.returned, proposed, after_proposed, drawn, after_drawn)
