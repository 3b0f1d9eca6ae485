"""Types of the fields of logged facts: constraints on values, so that no later reader can fail on them.

Bounds are wider than anything that a device or a person can do. They keep powers finite, numbers printable, times
comparable and files inside the session's folder.
"""

import re
from datetime import datetime
from typing import Annotated

from pydantic import AfterValidator, Field

_ISO_8601 = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,6})?(Z|[+-]\d\d:\d\d)", re.ASCII)
"""Date, time, and UTC offset; ASCII digits only."""
_YEARS = range(1970, 3000)
"""Conversion to local time and differences stay within what `datetime` can hold."""

_RECORDING = re.compile(r"recordings/[A-Za-z0-9][A-Za-z0-9_.-]{0,199}\.h5", re.ASCII)
"""Path of a recording within a session's folder: no way out of it."""
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,199}", re.ASCII)
"""Name without a path, as the project's own files have."""


def utc_time(text: str) -> str:
    """The text, unchanged. Raises ValueError unless it is a time with UTC offset that can be converted and
    subtracted."""
    if not _ISO_8601.fullmatch(text):
        raise ValueError("is no time with date and UTC offset in ISO 8601")
    if datetime.fromisoformat(text).year not in _YEARS:
        raise ValueError(f"lies outside the years {_YEARS.start} to {_YEARS.stop - 1}")
    return text


def _check_recording_path(text: str) -> str:
    if not _RECORDING.fullmatch(text):
        raise ValueError("is no file in the session's folder recordings")
    return text


def _check_file_name(text: str) -> str:
    if not _FILE_NAME.fullmatch(text):
        raise ValueError("is no file name in the session's folder")
    return text


UtcTime = Annotated[str, AfterValidator(utc_time)]
"""Date, time and UTC offset, ISO 8601. `datetime.fromisoformat` reads it as an aware datetime."""
Count = Annotated[int, Field(ge=0, le=10**9)]
"""A number of things, from 0."""
Index = Annotated[int, Field(ge=0, le=10**6)]
"""Index of a run, a trial or an attempt, from 0."""
Seed = Annotated[int, Field(ge=0, lt=2**256)]
"""Seed of random numbers: 256 bits."""
Seconds = Annotated[float, Field(ge=0, le=1e9)]
"""A duration; as `monotonic_s`, a reading of the computer's monotonic clock beside `utc`, which is meaningful only in
differences within a sitting (null where it was not logged)."""
FrequencyHz = Annotated[float, Field(gt=0, le=1e6)]
ForceN = Annotated[float, Field(ge=0, le=1e3)]
LevelDb = Annotated[float, Field(ge=-1e4, le=1e4)]
AngleDeg = Annotated[float, Field(ge=-1e4, le=1e4)]
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
