"""Faults injected into real recordings under a seal, diagnosed by processes that know nothing of them, and counted."""

import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.data.observed_parts import part_of, parts_of
from analysis.diagnosis.errors.choose_measure import measure_of
from analysis.diagnosis.errors.played_errors import played_error
from analysis.diagnosis.errors.standing import rms_over
from analysis.diagnosis.errors.tuning import tuning_of
from analysis.diagnosis.result.real_answer import RealAnswer
from analysis.diagnosis.search.explain import retuned_alone
from analysis.diagnosis.search.rivalry import Arena
from analysis.proof.injected import DETECTABLE, InjectedOutcome, outcome_of
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from study.challenge.injections import fitting_injections, inject
from study.errors import StudyError
from study.store.mechanical_model_file import read_mechanical_model, write_mechanical_model
from study.store.provenance import sha256_of
from study.store.recording_file import write_recording
from study.store.text_file import write_text
from study.workflows.answer_cases import others_sha256
from study.workflows.ask_engine import ask_engine, is_answered
from study.workflows.diagnose_real import imported
from study.workflows.proof_folder import CLEAN, MODEL, RECORDING, SETTINGS, ProofFolder, opened
from study.workflows.proof_seals import answer_at, broken_seal, is_of, label_at, seal
from study.workflows.real_folder import RealRecording
from study.workflows.seal_cases import settings_text

MOST_SAMPLES = 10_000
"""Of each half of a recording, and of what is played before it."""
NOTHING = 1 / 6
"""Share of draws into which nothing is injected."""
PROCESSOR_S = 180.0
"""For the search of one case: real recordings take longer than a bank's."""
BY_FORCES = "predicted force"
KEPT = ("feedback", "imposed", "parts")
"""Notes that a diagnosis goes by."""


@dataclass(frozen=True, slots=True, eq=False)
class Carrier:
    """A real recording that faults can be put into: its first half as it is, its second to be spoiled."""

    name: str
    model: MechanicalModel
    """What the device is known to be by now, effects and all."""
    sound: Recording
    rest: Recording
    """Both with their lead, see `halves`; what came out in it is left out of the rest once a fault is in."""
    missed: float
    """Share of the signal that the model misses in the first half."""


def carriers(out: Path, wanted: Sequence[RealRecording], answers: Sequence[RealAnswer]) -> tuple[Carrier, ...]:
    """Of the recordings that were diagnosed into `out`."""
    found = []
    for each, answer in zip(wanted, answers, strict=True):
        if answer.verdict == "refused":
            continue
        model = read_mechanical_model(out / each.folder.name / each.name / "improved.toml")
        sound, rest = halves(imported(each.found))
        sound = without_lead(sound)
        missed = played_error(sound, model, "all").as_it_is
        if missed is not None and missed < 1.0:
            found.append(Carrier(each.name, model, sound, rest, missed))
    return tuple(found)


