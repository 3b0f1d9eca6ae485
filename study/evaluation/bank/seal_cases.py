"""Draw the cases of a bank and write them: open inputs for the diagnosis, and sealed labels with the truth.

A seal is a commitment by hash: the SHA-256 of every label is written, and can be published, before any case is
diagnosed, so that truth and answers cannot be changed to suit each other. Labels hold a random salt; without it, the
few possible truths could be found by trying their hashes.
"""

import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from study.errors import StudyError
from study.evaluation.bank.ask_engine import is_answered
from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, publish_case
from study.evaluation.bank.proof_folder import MODEL_FILE, RECORDING_FILE, SETTINGS_FILE, ProofFolder
from study.evaluation.bank.proof_seals import hash_case_files, read_label, seal
from study.evaluation.challenge.draw_bank import CaseDraw, draw_case_plan, generate_case
from study.evaluation.challenge.draw_case import Case
from study.evaluation.challenge.second_engine import mujoco_access
from study.store.disk.provenance import compute_sha256
from study.store.disk.text_file import write_text
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording
from study.workflows.worker_processes import open_worker_processes


def list_concealed_effects(case: Case) -> list[dict[str, Any]]:
    """List the concealed effects of a case as JSON values (`Truth`: name, place, axis, parameters); empty where the
    model lacks nothing."""
    return [asdict(truth) for truth in case.truth]


SALT_BYTES = 16
"""Random bytes in a label. Chosen: 128 bits cannot be found by trying."""
SEARCH_CPU_S = 60.0
"""Processor time for the search in one case (s), after which the best result so far is the answer. Chosen."""


@dataclass(frozen=True, slots=True)
class BankPlan:
    """Seed and number of the cases of a bank."""

    seed: int
    cases: int
    """Number of cases; they are numbered from 0."""
    brief: bool = False
    """Short periods (`draw_case_plan`, `draw_law`): for tests, and for a quick try."""


def list_drawable_cases(plan: BankPlan) -> tuple[CaseDraw, ...]:
    """List the cases of a bank that can be drawn on this machine; those of MuJoCo are left out where it is not
    installed."""
    draws = (draw_case_plan(plan.seed, number, plan.brief) for number in range(plan.cases))
    return tuple(case_draw for case_draw in draws if case_draw.bank != "engine" or mujoco_access.is_installed())


def seal_cases(folder: ProofFolder, plan: BankPlan, workers: int, on_sealed: Callable[[int], None]) -> str:
    """Draw, write and seal the cases that have no label yet, calling `on_sealed(count)` with the number of sealed
    cases. Returns the SHA-256 of labels.sha256, to be published before anything is diagnosed. Raises StudyError where a
    file cannot be written or a sealed label has changed."""
    case_writers = {
        case_draw.number: partial(write_sealed_case, folder, case_draw) for case_draw in list_drawable_cases(plan)
    }
    return seal_missing_cases(folder, case_writers, workers, on_sealed)


def seal_missing_cases(
    folder: ProofFolder, case_writers: Mapping[int, Callable[[], None]], workers: int, on_sealed: Callable[[int], None]
) -> str:
    """Write the cases without a label in worker processes, and seal the bank. case_writers: function that writes a
    case, by its number; on_sealed: called with the number of sealed cases. Returns the seal as `seal_cases`."""
    missing_writers = [
        case_writer for number, case_writer in case_writers.items() if not folder.get_label_file(number).exists()
    ]
    sealed_count = len(case_writers) - len(missing_writers)
    on_sealed(sealed_count)
    with finish_begun_cases(folder), open_worker_processes(workers if len(missing_writers) > 1 else 1) as pool:
        for written_case in as_completed([pool.submit(case_writer) for case_writer in missing_writers]):
            written_case.result()
            sealed_count += 1
            on_sealed(sealed_count)
    return seal(folder)


