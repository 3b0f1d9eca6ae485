"""Controls of a diagnosis: altered inputs with a known expected change of the answer, diagnosed by the same
processes as a bank."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from analysis.diagnosis.document import Diagnosis, diagnosis_from_json
from analysis.evaluation.blind_test.controlled import ControlOutcome, judge_control
from study.errors import StudyError
from study.evaluation.bank.ask_engine import Workers, ask_and_count
from study.evaluation.bank.proof_folder import MODEL, RECORDING, SETTINGS, ProofFolder
from study.evaluation.bank.proof_seals import read_answer
from study.evaluation.challenge.controls import CONTROLS, Control, ControlInput
from study.evaluation.challenge.rig import Rig
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording

SHORT = Rig((0,), 1000, 3, steps=80)
"""One axis and three periods of 1000 samples: a control asks what is said, not how well."""


def run_controls(
    path: Path,
    seed: int,
    workers: Workers,
    on_done: Callable[[int, int], None],
    controls: Sequence[Control] = CONTROLS,
    rig: Rig = SHORT,
) -> tuple[ControlOutcome, ...]:
    """Write, diagnose and judge the controls in the folder `path`. `on_done(answered, total)`. Resumable. Raises
    StudyError."""
    folder = ProofFolder(path)
    folder.open.mkdir(parents=True, exist_ok=True)
    names = {control.name: _prepare_control(folder, seed, control, rig) for control in controls}
    every = [name for each in names.values() for name in each]
    ask_and_count(folder, every, workers, on_done, keep=False)
    return tuple(
        judge_control(
            f"{control.name}, seed {seed}",
            control.claim,
            [_read_answer(folder.open / name) for name in names[control.name]],
        )
        for control in controls
    )


def _prepare_control(folder: ProofFolder, seed: int, control: Control, rig: Rig) -> tuple[str, ...]:
    """Write the inputs of one control if missing and return their case names; the settings file is written last."""
    known = folder.path / f"{control.name.replace(' ', '-')}.json"
    begun = f"{CONTROLS.index(control):02d}"
    if (written := _names(known, begun)) is not None:
        return written
    asked = control.draw(seed, rig)
    names = tuple(f"{begun}{number}" for number in range(len(asked)))
    for name, each in zip(names, asked, strict=True):
        _write(folder.open / name, each)
    write_text(known, json.dumps(names) + "\n", overwrite=True)
    return names


def _names(known: Path, begun: str) -> tuple[str, ...] | None:
    """Case names of a control; None where they are not written yet or do not match this program: they are then drawn
    again."""
    try:
        names = load_json(read_text(known))
    except (StudyError, ValueError):
        return None
    is_complete = isinstance(names, list) and names == [f"{begun}{number}" for number in range(len(names))]
    return tuple(names) if is_complete and names else None


def _write(place: Path, asked: ControlInput) -> None:
    place.mkdir(exist_ok=True)
    write_recording(place / RECORDING, asked.recording, precision="float32", overwrite=True)
    write_mechanical_model(place / MODEL, asked.model, overwrite=True)
    write_text(place / SETTINGS, json.dumps({"without": list(asked.without)}) + "\n", overwrite=True)


def _read_answer(place: Path) -> Diagnosis | None:
    answer = read_answer(place)
    return None if "failed" in answer else diagnosis_from_json(answer["diagnosis"])
