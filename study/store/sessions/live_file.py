"""Read and write `live.json`: the present state of a running session, for programs that display it.

The file is replaced atomically, so that a reader never sees an incomplete one. Its fields are those of
`study.session.watching.live_state.LiveState`. No result depends on the file: errors of reading and writing are ignored.
"""

import json
import math
from contextlib import suppress
from dataclasses import asdict, fields
from pathlib import Path

from pydantic import TypeAdapter

from study.regular_file import read_regular
from study.session.facts.fact_types import check_utc_time
from study.session.watching.live_state import LiveState
from study.store.disk.privacy import write_private
from study.store.disk.strict_json import load_json

LIVE_NAME = "live.json"
"""Name of the file in the session's folder."""
LIVE_FORMAT = "hapteq-live"
LIVE_VERSION = 1

_KEYS = {"format", "version", *(field.name for field in fields(LiveState))}
"""Keys of the document; files of older versions lack some, which then have their defaults."""
_VALIDATOR = TypeAdapter(LiveState)
_MAX_FILE_BYTES = 1 << 16
"""Largest file that is read (bytes). Chosen, far above the size of a live state."""


def write_live(folder: Path, live_state: LiveState) -> None:
    """Write the live state into the session's folder, replacing the previous file; NaN and infinity become null. An
    OSError is ignored: a session must not end because its state cannot be displayed. Call only with the session's lock
    held (`session_lock`), because the name of the temporary file is fixed."""
    values = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in asdict(live_state).items()
    }
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
        if not isinstance(document, dict) or not document.keys() <= _KEYS:
            return None
        if (document.pop("format", None), document.pop("version", None)) != (LIVE_FORMAT, LIVE_VERSION):
            return None
        live_state = _VALIDATOR.validate_json(json.dumps(document), strict=True)
        check_utc_time(live_state.utc)
        check_utc_time(live_state.since_utc)
    except (OSError, ValueError):
        return None
    return live_state
