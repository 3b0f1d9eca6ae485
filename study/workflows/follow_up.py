"""Starts that left several names, taken up again.

The device, which is still sealed, plays the recording that the diagnosis asks for, and another of the same menu that
was drawn; processes that know nothing answer both.
"""

import json
import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analysis.diagnosis.document import diagnosis_from_json
from analysis.diagnosis.experiment_menu import Experiment, experiment_menu
from analysis.proof.follow_up import FollowUp
from analysis.proof.outcome import Outcome
from study.challenge.draw_bank import case_of, draw
from study.errors import StudyError
from study.store.mechanical_model_file import read_mechanical_model
from study.store.provenance import sha256_of
from study.store.recording_file import write_recording
from study.store.text_file import read_text, write_text
from study.workflows.ask_engine import ask_engine, forget_recording, is_answered
from study.workflows.proof_folder import ANSWER, MODEL, RECORDING, SETTINGS, ProofFolder, opened
from study.workflows.seal_cases import BankPlan

NEXT = "next"
"""Folder of these cases: a bank of its own, whose labels say which start they take up."""
FURTHER = "recording_2.h5"
PROPOSED, DRAWN = "proposed", "drawn"
NOISE_SEED = 7


def follow_up(
    folder: ProofFolder, plan: BankPlan, outcomes: Sequence[Outcome], workers: int, on_done: Callable[[int, int], None]
) -> tuple[FollowUp, ...]:
    """Of single effects. Interrupted, the same call goes on. Raises StudyError."""
    starts = [one for one in outcomes if one.kind == "single" and len(one.returned) > len(one.named) > 0]
    if not starts:
        return ()
    again = opened(folder.path / NEXT, plan.seed, plan.brief)
    for one in starts:
        if not again.label(one.number).exists():
            _seal(folder, again, plan, one)
    labels = [json.loads(read_text(again.label(one.number))) for one in starts]
    names = [label[which]["name"] for label in labels for which in (PROPOSED, DRAWN) if which in label]
    done = sum(is_answered(again.open / name) for name in names)
    on_done(done, len(names))

    def on_answered(name: str) -> None:
        nonlocal done
        done += 1
        forget_recording(again.open / name)
        (again.open / name / FURTHER).unlink(missing_ok=True)
        on_done(done, len(names))

    ask_engine(again, names, workers, on_answered)
    return tuple(_found(again, one, label) for one, label in zip(starts, labels, strict=True))


def _seal(folder: ProofFolder, again: ProofFolder, plan: BankPlan, start: Outcome) -> None:
    """Both cases of a start; the label comes last."""
    first = json.loads(read_text(folder.label(start.number)))
    place = folder.open / first["name"]
    proposal = json.loads(read_text(place / ANSWER)).get("proposal")
    if proposal is None:
        write_text(again.label(start.number), json.dumps({"number": start.number}) + "\n")
        return
    model = read_mechanical_model(place / MODEL)
    menu = experiment_menu(model, 1000.0, proposal["axis"], proposal["level"])
    drawn = menu[int(np.random.default_rng([plan.seed, start.number, NOISE_SEED]).integers(len(menu)))]
    wanted = [(DRAWN, drawn), *((PROPOSED, one) for one in menu if one.words == proposal["best"])]
    label: dict[str, Any] = {"number": start.number}
    for which, experiment in wanted:
        name = _written(again, plan, (start.number, place), experiment)
        label[which] = {"name": name, "words": experiment.words}
    write_text(again.label(start.number), json.dumps(label, indent=1) + "\n")


def _written(again: ProofFolder, plan: BankPlan, start: tuple[int, Path], experiment: Experiment) -> str:
    """The first recording is drawn again, and must be the one that was answered."""
    number, first = start
    name = secrets.token_hex(6)
    place = again.open / name
    place.mkdir()
    case = case_of(draw(plan.seed, number, plan.brief), first.name)
    write_recording(place / RECORDING, case.recording, precision="float32")
    said = json.loads(read_text(first / ANSWER))
    if sha256_of(place / RECORDING) != said["recording_sha256"]:
        raise StudyError(
            "A device of the bank cannot be drawn again",
            f"Case {number} gives another recording than the one that was diagnosed.",
            "Run the bank with the versions that it was begun with (proof.json names them), or anew.",
            saved="All answers are kept.",
        )
    further = case.again(experiment.commands, experiment.kind, experiment.added, NOISE_SEED)
    write_recording(place / FURTHER, further, precision="float32")
    for kept in (MODEL, SETTINGS):
        write_text(place / kept, read_text(first / kept))
    return name


def _found(again: ProofFolder, start: Outcome, label: dict[str, Any]) -> FollowUp:
    def said(which: str) -> tuple[str, tuple[str, ...]]:
        if which not in label:
            return "", ()
        answer = json.loads(read_text(again.open / label[which]["name"] / ANSWER))
        returned = () if "failed" in answer else diagnosis_from_json(answer["diagnosis"]).returned_set
        return label[which]["words"], returned

    proposed, after_proposed = said(PROPOSED)
    drawn, after_drawn = said(DRAWN)
    return FollowUp(
        start.number, start.names[0], start.returned, proposed, after_proposed, drawn, after_drawn
    )  # fmt: skip
