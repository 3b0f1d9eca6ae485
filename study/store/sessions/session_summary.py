"""Read `session.json`, the summary of a session, without evaluating the whole log.

The summary is derived from the log and states what the log contained when it was written; a comparison with it shows
whether the end of the log was lost later.
"""

from pathlib import Path
from typing import Any

from study.errors import StudyError
from study.store.disk.json_document import read_json

SUMMARY_NAME = "session.json"
"""Name of the file in the session's folder."""
SUMMARY_FORMAT, SUMMARY_VERSION = "hapteq-session-summary", 1
"""Name and version of the format."""


def read_summary(folder: Path) -> dict[str, Any] | None:
    """Read the summary without its provenance; None without a readable file of this format and version."""
    try:
        summary = read_json(folder / SUMMARY_NAME, SUMMARY_FORMAT, SUMMARY_VERSION)
    except StudyError:
        return None
    summary.pop("provenance", None)
    return summary


def read_closed_and_presentations(summary: dict[str, Any] | None) -> tuple[bool, int]:
    """Read from a summary whether the session was closed when it was written, and the number of stimulus presentations
    in the log then. False and 0 without a summary."""
    if summary is None:
        return False, 0
    presentations = summary.get("presentations")
    return summary.get("closed") is True, presentations if isinstance(presentations, int) else 0
