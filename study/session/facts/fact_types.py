"""Types of the fields of logged events: constraints on values, which pydantic checks when a log is written and read.

The bounds are chosen wider than the values of any device or person. They keep powers finite, numbers printable, times
comparable and files inside the session's folder, so that readers do not fail on a logged value.
"""

import re
from datetime import datetime
from typing import Annotated

from pydantic import AfterValidator, Field

_ISO_8601_PATTERN = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,6})?(Z|[+-]\d\d:\d\d)", re.ASCII)
"""Matches a date, time and UTC offset in ASCII digits."""
_ACCEPTED_YEARS = range(1970, 3000)
"""Years for which conversion to local time and differences cannot leave the range of `datetime`."""

_RECORDING_PATH_PATTERN = re.compile(r"recordings/[A-Za-z0-9][A-Za-z0-9_.-]{0,199}\.h5", re.ASCII)
"""Matches the path of a recording inside a session's folder."""
_FILE_NAME_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,199}", re.ASCII)
"""Matches the name of a file without a path, as hapteq writes it."""


def check_utc_time(text: str) -> str:
    """Return the text unchanged. Raises ValueError unless it is a valid date and time with UTC offset, in the accepted
    years."""
    if not _ISO_8601_PATTERN.fullmatch(text):
        raise ValueError("is no time with date and UTC offset in ISO 8601")
    if datetime.fromisoformat(text).year not in _ACCEPTED_YEARS:
        raise ValueError(f"lies outside the years {_ACCEPTED_YEARS.start} to {_ACCEPTED_YEARS.stop - 1}")
    return text


def _check_recording_path(text: str) -> str:
    """Return the text unchanged. Raises ValueError unless it is the path of a recording (`_RECORDING_PATH_PATTERN`)."""
    if not _RECORDING_PATH_PATTERN.fullmatch(text):
        raise ValueError("is no file in the session's folder recordings")
    return text


def _check_file_name(text: str) -> str:
    """Return the text unchanged. Raises ValueError unless it is the name of a file (`_FILE_NAME_PATTERN`)."""
    if not _FILE_NAME_PATTERN.fullmatch(text):
        raise ValueError("is no file name in the session's folder")
    return text


UtcTime = Annotated[str, AfterValidator(check_utc_time)]
"""Date, time and UTC offset, ISO 8601. `datetime.fromisoformat` reads it as an aware datetime."""
Count = Annotated[int, Field(ge=0, le=10**9)]
"""A number of items, 0 or more."""
Index = Annotated[int, Field(ge=0, le=10**6)]
"""Index of a run, a trial or an attempt, from 0."""
Seed = Annotated[int, Field(ge=0, lt=2**256)]
"""Seed of random numbers, at most 256 bits."""
Seconds = Annotated[float, Field(ge=0, le=1e9)]
"""A duration (s). In the field `monotonic_s`, a reading of the computer's monotonic clock at the time `utc`, of which
only differences within a sitting have a meaning; null where it was not logged."""
FrequencyHz = Annotated[float, Field(gt=0, le=1e6)]
"""A frequency above 0 (Hz)."""
ForceN = Annotated[float, Field(ge=0, le=1e3)]
"""Magnitude of a force (N)."""
LevelDb = Annotated[float, Field(ge=-1e4, le=1e4)]
"""A level in dB; the field states the reference."""
AngleDeg = Annotated[float, Field(ge=-1e4, le=1e4)]
"""An angle in degrees."""
Measured = Annotated[float, Field(ge=-1e9, le=1e9)]
"""A signed value that was measured or computed, in the field's unit."""
Magnitude = Annotated[float, Field(ge=0, le=1e9)]
"""A value that cannot be negative, in the field's unit."""
Positive = Annotated[float, Field(gt=0, le=1e9)]
"""A value above 0, in the field's unit."""
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
"""SHA-256 in 64 lower-case hexadecimal digits."""
RecordingPath = Annotated[str, AfterValidator(_check_recording_path)]
"""`recordings/<name>.h5`, relative to the session's folder."""
FileName = Annotated[str, AfterValidator(_check_file_name)]
"""Name of a file directly in the session's folder."""
