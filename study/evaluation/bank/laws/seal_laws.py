"""Bank of blind-test cases with laws outside the catalogue, written as files.

Each case has open inputs for the diagnosis (recording, model, settings), fresh test motions, and a sealed label with
the true law and the hashes of the files. Sealed means that the SHA-256 of the label is written, and can be published,
before the case is diagnosed.
"""

import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from analysis.evaluation.laws.law_error import FreshMotion
from study.evaluation.bank.begun_cases import begin_case, publish_case
from study.evaluation.bank.proof_folder import MODEL_FILE, RECORDING_FILE, SETTINGS_FILE, ProofFolder
from study.evaluation.bank.proof_seals import hash_case_files
from study.evaluation.bank.seal_cases import (
    SALT_BYTES,
    SEARCH_CPU_S,
    BankPlan,
    seal_missing_cases,
    write_redrawn_recording,
)
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ
from study.evaluation.challenge.laws.draw_law import FreshTestMotion, LawCase, LawDraw, draw_law, generate_law_case
from study.store.disk.provenance import compute_sha256
from study.store.disk.text_file import write_text
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording


def seal_laws(folder: ProofFolder, plan: BankPlan, workers: int, on_sealed: Callable[[int], None]) -> str:
    """Draw, write and seal the missing cases in `workers` processes, calling `on_sealed` with the number of cases
    written so far. Returns the SHA-256 of labels.sha256. Raises StudyError where a sealed label has changed."""
    law_draws = [draw_law(plan.seed, number, plan.brief) for number in range(plan.cases)]
    case_writers = {law_draw.number: partial(_write_law_case, folder, law_draw) for law_draw in law_draws}
    return seal_missing_cases(folder, case_writers, workers, on_sealed)


def get_fresh_motions_path(folder: ProofFolder, number: int) -> Path:
    """Path of the file with the fresh test motions of a case, beside its label."""
    return folder.get_label_file(number).with_suffix(".npz")


def read_fresh_motions(
    path: Path, axes: Sequence[str], law_axes: Sequence[str], acts_on_response: bool
) -> tuple[FreshMotion, ...]:
    """Read a file of fresh test motions. axes: driven axes; law_axes: axes on which the laws act; acts_on_response:
    whether the law acts on the sensor reading."""
    with np.load(path) as arrays_file:
        motion_count = len({name.split("_")[1] for name in arrays_file.files})
        return tuple(
            _make_fresh_motion(
                {name: arrays_file[f"{name}_{number}"] for name in _ARRAY_NAMES}, axes, law_axes, acts_on_response
            )
            for number in range(motion_count)
        )


_ARRAY_NAMES = ("position", "velocity", "acceleration", "command", "reading", "lawful")
"""Arrays of a fresh test motion, (samples, driven axes) each: the variables x (m), v (m/s), a (m/s²) and f (N) of an
axis, the sensor reading (m/s²), and the force of the law (N)."""


def _make_fresh_motion(
    arrays: dict[str, Any], axes: Sequence[str], law_axes: Sequence[str], acts_on_response: bool
) -> FreshMotion:
    """Make a fresh test motion of the columns (t in s, and x, v, a and f by axis), with the law's contribution on the
    axes `law_axes`: to the sensor reading (m/s²), or the force (N)."""
    columns = {"t": np.arange(len(arrays["command"])) / RATE_HZ}
    for column, axis in enumerate(axes):
        for prefix, name in zip(("", "v", "a", "f"), _ARRAY_NAMES, strict=False):
            columns[prefix + axis] = np.ascontiguousarray(arrays[name][:, column], dtype=np.float64)
    contribution = arrays["reading"] - arrays["acceleration"] if acts_on_response else arrays["lawful"]
    return FreshMotion(
        columns, {axis: contribution[:, axes.index(axis)] for axis in law_axes}, acts_on_response, RATE_HZ
    )


def _write_law_case(folder: ProofFolder, law_draw: LawDraw) -> None:
    """Write one case. The label is written after all other files: a case without a label is unfinished."""
    case_folder = begin_case(folder)
    law_case = generate_law_case(law_draw, case_folder.name)
    write_recording(case_folder / RECORDING_FILE, law_case.case.recording, precision="float32")
    write_mechanical_model(case_folder / MODEL_FILE, law_case.case.model)
    diagnosis_settings = {"without": [], "discovery": True, "processor_s": SEARCH_CPU_S}
    write_text(case_folder / SETTINGS_FILE, json.dumps(diagnosis_settings) + "\n")
    np.savez(
        get_fresh_motions_path(folder, law_draw.number), allow_pickle=False, **_collect_arrays(law_case.fresh_motions)
    )
    label = _make_label(folder, law_draw, law_case, case_folder)
    write_text(folder.get_label_file(law_draw.number), json.dumps(label, indent=1, allow_nan=False) + "\n")
    publish_case(folder, case_folder)


def redraw_law_recording(case_folder: Path, plan: BankPlan, label: dict[str, Any]) -> None:
    """Draw and write the recording of a sealed case again. Raises StudyError where its hash is not the sealed one."""
    law_case = generate_law_case(draw_law(plan.seed, label["number"], plan.brief), label["name"])
    write_redrawn_recording(case_folder, law_case.case, label)


def _collect_arrays(motions: Sequence[FreshTestMotion]) -> dict[str, Any]:
    """Collect the arrays of all fresh test motions by name and number, as `read_fresh_motions` reads them."""
    arrays = {}
    for number, fresh_motion in enumerate(motions):
        motion_arrays = (fresh_motion.motion.position, fresh_motion.motion.velocity, fresh_motion.motion.acceleration)
        for name, values in zip(
            _ARRAY_NAMES,
            (*motion_arrays, fresh_motion.command, fresh_motion.reading, fresh_motion.law_force),
            strict=True,
        ):
            arrays[f"{name}_{number}"] = values
    return arrays


def _make_label(folder: ProofFolder, law_draw: LawDraw, law_case: LawCase, case_folder: Path) -> dict[str, Any]:
    """Make the sealed label: the true law and the hashes of the files of the case. A random salt keeps the content from
    being guessed from its hash."""
    return {
        "name": case_folder.name,
        **{key: getattr(law_draw, key) for key in ("number", "seed", "kind", "concealed", "strength", "model")},
        "axes": [AXES[axis] for axis in law_draw.settings.axes],
        "truth": None if law_case.truth is None else asdict(law_case.truth),
        "adds": law_case.case.detectability,
        **hash_case_files(case_folder),
        "fresh_sha256": compute_sha256(get_fresh_motions_path(folder, law_draw.number)),
        "salt": secrets.token_hex(SALT_BYTES),
    }
