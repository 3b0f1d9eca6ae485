"""Blind test of the diagnosis with faults injected into real recordings: inject, seal, diagnose, reveal.

Each case contains an intact half of a recording (`injected_halves`), given to the diagnosis as clean, and another with
up to two simulated faults. The labels (the injected faults) are hashed before any diagnosis, so that later changes
would show (`proof_seals`); the diagnoses run in separate processes. Begin at `run_injections` (`hapteq real --inject`).
"""

import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.evaluation.blind_test.injected_faults import InjectedOutcome, read_outcome
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.evaluation.bank.ask_engine import Workers, diagnose_and_count
from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, publish_case
from study.evaluation.bank.proof_folder import (
    CLEAN_FOLDER,
    MODEL_FILE,
    RECORDING_FILE,
    SETTINGS_FILE,
    ProofFolder,
    hold_proof_folder,
    open_proof_folder,
)
from study.evaluation.bank.proof_seals import hash_case_files, read_label, seal
from study.evaluation.bank.seal_cases import format_settings
from study.evaluation.bank.sealed_bank import reveal_bank
from study.evaluation.challenge.injection.injections import find_place, inject, list_applicable_injections
from study.evaluation.real.diagnose_real import import_real_recording
from study.evaluation.real.injected_halves import blank_lead_responses, compute_held_out_change, draw_halves
from study.evaluation.real.real_folder import RealRecording
from study.store.disk.text_file import write_text
from study.store.formats.diagnosis_file import MODEL_NAME
from study.store.formats.mechanical_model_file import read_mechanical_model, write_mechanical_model
from study.store.formats.recording_file import write_recording

NO_FAULT_SHARE = 0.5
"""Probability that a case has no fault: these cases count false alarms. Chosen."""
TWO_FAULTS_SHARE = 0.15
"""Probability that a case with faults has two of them instead of one. Chosen."""
PROCESSOR_S = 180.0
"""Limit of the processor time (s) of the search in a case: real recordings take longer than simulated ones.
Chosen."""
KEPT_METADATA = ("feedback", "imposed", "parts")
"""Keys of the metadata that a diagnosis uses; all others are removed, because they may reveal the device."""


@dataclass(frozen=True, slots=True, eq=False)
class InjectableRecording:
    """A real recording into which faults can be injected."""

    name: str
    model: MechanicalModel
    """Best known model of the device, with its effects."""
    recording: Recording


def load_injectable_recordings(
    diagnosis_folder: Path, recordings: Sequence[RealRecording], answers: Sequence[RealAnswer]
) -> tuple[InjectableRecording, ...]:
    """Load the recordings whose diagnosis was not refused, each with the improved model that its diagnosis wrote into
    `diagnosis_folder`. answers: in the order of `recordings`."""
    return tuple(
        InjectableRecording(
            real_recording.name,
            read_mechanical_model(diagnosis_folder / real_recording.folder.name / real_recording.name / MODEL_NAME),
            import_real_recording(real_recording.found_map),
        )
        for real_recording, answer in zip(recordings, answers, strict=True)
        if answer.verdict != "refused"
    )


def seal_injections(
    folder: ProofFolder, injectable_recordings: Sequence[InjectableRecording], count: int, seed: int
) -> tuple[str, ...]:
    """Draw, write and seal the cases that do not exist yet; returns the names of all `count` cases in order. The
    recordings are used in turn. Raises StudyError where there is none, a file cannot be written, or a sealed
    label has changed."""
    if not injectable_recordings:
        raise StudyError(
            "There is nothing to inject faults into",
            "Every recording was refused; none was diagnosed.",
            "Give recordings that can be diagnosed, or leave --inject out.",
            saved="The diagnoses are written.",
        )
    with finish_begun_cases(folder):
        case_names = [_write_injection(folder, injectable_recordings, number, seed) for number in range(count)]
    seal(folder)
    return tuple(case_names)


def _write_injection(folder: ProofFolder, recordings: Sequence[InjectableRecording], number: int, seed: int) -> str:
    """Draw one case, with the same strength for all its faults, and write its files and its label, to be sealed by
    `seal`; returns its name. An existing case is kept. In the label, a second parameter of one name has its fault's
    name before it."""
    label_path = folder.get_label_file(number)
    if label_path.exists():
        return str(read_label(label_path)["name"])
    generator = np.random.default_rng([seed, number])
    source = recordings[number % len(recordings)]
    clean, faultless = draw_halves(source.recording, generator)
    effects = () if generator.random() < NO_FAULT_SHARE else _draw_effects(faultless, generator)
    strength = float(generator.random())
    faulty, values = faultless, dict[str, float]()
    for effect in effects:
        injected = inject(faulty, effect, strength, generator)
        faulty = injected.recording
        values |= {name if name not in values else f"{effect}.{name}": value for name, value in injected.values.items()}
    clean, faultless, faulty = (_remove_origin(blank_lead_responses(half)) for half in (clean, faultless, faulty))
    change = compute_held_out_change(clean, faultless, faulty) if effects else 1.0
    case_folder = begin_case(folder)
    (case_folder / CLEAN_FOLDER).mkdir()
    write_recording(case_folder / RECORDING_FILE, faulty, precision="float64")
    write_recording(case_folder / CLEAN_FOLDER / RECORDING_FILE, clean, precision="float64")
    write_mechanical_model(case_folder / MODEL_FILE, source.model)
    write_text(case_folder / SETTINGS_FILE, format_settings((), PROCESSOR_S))
    label_values = {
        "name": case_folder.name,
        "number": number,
        "seed": seed,
        "recording": source.name,
        "effects": list(effects),
        "places": [find_place(effect) for effect in effects],
        "strength": strength if effects else 0.0,
        "values": values,
        "change": change,
        **hash_case_files(case_folder),
        "salt": secrets.token_hex(16),
    }
    write_text(label_path, json.dumps(label_values, indent=1, allow_nan=False) + "\n")
    publish_case(folder, case_folder)
    return case_folder.name


def _draw_effects(recording: Recording, generator: np.random.Generator) -> tuple[str, ...]:
    """Draw one or two faults that the recording allows; their names in the order in which they are injected."""
    applicable_effects = list_applicable_injections(recording)
    count = 2 if generator.random() < TWO_FAULTS_SHARE else 1
    effects = [str(effect) for effect in generator.choice(applicable_effects, count, replace=False)]
    # A sensor reads the motion that all other faults have changed: its fault is injected last.
    return tuple(sorted(effects, key=lambda effect: find_place(effect) == "sensor"))


def _remove_origin(recording: Recording) -> Recording:
    """Remove all metadata but those of `KEPT_METADATA`."""
    return replace(recording, meta={key: recording.meta[key] for key in KEPT_METADATA if key in recording.meta})


def run_injections(
    path: Path,
    injectable_recordings: Sequence[InjectableRecording],
    count_and_seed: tuple[int, int],
    on_done: Callable[[int, int], None],
    workers: Workers = 2,
) -> tuple[InjectedOutcome, ...]:
    """Inject, seal, diagnose and reveal faults in the folder `path`; continues an interrupted test.

    count_and_seed: number of cases, and seed of their draws. on_done: called with the numbers of diagnosed cases and of
    all cases. Raises StudyError, also where a label was changed after it was sealed, or another process works on the
    folder.
    """
    count, seed = count_and_seed
    folder = open_proof_folder(path, seed, False)
    with hold_proof_folder(folder):
        case_names = seal_injections(folder, injectable_recordings, count, seed)
        diagnose_and_count(folder, case_names, workers, on_done, keep=True)
    return reveal_bank(folder, count, read_outcome)
