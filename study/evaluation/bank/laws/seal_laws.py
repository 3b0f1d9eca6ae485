"""Bank of blind-test cases with laws outside the catalogue, written as files.

Each case has open inputs for the diagnosis (recording, model, settings), and a sealed label with the true law and fresh
test motions. Sealed means that the SHA-256 of each label is written, and can be published, before any case is
diagnosed.
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
from study.evaluation.bank.begun_cases import begin_case, show_case
from study.evaluation.bank.proof_folder import MODEL, RECORDING, SETTINGS, ProofFolder
from study.evaluation.bank.seal_cases import PROCESSOR_S, SALT_BYTES, BankPlan, seal_missing
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ
from study.evaluation.challenge.laws.draw_law import Fresh, LawCase, LawDraw, draw_law, law_case
from study.store.disk.provenance import sha256_of
from study.store.disk.text_file import write_text
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording


def seal_laws(folder: ProofFolder, plan: BankPlan, workers: int, on_sealed: Callable[[int], None]) -> str:
    """Draw, write and seal the missing cases in `workers` processes, calling `on_sealed(count)`. Returns the SHA-256 of
    labels.sha256. Raises StudyError."""
    drawn = [draw_law(plan.seed, number, plan.brief) for number in range(plan.cases)]
    write_case = {each.number: partial(_seal_law, folder, each) for each in drawn}
    return seal_missing(folder, write_case, workers, on_sealed)


def fresh_file(folder: ProofFolder, number: int) -> Path:
    """Path of the sealed fresh motions of a case."""
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
"""Sealed arrays of a fresh motion, (samples, axes) each; the first four are the variables x, v, a and f of an axis."""


def _fresh_motion(of: dict[str, Any], axes: Sequence[str], pushed: Sequence[str], response: bool) -> FreshMotion:
    """A fresh motion as columns (t in s, and x, v, a and f by axis), with the law's contribution on the axes `pushed`:
    to the sensor reading (m/s²), or the force (N)."""
    columns = {"t": np.arange(len(of["command"])) / RATE_HZ}
    for place, axis in enumerate(axes):
        for prefix, name in zip(("", "v", "a", "f"), _KEPT, strict=False):
            columns[prefix + axis] = np.ascontiguousarray(of[name][:, place], dtype=np.float64)
    added = of["reading"] - of["acceleration"] if response else of["lawful"]
    return FreshMotion(columns, {axis: added[:, axes.index(axis)] for axis in pushed}, response, RATE_HZ)


def _seal_law(folder: ProofFolder, each: LawDraw) -> None:
    """Write one case. The label is written after all other files: without a label, the case is unfinished."""
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
    """Arrays of all fresh motions by name and number, as `fresh_motions` reads them."""
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
