"""`session.json`: what a session's log comes to, for those who do not fold it. Made from the log, as the tables are."""

from pathlib import Path
from typing import Any

from study.errors import StudyError
from study.store.disk.json_document import read_json

SUMMARY_NAME = "session.json"
SUMMARY_FORMAT, SUMMARY_VERSION = "hapteq-session-summary", 1


def read_summary(folder: Path) -> dict[str, Any] | None:
    """None where there is none, or none that can be read. Without its provenance."""
    try:
        summary = read_json(folder / SUMMARY_NAME, SUMMARY_FORMAT, SUMMARY_VERSION)
    except StudyError:
        return None
    summary.pop("provenance", None)
    return summary


def closed_and_presentations(summary: dict[str, Any] | None) -> tuple[bool, int]:
    """Whether the session was closed when this was written, and how many presentations its log had."""
    if summary is None:
        return False, 0
    presentations = summary.get("presentations")
    return summary.get("closed") is True, presentations if isinstance(presentations, int) else 0
