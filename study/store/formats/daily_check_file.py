"""Result of a daily check of a device: the format `hapteq-daily-check`, version 1 (JSON).

A daily check compares the friction, gain, response and noise in a recording of today with those in an accepted earlier
recording (the baseline).
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from study.store.disk.json_document import read_record, write_json
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
    """Time at which the check ended (UTC, ISO 8601)."""
    passed: bool
    """Whether each quantity was measured accurately enough, and none changed beyond its limit."""
    sentences: tuple[str, ...]
    """On each kind of change, in words; or why the check was aborted."""
    changes: tuple[dict[str, Any], ...]
    """The compared quantities (`analysis.device_change.compare_measurements.Change`); empty for an aborted check."""
    recording: str
    """Name of today's recording, in the same folder; empty where there is none."""
    recording_sha256: str
    """Hexadecimal; empty where `recording` is empty."""
    baseline_sha256: str
    """Of the accepted recording, hexadecimal."""


def write_daily_check(path: Path, check: DailyCheck) -> None:
    """Write the result of a daily check. Raises AlreadyExistsError where the file exists, CannotWriteError where it
    cannot be written, ValueError where `changes` holds NaN or infinity."""
    write_json(path, FORMAT, VERSION, asdict(check), gather_provenance())


def read_daily_check(path: Path) -> DailyCheck:
    """Read the result of a daily check. Raises CannotReadError where the file cannot be read, UnusableFileError where
    it is of another format or version, lacks a field, or a field has a wrong type."""
    return read_record(path, FORMAT, VERSION, "daily check", TypeAdapter(DailyCheck))
