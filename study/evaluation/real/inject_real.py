"""Inject faults into real recordings under a seal, diagnose them in separate processes, and count the outcomes."""

import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.evaluation.blind_test.injected import InjectedOutcome, read_outcome
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.evaluation.bank.answer_cases import others_sha256
from study.evaluation.bank.ask_engine import Workers, ask_engine, is_answered
from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, show_case
from study.evaluation.bank.proof_folder import CLEAN, MODEL, RECORDING, SETTINGS, ProofFolder, open_proof_folder
from study.evaluation.bank.proof_seals import answers_sealed_case, broken_seal_error, read_answer, read_label, seal
from study.evaluation.bank.seal_cases import settings_text
from study.evaluation.challenge.injection.injections import applicable_injections, inject, place_of
from study.evaluation.real.diagnose_real import import_real_recording
from study.evaluation.real.injected_halves import drawn_halves, held_out_change, without_lead
from study.evaluation.real.real_folder import RealRecording
from study.store.disk.provenance import sha256_of
from study.store.disk.text_file import write_text
from study.store.formats.mechanical_model_file import read_mechanical_model, write_mechanical_model
from study.store.formats.recording_file import write_recording

NOTHING = 0.5
"""Fraction of draws without a fault: naming an effect there is the worst answer."""
TWO = 0.15
"""Fraction of the other draws with two faults."""
PROCESSOR_S = 180.0
"""Processor time for the search in one case (s): real recordings take longer than those of a bank."""
KEPT = ("feedback", "imposed", "parts")
"""Metadata that a diagnosis uses."""


@dataclass(frozen=True, slots=True, eq=False)
class Carrier:
    """A real recording into which faults can be injected."""

    name: str
    model: MechanicalModel
    """Best known model of the device, with its effects."""
    recording: Recording


def carriers(out: Path, wanted: Sequence[RealRecording], answers: Sequence[RealAnswer]) -> tuple[Carrier, ...]:
    """The recordings that were diagnosed into `out`."""
    return tuple(
        Carrier(
            each.name,
            read_mechanical_model(out / each.folder.name / each.name / "improved.toml"),
            import_real_recording(each.found),
        )
        for each, answer in zip(wanted, answers, strict=True)
        if answer.verdict != "refused"
    )


def seal_injections(folder: ProofFolder, carried: Sequence[Carrier], count: int, seed: int) -> tuple[str, ...]:
    """Draw, write and seal the missing cases; returns the case names in order. Raises StudyError."""
    if not carried:
        raise StudyError(
            "There is nothing to inject faults into",
            "None of the recordings was diagnosed by its motion, by a model that explains some of it.",
            "Give recordings of open loops, or leave --inject out.",
            saved="The diagnoses are written.",
        )
    with finish_begun_cases(folder):
        names = [_seal_injection(folder, carried, number, seed) for number in range(count)]
    seal(folder)
    return tuple(names)


def _seal_injection(folder: ProofFolder, carried: Sequence[Carrier], number: int, seed: int) -> str:
    """Draw, write and seal one case; returns its name."""
    label = folder.label(number)
    if label.exists():
        return str(read_label(label)["name"])
    random = np.random.default_rng([seed, number])
    carrier = carried[number % len(carried)]
    intact, rest = drawn_halves(carrier.recording, random)
    effects = () if random.random() < NOTHING else _drawn_effects(rest, random)
    strength = float(random.random())
    spoiled, values = rest, dict[str, float]()
    for effect in effects:
        done = inject(spoiled, effect, strength, random)
        spoiled, values = done.recording, values | done.values
    intact, rest, spoiled = (_nameless(without_lead(each)) for each in (intact, rest, spoiled))
    change = held_out_change(intact, rest, spoiled) if effects else 1.0
    place = begin_case(folder)
    (place / CLEAN).mkdir()
    write_recording(place / RECORDING, spoiled, precision="float64")
    write_recording(place / CLEAN / RECORDING, intact, precision="float64")
    write_mechanical_model(place / MODEL, carrier.model)
    write_text(place / SETTINGS, settings_text((), PROCESSOR_S))
    document = {
        "name": place.name,
        "number": number,
        "seed": seed,
        "recording": carrier.name,
        "effects": list(effects),
        "places": [place_of(effect) for effect in effects],
        "strength": strength if effects else 0.0,
        "values": values,
        "change": change,
        "recording_sha256": sha256_of(place / RECORDING),
        "model_sha256": sha256_of(place / MODEL),
        "others_sha256": others_sha256(place),
        "salt": secrets.token_hex(16),
    }
    write_text(label, json.dumps(document, indent=1, allow_nan=False) + "\n")
    show_case(folder, place)
    return place.name


def _drawn_effects(recording: Recording, random: np.random.Generator) -> tuple[str, ...]:
    known = applicable_injections(recording)
    count = 2 if random.random() < TWO else 1
    drawn = [str(effect) for effect in random.choice(known, count, replace=False)]
    # What a sensor makes of a motion comes after it.
    return tuple(sorted(drawn, key=lambda effect: place_of(effect) == "sensor"))


def _nameless(recording: Recording) -> Recording:
    """The recording without metadata that reveals its origin."""
    return replace(recording, meta={key: recording.meta[key] for key in KEPT if key in recording.meta})


def run_injections(
    path: Path,
    carried: Sequence[Carrier],
    draws: tuple[int, int],
    on_done: Callable[[int, int], None],
    workers: Workers = 2,
) -> tuple[InjectedOutcome, ...]:
    """Seal, diagnose and reveal injected faults. draws: number of cases, and seed. Resumable. Raises StudyError."""
    count, seed = draws
    folder = open_proof_folder(path, seed, False)
    names = seal_injections(folder, carried, count, seed)
    answered = sum(is_answered(folder.open / name) for name in names)
    on_done(answered, count)

    def one_more(name: str) -> None:
        nonlocal answered
        answered += 1
        on_done(answered, count)

    ask_engine(folder, names, workers, one_more)
    labels = [read_label(folder.label(number)) for number in range(len(names))]
    answers = [read_answer(folder.open / name) for name in names]
    if broken := [
        label["name"] for label, answer in zip(labels, answers, strict=True) if not answers_sealed_case(label, answer)
    ]:
        raise broken_seal_error(broken, folder.path)
    return tuple(read_outcome(label, answer) for label, answer in zip(labels, answers, strict=True))
