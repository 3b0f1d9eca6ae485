"""Read and write `live.json`: the present state of a running session, for programs that display it.

The file is replaced atomically, so that a reader never sees an incomplete one. Its fields are those of
`study.session.watching.live_state.LiveState`. No result depends on the file: errors of reading and writing are ignored.
"""

import json
import math
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, get_args

from study.regular_file import read_regular
from study.session.facts.fact_types import check_utc_time
from study.session.watching.live_state import Activity, LiveState
from study.store.disk.privacy import write_private
from study.store.disk.strict_json import load_json

LIVE_NAME = "live.json"
"""Name of the file in the session's folder."""
LIVE_FORMAT = "hapteq-live"
LIVE_VERSION = 1

_ACTIVITIES = get_args(Activity)
_MAX_FILE_BYTES = 1 << 16
"""Largest file that is read (bytes). Chosen, far above the size of a live state."""


def write_live(folder: Path, live_state: LiveState) -> None:
    """Write the live state into the session's folder, replacing the previous file; NaN and infinity become null. An
    OSError is ignored: a session must not end because its state cannot be displayed. Call only with the session's lock
    held (`session_lock`), because the name of the temporary file is fixed."""
    values = {name: _replace_nonfinite(value) for name, value in asdict(live_state).items()}
    text = json.dumps({"format": LIVE_FORMAT, "version": LIVE_VERSION, **values}, allow_nan=False)
    temporary_path = folder / f".{LIVE_NAME}.part"
    # No fsync: only the current state matters, and a slow disk would delay the session.
    with suppress(OSError):
        write_private(temporary_path, f"{text}\n".encode())
        temporary_path.replace(folder / LIVE_NAME)


def remove_live(folder: Path) -> None:
    """Remove the live state of an earlier sitting from the session's folder, if there is one. An OSError is ignored."""
    with suppress(OSError):
        (folder / LIVE_NAME).unlink()


def read_live(folder: Path) -> LiveState | None:
    """Read the live state from a session's folder; None if the file is missing, unreadable, larger than
    `_MAX_FILE_BYTES`, of another format or version, or has an invalid field."""
    try:
        document = load_json(read_regular(folder / LIVE_NAME, _MAX_FILE_BYTES))
    except (OSError, ValueError):
        return None
    if not isinstance(document, dict):
        return None
    if (document.pop("format", None), document.pop("version", None)) != (LIVE_FORMAT, LIVE_VERSION):
        return None
    return LiveState(**document) if _has_valid_fields(document) else None


def _has_valid_fields(values: dict[str, Any]) -> bool:
    """Whether the values have the fields of `LiveState` and no others, with valid types, times and activity."""
    # Files of older versions lack these two fields, which then have their defaults.
    values = {"monotonic_s": None, "telemetry": "", **values}
    number_types = (int, float)
    types_by_field: dict[str, tuple[type, ...]] = {
        "utc": (str,),
        "activity": (str,),
        "since_utc": (str,),
        "fault": (str,),
        "offset_mm": (*number_types, type(None)),
        "handle_ready": (bool,),
        "acceleration_mps2": (*number_types, type(None)),
        "sensor_clipped": (bool,),
        "missed_ticks": (int,),
        "monotonic_s": (*number_types, type(None)),
        "telemetry": (str,),
    }
    return (
        values.keys() == types_by_field.keys()
        and all(isinstance(value, types_by_field[name]) for name, value in values.items())
        # JSON distinguishes true from 1, but isinstance(True, int) holds in Python.
        and all(types_by_field[name] == (bool,) or not isinstance(value, bool) for name, value in values.items())
        and values["activity"] in _ACTIVITIES
        and all(_is_utc_time(values[name]) for name in ("utc", "since_utc"))
    )


def _is_utc_time(text: str) -> bool:
    """Whether the text is a valid time with UTC offset (`check_utc_time`)."""
    try:
        return bool(check_utc_time(text))
    except ValueError:
        return False


def _replace_nonfinite(value: Any) -> Any:
    """Replace NaN and infinity, which JSON does not have, by None."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
