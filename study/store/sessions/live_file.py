"""`live.json`: live state of a running session for its viewers. Replaced atomically several times a second."""

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
LIVE_FORMAT = "hapteq-live"
LIVE_VERSION = 1

_ACTIVITIES = get_args(Activity)
"""All activities that a reader accepts."""
_LARGEST_BYTES = 1 << 16
"""Largest file that is read; ours have about a kilobyte."""


def write_live(folder: Path, live: Live) -> None:
    """Write the live values, at most about four times a second. Never raises: a session must not end because it cannot
    be watched. One writer: the holder of the session's lock."""
    values = {name: _finite(value) for name, value in asdict(live).items()}
    text = json.dumps({"format": LIVE_FORMAT, "version": LIVE_VERSION, **values}, allow_nan=False)
    part = folder / f".{LIVE_NAME}.part"
    # No fsync: only the current state matters, and a slow disk would delay the session.
    with suppress(OSError):
        write_private(part, f"{text}\n".encode())
        part.replace(folder / LIVE_NAME)


def remove_live(folder: Path) -> None:
    """Remove the file of an earlier sitting. Never raises."""
    with suppress(OSError):
        (folder / LIVE_NAME).unlink()


def read_live(folder: Path) -> Live | None:
    """The live state; None if there is no usable one. Never raises."""
    try:
        document = load_json(read_regular(folder / LIVE_NAME, _LARGEST_BYTES))
    except (OSError, ValueError):
        return None
    if not isinstance(document, dict):
        return None
    if (document.pop("format", None), document.pop("version", None)) != (LIVE_FORMAT, LIVE_VERSION):
        return None
    return Live(**document) if _fits(document) else None


def _fits(values: dict[str, Any]) -> bool:
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
        and all(kinds[name] == (bool,) or not isinstance(value, bool) for name, value in values.items())
        and values["activity"] in _ACTIVITIES
        and all(_is_time(values[name]) for name in ("utc", "since_utc"))
    )


def _is_time(text: str) -> bool:
    try:
        return bool(utc_time(text))
    except ValueError:
        return False


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
