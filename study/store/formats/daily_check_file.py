"""Result of a daily check of a device: the format `hapteq-daily-check`, version 1 (JSON).

A daily check compares the friction, gain, response and noise in a recording of today with those in an accepted earlier
recording (the baseline). Called by `study.workflows.checks.daily_check`, and by `hapteq validate` and `hapteq show`.
"""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import gather_provenance

FORMAT, VERSION = "hapteq-daily-check", 1
"""Name and version of the format, written into every file."""


@dataclass(frozen=True, slots=True)
class DailyCheck:
    """Result of a daily check. The fields are the keys of the file."""

    device: str
    """Name of the device."""
    details: str
    """Serial number, firmware and SDK version of the device, in words."""
    utc: str
    """Time of the check (UTC, ISO 8601)."""
    passed: bool
    """Whether no quantity changed beyond its limit."""
    sentences: tuple[str, ...]
    """One sentence for each kind of change, as shown to the user; or why the check was aborted."""
    changes: tuple[dict[str, Any], ...]
    """The compared quantities: kind, axis, value of the baseline and of today, standard error, limit, unit, whether it
    changed, and band."""
    recording: str
    """Name of today's recording, in the same folder; empty where the check was aborted before the recording was
    written."""
    recording_sha256: str
    """SHA-256 of that file, hexadecimal; empty where `recording` is empty."""
    baseline_sha256: str
    """SHA-256 of the accepted recording, hexadecimal."""


def write_daily_check(path: Path, check: DailyCheck) -> None:
    """Write the result of a daily check. Raises AlreadyExistsError where the file exists, CannotWriteError where it
    cannot be written."""
    write_json(path, FORMAT, VERSION, asdict(check), gather_provenance())


def read_daily_check(path: Path) -> DailyCheck:
    """Read the result of a daily check. Raises CannotReadError where the file cannot be read, UnusableFileError where
    it is of another format or version, lacks a field, or device, utc or passed has a wrong type; other types are not
    checked."""
    document = read_json(path, FORMAT, VERSION)
    try:
        values = {field.name: document[field.name] for field in fields(DailyCheck)}
        if not isinstance(values["passed"], bool) or not all(
            isinstance(values[name], str) for name in ("device", "utc")
        ):
            raise TypeError("device and utc must be texts, passed true or false")
        return DailyCheck(**{**values, "sentences": tuple(values["sentences"]), "changes": tuple(values["changes"])})
    except (KeyError, TypeError) as error:
        raise UnusableFileError(path, "daily check", (f"it has no proper {error}",)) from error
