"""`session.json`: summary of a session's log for readers that do not fold it; derived from the log."""

from pathlib import Path
from typing import Any

from study.errors import StudyError
from study.store.disk.json_document import read_json

SUMMARY_NAME = "session.json"
SUMMARY_FORMAT, SUMMARY_VERSION = "hapteq-session-summary", 1


def read_summary(folder: Path) -> dict[str, Any] | None:
    """The summary without provenance; None if there is no readable one."""
    try:
        summary = read_json(folder / SUMMARY_NAME, SUMMARY_FORMAT, SUMMARY_VERSION)
    except StudyError:
        return None
    summary.pop("provenance", None)
    return summary


def read_closed_and_presentations(summary: dict[str, Any] | None) -> tuple[bool, int]:
    """Whether the session was closed when the summary was written, and the number of presentations in its log."""
    if summary is None:
        return False, 0
    presentations = summary.get("presentations")
    return summary.get("closed") is True, presentations if isinstance(presentations, int) else 0