def halves(recording: Recording) -> tuple[Recording, Recording]:
    """The last samples of a recording in two, without roles: which are fitted to is drawn anew in each.

    A half begins in the middle of a motion. So that it can be played from rest all the same, what was there until then
    goes before it, outside all segments.
    """
    plain = replace(
        recording,
        segments=tuple(replace(segment, role="") for segment in recording.segments),
    )
    stop = len(recording)
    half = min(stop // 2, MOST_SAMPLES)
    return _led(plain, stop - 2 * half, stop - half), _led(plain, stop - half, stop)


def _led(recording: Recording, start: int, stop: int) -> Recording:
    lead = min(start, MOST_SAMPLES)
    whole = part_of(recording, start - lead, stop)
    own = [replace(segment, start=max(segment.start, lead)) for segment in whole.segments if segment.stop > lead]
    parts = [
        {"start": max(begin, start - lead) - start + lead, "stop": min(end, stop) - start + lead}
        for begin, end in parts_of(recording)
        if min(end, stop) > max(begin, start - lead)
    ]
    meta = {key: value for key, value in recording.meta.items() if key != "parts"}
    return replace(
        whole,
        segments=tuple(own) or (Segment(lead, len(whole), "noise", 0.0),),
        meta={**meta, "parts": parts} if len(parts) > 1 else meta,
    )


def without_lead(recording: Recording) -> Recording:
    """What was commanded is known there, and nothing else (NaN)."""
    lead = _lead_of(recording)
    position = None if recording.position is None else _unknown(recording.position, lead)
    return replace(recording, response=_unknown(recording.response, lead), position=position)


def _lead_of(recording: Recording) -> int:
    return min(segment.start for segment in recording.segments)


def _unknown(signal: Signal, lead: int) -> Signal:
    samples = signal.samples.copy()
    samples[:lead] = np.nan
    return replace(signal, samples=samples)


def seal_injections(folder: ProofFolder, carried: Sequence[Carrier], count: int, seed: int) -> tuple[str, ...]:
    """Draws and writes what is not there yet; names under `open`, in order. Raises StudyError."""
    if not carried:
        raise StudyError(
            "There is nothing to inject faults into",
            "None of the recordings was diagnosed by its motion, by a model that explains some of it.",
            "Give recordings of open loops, or leave --inject out.",
            saved="The diagnoses are written.",
        )
    names = [_sealed(folder, carried, number, seed) for number in range(count)]
    seal(folder)
    return tuple(names)


def _sealed(folder: ProofFolder, carried: Sequence[Carrier], number: int, seed: int) -> str:
    label = folder.label(number)
    if label.exists():
        return str(label_at(label)["name"])
    random = np.random.default_rng([seed, number])
    carrier = carried[int(random.integers(len(carried)))]
    effects = fitting_injections(carrier.rest)
    effect = "" if random.random() < NOTHING else str(random.choice(effects))
    done = inject(carrier.rest, effect, float(random.random()), random)
    as_it_is, adds = _adds(carrier, done.recording)
    name = secrets.token_hex(6)
    place = folder.open / name
    (place / CLEAN).mkdir(parents=True)
    write_recording(place / RECORDING, _nameless(without_lead(done.recording)), precision="float64")
    write_recording(place / CLEAN / RECORDING, _nameless(carrier.sound), precision="float64")
    write_mechanical_model(place / MODEL, carrier.model)
    write_text(place / SETTINGS, settings_text((), PROCESSOR_S))
    said = {
        "name": name,
        "number": number,
        "seed": seed,
        "recording": carrier.name,
        "effect": done.effect,
        "strength": done.strength,
        "values": done.values,
        "adds": adds,
        "adds_as_it_is": as_it_is,
        "recording_sha256": sha256_of(place / RECORDING),
        "model_sha256": sha256_of(place / MODEL),
        "others_sha256": others_sha256(place),
        "salt": secrets.token_hex(16),
    }
    write_text(label, json.dumps(said, indent=1, allow_nan=False) + "\n")
    return name


def _nameless(recording: Recording) -> Recording:
    """Without the notes that say where it is from."""
    return replace(recording, meta={key: recording.meta[key] for key in KEPT if key in recording.meta})


def _adds(carrier: Carrier, spoiled: Recording) -> tuple[float, float]:
    """Times the error without the fault, in the channel where it shows most: of the model as it is, and at most that
    of one whose own numbers are re-tuned within their tolerances. What these take up is no fault that can be seen."""
    as_it_is = _adds_as_it_is(carrier, spoiled)
    if as_it_is < DETECTABLE:
        return as_it_is, as_it_is
    retuned, sound = (_retuned_error(without_lead(each), carrier.model) for each in (spoiled, carrier.rest))
    return as_it_is, min(as_it_is, float(np.max(retuned / sound)))


def _adds_as_it_is(carrier: Carrier, spoiled: Recording) -> float:
    moved = not np.array_equal(spoiled.command.samples, carrier.rest.command.samples)
    sound = played_error(without_lead(carrier.rest), carrier.model, "all")
    if moved or sound.error == BY_FORCES:
        faulty = played_error(without_lead(spoiled), carrier.model, "all")
        return faulty.as_it_is / sound.as_it_is if faulty.as_it_is and sound.as_it_is else 1.0
    before, lead = carrier.rest.response.samples, _lead_of(carrier.rest)
    change = np.sqrt(np.nanmean((spoiled.response.samples - before)[lead:] ** 2, axis=0))
    left = carrier.missed * np.nanstd(before[lead:], axis=0)
    return float(np.max(np.hypot(change, left) / np.maximum(left, np.finfo(float).tiny)))


def _retuned_error(recording: Recording, model: MechanicalModel) -> FloatArray:
    """(c,): rms over what is compared."""
    measure = measure_of((recording,), model).measure
    arena = Arena(measure.shortened(), measure, tuning_of(model, recording.command.channels), map)
    residuals = arena.confirmed(arena.contender(retuned_alone(arena))).fitted.residuals
    masks = [record.fit | record.choose | record.test for record in measure.records]
    return np.asarray(np.maximum(rms_over(measure.records, residuals, masks) * measure.unit, np.finfo(float).tiny))


def injected_outcomes(
    path: Path, carried: Sequence[Carrier], draws: tuple[int, int], on_done: Callable[[int, int], None]
) -> tuple[InjectedOutcome, ...]:
    """draws: how many, and their seed. Interrupted, the same call goes on. Raises StudyError."""
    count, seed = draws
    folder = opened(path, seed, False)
    names = seal_injections(folder, carried, count, seed)
    answered = sum(is_answered(folder.open / name) for name in names)
    on_done(answered, count)

    def one_more(name: str) -> None:
        nonlocal answered
        answered += 1
        on_done(answered, count)

    ask_engine(folder, names, 2, one_more)
    labels = [label_at(folder.label(number)) for number in range(len(names))]
    answers = [answer_at(folder.open / name) for name in names]
    if broken := [label["name"] for label, said in zip(labels, answers, strict=True) if not is_of(label, said)]:
        raise broken_seal(broken, folder.path)
    return tuple(outcome_of(label, said) for label, said in zip(labels, answers, strict=True))