def write_sealed_case(folder: ProofFolder, case_draw: CaseDraw) -> None:
    """Write one case: recording, model and settings for the diagnosis, then the label, without which the case counts as
    unfinished."""
    case_folder = begin_case(folder)
    case = generate_case(case_draw, case_folder.name)
    write_recording(case_folder / RECORDING_FILE, case.recording, precision="float32")
    write_mechanical_model(case_folder / MODEL_FILE, case.model)
    write_text(case_folder / SETTINGS_FILE, format_settings(case_draw.excluded_effects, SEARCH_CPU_S))
    write_text(
        folder.get_label_file(case_draw.number),
        json.dumps(_make_label(case_draw, case, case_folder), indent=1, allow_nan=False) + "\n",
    )
    publish_case(folder, case_folder)


def format_settings(excluded_effects: Sequence[str], processor_s: float | None = None) -> str:
    """Format the settings of a diagnosis as JSON. excluded_effects: effects that it must not consider; processor_s:
    limit of the search's processor time (s), None = no limit."""
    return json.dumps({"without": list(excluded_effects), "processor_s": processor_s}) + "\n"


def restore_recordings(
    folder: ProofFolder, numbers_by_name: Mapping[str, int], redraw: Callable[[Path, dict[str, Any]], object]
) -> None:
    """Write the deleted recordings of cases that have no answer, as after an answer was removed. numbers_by_name:
    number of each case by its name; redraw: draws and writes the recording of a case, from its folder and label."""
    for name, number in numbers_by_name.items():
        if not is_answered(folder.open / name) and not (folder.open / name / RECORDING_FILE).exists():
            redraw(folder.open / name, read_label(folder.get_label_file(number)))


def redraw_recording(case_folder: Path, plan: BankPlan, label: dict[str, Any]) -> Case:
    """Draw and write the recording of a sealed case again. Raises StudyError where its hash is not the sealed one, or
    MuJoCo is needed and not installed."""
    try:
        case = generate_case(draw_case_plan(plan.seed, label["number"], plan.brief), label["name"])
    except ImportError as problem:
        raise StudyError(
            "A device of the bank cannot be drawn again",
            f"Case {label['number']} was drawn by MuJoCo, which is not installed here.",
            "Install it (pip install 'hapteq[prove]'), and run the same command again.",
            saved="All answers are kept.",
        ) from problem
    write_redrawn_recording(case_folder, case, label)
    return case


def write_redrawn_recording(case_folder: Path, case: Case, label: dict[str, Any]) -> None:
    """Write the recording of a case that was drawn again. Raises StudyError, and removes it, where its hash is not that
    of the label: the next run would diagnose it, and the answer would break the seal."""
    path = case_folder / RECORDING_FILE
    write_recording(path, case.recording, precision="float32", overwrite=True)
    if compute_sha256(path) != label["recording_sha256"]:
        path.unlink()
        raise StudyError(
            "A device of the bank cannot be drawn again",
            f"Case {label['number']} gives another recording than the one that was sealed.",
            "Run the bank with the versions that it was begun with (proof.json names them), or anew.",
            saved="All answers are kept.",
        )


def _make_label(case_draw: CaseDraw, case: Case, case_folder: Path) -> dict[str, Any]:
    """Make the label of a case: its draw, the truth, the hashes of its files, and the salt."""
    draw_fields = asdict(case_draw)
    return {
        "name": case_folder.name,
        **{key: draw_fields[key] for key in ("number", "seed", "kind", "bank", "strengths", "concealed")},
        "axes": ["xyz"[axis] for axis in case_draw.settings.axes],
        "extras": case_draw.settings.extras,
        "without": list(case_draw.excluded_effects),
        "truth": list_concealed_effects(case),
        "adds": case.detectability,
        **hash_case_files(case_folder),
        "salt": secrets.token_hex(SALT_BYTES),
    }


def read_case_names(folder: ProofFolder, numbers: Sequence[int]) -> tuple[str, ...]:
    """Read the folder names under `open` of the cases with these numbers, in the same order. Raises StudyError where a
    label cannot be read."""
    labels = [read_label(folder.get_label_file(number)) for number in numbers]
    return tuple(str(label["name"]) for label in labels)
