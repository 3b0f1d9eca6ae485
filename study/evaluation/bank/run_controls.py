"""Run the controls of a diagnosis: altered inputs with a known expected answer, or change of it.

The inputs are drawn by `challenge.controls`; `analysis.evaluation.blind_test.control_claims` judges the answers.
"""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from analysis.diagnosis.document import Diagnosis, diagnosis_from_json
from analysis.evaluation.blind_test.control_claims import ControlOutcome, judge_control
from study.errors import StudyError
from study.evaluation.bank.ask_engine import Workers, diagnose_and_count
from study.evaluation.bank.proof_folder import MODEL_FILE, RECORDING_FILE, SETTINGS_FILE, ProofFolder
from study.evaluation.bank.proof_seals import read_answer
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.controls import CONTROLS, Control, ControlInput
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording

CONTROL_SETTINGS = CaseSettings((0,), 1000, 3, steps=80)
"""One axis, three periods of 1000 samples and 80 integration steps per sample. Chosen: short recordings suffice, as a
control compares answers with each other or looks for a named effect, but compares no parameter with its true value."""


def run_controls(
    path: Path,
    seed: int,
    workers: Workers,
    on_done: Callable[[int, int], None],
    controls: Sequence[Control] = CONTROLS,
    settings: CaseSettings = CONTROL_SETTINGS,
) -> tuple[ControlOutcome, ...]:
    """Write, diagnose and judge the controls in the folder `path`, with `on_done(answered, total)` after each case.
    controls: some of `CONTROLS`. A repeated call with the same folder and seed continues. Raises StudyError where the
    processes end early or a file cannot be read or written."""
    folder = ProofFolder(path)
    folder.open.mkdir(parents=True, exist_ok=True)
    case_names_by_control = {control.name: _prepare_control(folder, seed, control, settings) for control in controls}
    all_names = [name for control_names in case_names_by_control.values() for name in control_names]
    diagnose_and_count(folder, all_names, workers, on_done, keep=False)
    return tuple(
        judge_control(
            f"{control.name}, seed {seed}",
            control.claim,
            [_read_answer(folder.open / name) for name in case_names_by_control[control.name]],
        )
        for control in controls
    )


def _prepare_control(folder: ProofFolder, seed: int, control: Control, settings: CaseSettings) -> tuple[str, ...]:
    """Write the inputs of one control if missing and return their case names; the file with the names is written
    last, so that the inputs are drawn again after an interruption."""
    names_path = folder.path / f"{control.name.replace(' ', '-')}.json"
    name_prefix = f"{CONTROLS.index(control):02d}"
    if (written_names := _read_case_names(names_path, name_prefix)) is not None:
        return written_names
    inputs = control.draw(seed, settings)
    case_names = tuple(f"{name_prefix}{number}" for number in range(len(inputs)))
    for name, control_input in zip(case_names, inputs, strict=True):
        _write_input(folder.open / name, control_input)
    write_text(names_path, json.dumps(case_names) + "\n", overwrite=True)
    return case_names


def _read_case_names(names_path: Path, name_prefix: str) -> tuple[str, ...] | None:
    """Read the case names of a control; None where there are none or they lack `name_prefix`, as of another version of
    the program: the inputs are then drawn again."""
    try:
        case_names = load_json(read_text(names_path))
    except (StudyError, ValueError):
        return None
    is_complete = isinstance(case_names, list) and case_names == [
        f"{name_prefix}{number}" for number in range(len(case_names))
    ]
    return tuple(case_names) if is_complete and case_names else None


def _write_input(case_folder: Path, control_input: ControlInput) -> None:
    """Write recording, model and settings of a control into the folder of its case, replacing earlier ones."""
    case_folder.mkdir(exist_ok=True)
    write_recording(case_folder / RECORDING_FILE, control_input.recording, precision="float32", overwrite=True)
    write_mechanical_model(case_folder / MODEL_FILE, control_input.model, overwrite=True)
    write_text(
        case_folder / SETTINGS_FILE,
        json.dumps({"without": list(control_input.excluded_effects)}) + "\n",
        overwrite=True,
    )


def _read_answer(case_folder: Path) -> Diagnosis | None:
    """Read the diagnosis of a case; None where it failed. Raises StudyError where there is no answer."""
    answer = read_answer(case_folder)
    return None if "failed" in answer else diagnosis_from_json(answer["diagnosis"])
