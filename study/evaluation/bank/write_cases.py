"""Concealed-physics cases as files: what a diagnosis gets, and beside it what it must not see."""

import json
from pathlib import Path
from typing import Any

from study.evaluation.challenge.draw_case import Case
from study.store.disk.text_file import write_text
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording


def write_case(folder: Path, name: str, case: Case, *, overwrite: bool = False) -> None:
    """`name`.h5, `name`.toml and `name`.truth.json. Raises AlreadyThereError, CannotWriteError."""
    write_recording(folder / f"{name}.h5", case.recording, precision="float32", overwrite=overwrite)
    write_mechanical_model(folder / f"{name}.toml", case.model, overwrite=overwrite)
    write_text(folder / f"{name}.truth.json", truth_text(case), overwrite=overwrite)


def truth_text(case: Case) -> str:
    """A JSON list, one entry per effect; empty where the model lacks nothing."""
    return json.dumps(truths(case), indent=1, allow_nan=False) + "\n"


def truths(case: Case) -> list[dict[str, Any]]:
    return [
        {
            "effect": truth.effect,
            "place": truth.place,
            "axis": truth.axis,
            "values": truth.values,
            "unseen": truth.unseen,
        }
        for truth in case.truth
    ]
