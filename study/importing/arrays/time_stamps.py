"""Read dates and clock times (`2024-03-01T12:00:00.123+01:00`, `12:00:00.123`) as seconds, for tables of an import.

A field holds a date, a clock time with or without an offset from UTC, or both. Where one column holds dates and another
clock times, they are added. In dates that do not begin with the year, day and month cannot be distinguished: they are
accepted only where all dates are the same. The year is the part with four digits."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as pd

SecondsArray = npt.NDArray[np.float64]
"""Times (n,) in seconds."""

_DATE = r"\d{4}(?P<between>[-/.])\d{1,2}(?P=between)\d{1,2}|\d{1,2}(?P<mark>[-/.])\d{1,2}(?P=mark)\d{4}"
"""Date with the year first or last, and the same separator twice."""
_CLOCK = r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2}(?:[.,]\d+|:\d{3})?)\s?(?P<half>[AaPp]\.?[Mm]\.?)?"
"""Hour, minute, and second with a fraction after a point, a comma or a colon; AM or PM where present."""
_ZONE = r"\s?(?P<zone>Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)"
"""Time zone: UTC, or an offset from it."""
_STAMP = re.compile(rf"(?:(?P<date>{_DATE})(?:[T ]\s*|$))?(?:{_CLOCK}(?:{_ZONE})?)?")
"""Date, clock time, or both; an empty text matches too."""
DAY_S, HOUR_S = 86400.0, 3600.0
"""Length of a day and of an hour (s)."""
STAMP_NOTATIONS = (
    "dates and clock times are understood as 2024-03-01T12:00:00.123, with or without a zone, or 12:00:00.123"
)
"""Notations that are read, for messages."""


@dataclass(frozen=True, slots=True)
class StampColumn:
    """Time stamps of one column: dates, clock times, or both."""

    seconds: npt.NDArray[np.float64]
    """(n,), since midnight of the date in the first filled field, or of any day without dates; in UTC where a zone is
    stated; NaN where the field is empty."""
    has_date: bool
    has_clock: bool
    first: str
    """Text of the first filled field."""


def is_stamp(field: str) -> bool:
    """Whether a field is a date, a clock time, or both."""
    return bool(field) and _STAMP.fullmatch(field) is not None


def read_stamps(fields: "pd.Series[Any]") -> StampColumn | None:
    """Read the time stamps of a column of texts; None where no field is filled, where one is no stamp, or where not all
    are of the same kind (date, clock time, both). fields: texts, missing ones as NaN or None. Raises ValueError for
    dates of ambiguous order, for stamps that do not exist, and where only some have a time zone."""
    is_filled = fields.notna()
    filled_fields = fields[is_filled].str.strip()
    if filled_fields.empty or not filled_fields.map(is_stamp).all():
        return None
    parts = filled_fields.str.extract(_STAMP)
    has_date, has_clock = parts["date"].notna(), parts["hour"].notna()
    if has_date.any() != has_date.all() or has_clock.any() != has_clock.all():
        return None
    filled_seconds = np.zeros(len(filled_fields))
    if has_clock.all():
        filled_seconds += _compute_clock_s(filled_fields, parts)
    if has_date.all():
        filled_seconds += _compute_date_s(parts["date"])
    seconds = np.full(len(fields), np.nan)
    seconds[is_filled.to_numpy()] = filled_seconds
    return StampColumn(seconds, bool(has_date.all()), bool(has_clock.all()), str(filled_fields.iloc[0]))


def _compute_clock_s(filled_fields: "pd.Series[str]", parts: "pd.DataFrame") -> SecondsArray:
    """Compute the seconds (n,) since midnight, in UTC where a zone is stated. Raises ValueError for minutes or seconds
    above 59, for hours above 12 (AM) or 23 (PM), for times after 24:00 with a date, and where only some have a zone.
    filled_fields, parts: the fields, and the groups of `_STAMP` in them."""
    for index in np.flatnonzero((parts["minute"].astype(int) > 59) | (parts["second"].str[:2].astype(int) > 59)):
        raise ValueError(f"'{filled_fields.iloc[index]}' is no clock time, with more than 59 minutes or seconds")
    if parts["zone"].isna().any() != parts["zone"].isna().all():
        raise ValueError("some of its clock times have a zone, others none; write all with it, or all without")
    seconds = parts["second"].str.replace(r"[,:]", ".", regex=True).astype(float)
    hour = parts["hour"].astype(float)
    half_day = parts["half"].fillna("").str.lower().str[:1]
    # A clock time without a date and without AM or PM may be a time since a start, with any number of hours.
    highest_hour = np.select([half_day == "a", half_day == "p", parts["date"].notna()], [12.0, 23.0, 24.0], math.inf)
    # 24:00:00 is the end of a day (ISO 8601); no time comes after it.
    after_midnight = parts["date"].notna() & (hour == 24) & ((parts["minute"].astype(int) > 0) | (seconds > 0))
    for index in np.flatnonzero((hour > highest_hour) | after_midnight):
        raise ValueError(
            f"'{filled_fields.iloc[index]}' is no clock time: it has hour {hour.iloc[index]:g}; correct it"
        )
    hour = hour.where(half_day == "", hour % 12) + 12.0 * (half_day == "p")
    zone_s = parts["zone"].fillna("").map({zone: _parse_zone_s(zone) for zone in parts["zone"].fillna("").unique()})
    return np.asarray(hour * HOUR_S + parts["minute"].astype(float) * 60 + seconds - zone_s, dtype=np.float64)


def _parse_zone_s(zone: str) -> float:
    """Parse the offset of a zone from UTC (s), positive to the east; 0 for UTC, GMT, Z or an empty text."""
    digits = re.sub(r"\D", "", zone)
    offset_s = (int(digits[:2]) * 60 + int(digits[2:] or 0)) * 60.0 if digits else 0.0
    return -offset_s if zone.startswith("-") else offset_s


def _compute_date_s(dates: "pd.Series[str]") -> SecondsArray:
    """Compute the seconds (n,) from midnight of the first date to that of each date; seconds since 1970 would be
    resolved to 0.24 µs only (float64). Raises ValueError for several dates of ambiguous order, and for dates that do
    not exist."""
    date_s_by_text: dict[str, float] = {}  # no value for a single date of ambiguous order
    has_several_dates = dates.nunique() > 1
    for date in dates.unique():
        date_parts = [int(part) for part in re.split(r"\D", date)]
        if date_parts[0] < 1000 and has_several_dates:
            raise ValueError(f"'{date}' may be day and month or month and day; write dates as 2024-03-01")
        if date_parts[0] >= 1000:
            date_s_by_text[date] = _parse_day_s(date_parts, date)
    first_date_s = date_s_by_text.get(str(dates.iloc[0]), 0.0)
    return np.asarray(dates.map(lambda date: date_s_by_text.get(date, first_date_s) - first_date_s), dtype=np.float64)


def _parse_day_s(date_parts: list[int], date: str) -> float:
    """Convert a date (year, month, day) to seconds since 1970-01-01. Raises ValueError for a date that does not
    exist."""
    year, month, day = date_parts
    try:
        return float(np.datetime64(f"{year:04d}-{month:02d}-{day:02d}", "D").astype(np.int64)) * DAY_S
    except ValueError as error:
        raise ValueError(f"'{date}' is no date; write dates as 2024-03-01") from error


def join_stamps(columns: Mapping[str, StampColumn]) -> dict[str, StampColumn]:
    """Merge a single column of dates and a single column of clock times into one, under the name of the latter. In any
    other case, clock times without a date are counted into the next day where they fall by more than half a day."""
    dates = {name: column for name, column in columns.items() if not column.has_clock}
    clocks = {name: column for name, column in columns.items() if not column.has_date}
    merged_columns = dict(columns)
    if len(dates) == 1 and len(clocks) == 1:
        (day_name, date_column), (clock_name, clock_column) = *dates.items(), *clocks.items()
        del merged_columns[day_name]
        combined = StampColumn(
            date_column.seconds + clock_column.seconds, True, True, f"{date_column.first} {clock_column.first}"
        )
        return merged_columns | {clock_name: combined}
    for name, clock_column in clocks.items():
        finite_indices = np.flatnonzero(np.isfinite(clock_column.seconds))
        days_passed = np.zeros(len(clock_column.seconds))
        days_passed[finite_indices[1:]] = np.cumsum(np.diff(clock_column.seconds[finite_indices]) < -DAY_S / 2)
        merged_columns[name] = StampColumn(clock_column.seconds + days_passed * DAY_S, False, True, clock_column.first)
    return merged_columns
