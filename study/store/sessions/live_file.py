"""Read and write `live.json`: the present state of a running session, for programs that display it.

The session replaces the file atomically a few times a second, so that a reader never sees half of it. The fields are
those of `study.session.watching.live.Live`. No result depends on the file: errors of reading and writing are ignored.
"""

import json
import math
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, get_args

from study.regular_file import read_regular
from study.session.facts.fact_types import utc_time
from study.session.watching.live import Activity, Live
from study.store.disk.privacy import write_private
from study.store.disk.strict_json import load_json

LIVE_NAME = "live.json"
"""Name of the file in the session's folder."""
LIVE_FORMAT = "hapteq-live"
LIVE_VERSION = 1

_ACTIVITIES = get_args(Activity)
"""Activities that a reader accepts."""
_LARGEST_BYTES = 1 << 16
"""Largest file that is read, in bytes; a file written by hapteq has about 1 kB."""


def write_live(folder: Path, live: Live) -> None:
    """Replace the live state; values that are not finite become null. An OSError is ignored, because a session must not
    end only because its state cannot be displayed. Only the holder of the session's lock may call it."""
    values = {name: _finite(value) for name, value in asdict(live).items()}
    text = json.dumps({"format": LIVE_FORMAT, "version": LIVE_VERSION, **values}, allow_nan=False)
    part = folder / f".{LIVE_NAME}.part"
    # No fsync: only the current state matters, and a slow disk would delay the session.
    with suppress(OSError):
        write_private(part, f"{text}\n".encode())
        part.replace(folder / LIVE_NAME)


def remove_live(folder: Path) -> None:
    """Remove the file of an earlier sitting, if there is one. An OSError is ignored."""
    with suppress(OSError):
        (folder / LIVE_NAME).unlink()


def read_live(folder: Path) -> Live | None:
    """The live state; None if the file is missing, unreadable, or not of this format and version. Never raises."""
    try:
        document = load_json(read_regular(folder / LIVE_NAME, _LARGEST_BYTES))
    except (OSError, ValueError):
        return None
    if not isinstance(document, dict):
        return None
    if (document.pop("format", None), document.pop("version", None)) != (LIVE_FORMAT, LIVE_VERSION):
        return None
    return Live(**document) if _has_valid_fields(document) else None


def _has_valid_fields(values: dict[str, Any]) -> bool:
    """Whether the values have exactly the fields of `Live`, with valid types, times and activity."""
    # Files of older versions lack these two fields, which then have their defaults.
    values = {"monotonic_s": None, "telemetry": "", **values}
    number = (int, float)
    kinds: dict[str, tuple[type, ...]] = {
        "utc": (str,),
        "activity": (str,),
        "since_utc": (str,),
        "fault": (str,),
        "offset_mm": (*number, type(None)),
        "handle_ready": (bool,),
        "acceleration_mps2": (*number, type(None)),
        "sensor_clipped": (bool,),
        "missed_ticks": (int,),
        "monotonic_s": (*number, type(None)),
        "telemetry": (str,),
    }
    return (
        values.keys() == kinds.keys()
        and all(isinstance(value, kinds[name]) for name, value in values.items())
        # JSON distinguishes true from 1, but isinstance(True, int) holds in Python.
        and all(kinds[name] == (bool,) or not isinstance(value, bool) for name, value in values.items())
        and values["activity"] in _ACTIVITIES
        and all(_is_time(values[name]) for name in ("utc", "since_utc"))
    )


def _is_time(text: str) -> bool:
    """Whether the text is a valid UTC time."""
    try:
        return bool(utc_time(text))
    except ValueError:
        return False


def _finite(value: Any) -> Any:
    """The value, or None for NaN and infinity, which JSON does not have."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
