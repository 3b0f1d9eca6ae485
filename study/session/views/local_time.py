"""Format logged UTC times as local time with the offset from UTC, for screens, command-line tables and messages.

The time zone is an argument, such as `study.local_clock.convert_to_machine_zone`.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Literal

Zone = Callable[[datetime], datetime]
"""Converts a time with any UTC offset to local time with its offset, daylight saving time included."""

TimePrecision = Literal["minutes", "seconds"]
"""Smallest unit of a time that is shown."""


def to_utc(time: datetime) -> datetime:
    """Convert a time to UTC; a time without offset is taken as the computer's local time."""
    return time.astimezone(UTC)


def format_time_in_zone(utc: str, zone: Zone, precision: TimePrecision = "minutes") -> str:
    """Format date, time and offset, such as "2026-11-22 14:05 +01:00".

    utc: ISO 8601; without an offset it is taken as UTC. A text that cannot be converted is returned without
    surrounding blanks.
    """
    return " ".join(split_time_in_zone(utc, zone, precision)).strip()


def split_time_in_zone(utc: str, zone: Zone, precision: TimePrecision = "seconds") -> tuple[str, str, str]:
    """Convert a time (ISO 8601, UTC where it states no offset) to (date, time, offset) in local time; (the text, "",
    "") where it cannot be converted."""
    try:
        time = datetime.fromisoformat(utc)
        local_time = zone(time if time.tzinfo is not None else time.replace(tzinfo=UTC))
    except (ValueError, OverflowError, OSError):
        return utc, "", ""
    offset = local_time.strftime("%z")
    return local_time.date().isoformat(), local_time.time().isoformat(precision), f"{offset[:3]}:{offset[3:5]}"


def format_times_in_zone(utc_times: Sequence[str], zone: Zone) -> tuple[str, tuple[str, ...]]:
    """Format UTC times as a column of a table. Returns the most frequent offset, for the header ("" without one), and
    each time, with its own offset where that differs, such as in daylight saving time."""
    local_times = [split_time_in_zone(utc, zone, "minutes") for utc in utc_times]
    offsets = Counter(offset for _, _, offset in local_times if offset)
    common_offset = offsets.most_common(1)[0][0] if offsets else ""
    return common_offset, tuple(
        " ".join((date, time, offset if offset != common_offset else "")).strip() for date, time, offset in local_times
    )
