"""Write devices with laws outside the catalogue as files: open inputs for the diagnosis; sealed, the truth and a
fresh test motion."""

import json
import secrets
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from analysis.evaluation.laws.law_error import FreshMotion
from study.evaluation.bank.begun_cases import begin_case, finish_begun_cases, show_case
from study.evaluation.bank.proof_folder import MODEL, RECORDING, SETTINGS, ProofFolder
from study.evaluation.bank.proof_seals import seal
from study.evaluation.bank.seal_cases import PROCESSOR_S, SALT_BYTES, BankPlan
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ
from study.evaluation.challenge.laws.draw_law import Fresh, LawCase, LawDraw, draw_law, law_case
from study.store.disk.provenance import sha256_of
from study.store.disk.text_file import write_text
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording
from study.workflows.worker_processes import worker_processes


def seal_laws(folder: ProofFolder, plan: BankPlan, workers: int, on_sealed: Callable[[int], None]) -> str:
    """Draw, write and seal the missing cases, calling `on_sealed(count)`. Returns the SHA-256 of labels.sha256.
    Raises StudyError."""
    drawn = [draw_law(plan.seed, number, plan.brief) for number in range(plan.cases)]
    left = [each for each in drawn if not folder.label(each.number).exists()]
    done = len(drawn) - len(left)
    on_sealed(done)
    with finish_begun_cases(folder), worker_processes(workers if len(left) > 1 else 1) as pool:
        for finished in as_completed([pool.submit(_seal_law, folder, each) for each in left]):
            finished.result()
            done += 1
            on_sealed(done)
    return seal(folder)


def fresh_file(folder: ProofFolder, number: int) -> Path:
    """Path of the sealed fresh motion of a case."""
    return folder.label(number).with_suffix(".npz")


def fresh_motions(path: Path, axes: Sequence[str], pushed: Sequence[str], response: bool) -> tuple[FreshMotion, ...]:
    """Read a sealed file of fresh motions. axes: driven axes; pushed: axes on which the laws act; response: whether
    the law acts on the sensor reading."""
    with np.load(path) as kept:
        count = len({name.split("_")[1] for name in kept.files})
        return tuple(
            _fresh_motion({name: kept[f"{name}_{number}"] for name in _KEPT}, axes, pushed, response)
            for number in range(count)
        )


_KEPT = ("position", "velocity", "acceleration", "command", "reading", "lawful")
"""Arrays of a fresh motion that are sealed; the first four give the variables x, v, a and f of an axis."""


def _fresh_motion(of: dict[str, Any], axes: Sequence[str], pushed: Sequence[str], response: bool) -> FreshMotion:
    columns = {"t": np.arange(len(of["command"])) / RATE_HZ}
    for place, axis in enumerate(axes):
        for prefix, name in zip(("", "v", "a", "f"), _KEPT, strict=False):
            columns[prefix + axis] = np.ascontiguousarray(of[name][:, place], dtype=np.float64)
    added = of["reading"] - of["acceleration"] if response else of["lawful"]
    return FreshMotion(columns, {axis: added[:, axes.index(axis)] for axis in pushed}, response, RATE_HZ)


def _seal_law(folder: ProofFolder, each: LawDraw) -> None:
    """Write one case; a missing label means an unfinished case."""
    place = begin_case(folder)
    found = law_case(each, place.name)
    write_recording(place / RECORDING, found.case.recording, precision="float32")
    write_mechanical_model(place / MODEL, found.case.model)
    asked = {"without": [], "discovery": True, "processor_s": PROCESSOR_S}
    write_text(place / SETTINGS, json.dumps(asked) + "\n")
    np.savez(fresh_file(folder, each.number), allow_pickle=False, **_arrays(found.fresh))
    label = _label(folder, each, found, place)
    write_text(folder.label(each.number), json.dumps(label, indent=1, allow_nan=False) + "\n")
    show_case(folder, place)


def _arrays(fresh: Sequence[Fresh]) -> dict[str, Any]:
    found = {}
    for number, each in enumerate(fresh):
        moved = (each.moved.position, each.moved.velocity, each.moved.acceleration)
        for name, values in zip(_KEPT, (*moved, each.command, each.reading, each.lawful), strict=True):
            found[f"{name}_{number}"] = values
    return found


def _label(folder: ProofFolder, each: LawDraw, found: LawCase, place: Path) -> dict[str, Any]:
    """Everything that is concealed. A random salt keeps the content from being guessed from its hash."""
    return {
        "name": place.name,
        **{key: getattr(each, key) for key in ("number", "seed", "kind", "concealed", "strength", "model")},
        "axes": [AXES[axis] for axis in each.rig.axes],
        "truth": None if found.truth is None else asdict(found.truth),
        "adds": found.case.adds,
        "recording_sha256": sha256_of(place / RECORDING),
        "model_sha256": sha256_of(place / MODEL),
        "fresh_sha256": sha256_of(fresh_file(folder, each.number)),
        "salt": secrets.token_hex(SALT_BYTES),
    }
