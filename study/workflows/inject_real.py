"""Faults injected into real recordings under a seal, diagnosed by processes that know nothing of them, and counted."""

import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.observed_parts import part_of
from analysis.diagnosis.played_errors import played_error
from analysis.diagnosis.real_answer import RealAnswer
from analysis.proof.injected import InjectedOutcome, outcome_of
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from study.challenge.injections import fitting_injections, inject
from study.errors import StudyError
from study.store.mechanical_model_file import read_mechanical_model, write_mechanical_model
from study.store.provenance import sha256_of
from study.store.recording_file import write_recording
from study.store.text_file import read_text, write_text
from study.workflows.ask_engine import ask_engine
from study.workflows.diagnose_real import imported
from study.workflows.proof_folder import ANSWER, CLEAN, MODEL, RECORDING, SETTINGS, ProofFolder, opened
from study.workflows.real_folder import RealRecording

MOST_SAMPLES = 20_000
"""Of each half of a recording."""
NOTHING = 1 / 6
"""Share of draws into which nothing is injected."""
SECONDS = 60.0
"""For the search of one case."""
BY_FORCES = "predicted force"


@dataclass(frozen=True, slots=True, eq=False)
class Carrier:
    """A real recording that faults can be put into: its first half as it is, its second to be spoiled."""

    name: str
    model: MechanicalModel
    """What the device is known to be by now, effects and all."""
    sound: Recording
    rest: Recording
    missed: float
    """Share of the signal that the model misses in the first half."""


def carriers(out: Path, wanted: Sequence[RealRecording], answers: Sequence[RealAnswer]) -> tuple[Carrier, ...]:
    """Of the recordings that were diagnosed into `out`. Where forces are compared, a sensor's faults cannot be told
    from motion, and none is injected."""
    found = []
    for one, answer in zip(wanted, answers, strict=True):
        if answer.verdict == "refused" or answer.error == BY_FORCES:
            continue
        model = read_mechanical_model(out / one.folder.name / one.name / "improved.toml")
        sound, rest = halves(imported(one.found))
        missed = played_error(sound, model, "all").as_it_is
        if missed is not None and missed < 1.0:
            found.append(Carrier(one.name, model, sound, rest, missed))
    return tuple(found)


def halves(recording: Recording) -> tuple[Recording, Recording]:
    """The last samples of a recording in two, without roles: which are fitted to is drawn anew in each."""
    plain = replace(
        recording,
        segments=tuple(replace(one, role="") for one in recording.segments),
        meta={key: value for key, value in recording.meta.items() if key != "parts"},
    )
    stop = len(recording)
    half = min(stop // 2, MOST_SAMPLES)
    return part_of(plain, stop - 2 * half, stop - half), part_of(plain, stop - half, stop)


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
    lines = (f"{sha256_of(path)}  sealed/{path.name}\n" for path in sorted(folder.sealed.glob("*.json")))
    write_text(folder.seals, "".join(lines), overwrite=True)
    return tuple(names)


def _sealed(folder: ProofFolder, carried: Sequence[Carrier], number: int, seed: int) -> str:
    label = folder.label(number)
    if label.exists():
        return str(json.loads(read_text(label))["name"])
    random = np.random.default_rng([seed, number])
    carrier = carried[int(random.integers(len(carried)))]
    effects = fitting_injections(carrier.rest)
    effect = "" if random.random() < NOTHING else str(random.choice(effects))
    done = inject(carrier.rest, effect, float(random.random()), random)
    name = secrets.token_hex(6)
    place = folder.open / name
    (place / CLEAN).mkdir(parents=True)
    write_recording(place / RECORDING, _nameless(done.recording), precision="float64")
    write_recording(place / CLEAN / RECORDING, _nameless(carrier.sound), precision="float64")
    write_mechanical_model(place / MODEL, carrier.model)
    write_text(place / SETTINGS, json.dumps({"without": [], "seconds": SECONDS}) + "\n")
    said = {
        "name": name,
        "number": number,
        "seed": seed,
        "recording": carrier.name,
        "effect": done.effect,
        "strength": done.strength,
        "values": done.values,
        "adds": _adds(carrier, done.change),
        "recording_sha256": sha256_of(place / RECORDING),
        "salt": secrets.token_hex(16),
    }
    write_text(label, json.dumps(said, indent=1, allow_nan=False) + "\n")
    return name


def _nameless(recording: Recording) -> Recording:
    """Without the notes that say where it is from."""
    return replace(recording, meta={key: value for key, value in recording.meta.items() if key == "feedback"})


def _adds(carrier: Carrier, change: np.ndarray) -> float:
    """In the channel where it shows most."""
    left = carrier.missed * np.nanstd(carrier.rest.response.samples, axis=0)
    return float(np.max(np.hypot(change, left) / np.maximum(left, np.finfo(float).tiny)))


def injected_outcomes(
    path: Path, carried: Sequence[Carrier], draws: tuple[int, int], on_done: Callable[[int, int], None]
) -> tuple[InjectedOutcome, ...]:
    """draws: how many, and their seed. Interrupted, the same call goes on. Raises StudyError."""
    count, seed = draws
    folder = opened(path, seed, False)
    names = seal_injections(folder, carried, count, seed)
    answered = sum((folder.open / name / ANSWER).exists() for name in names)
    on_done(answered, count)

    def one_more(name: str) -> None:
        nonlocal answered
        answered += 1
        on_done(answered, count)

    ask_engine(folder, names, 2, one_more)
    return tuple(
        outcome_of(json.loads(read_text(folder.label(number))), json.loads(read_text(folder.open / name / ANSWER)))
        for number, name in enumerate(names)
    )
