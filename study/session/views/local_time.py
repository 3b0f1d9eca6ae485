"""Times of a log as a person reads them: by the clock of the place, with its offset from UTC.

Logs, tables and JSON keep UTC. The zone is a value from outside, because this package does not read the machine's:
`study.local_clock.machine_zone` is what screens and commands pass.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Literal

Zone = Callable[[datetime], datetime]
"""Converts a moment with any UTC offset to the clock of a place, summer time included."""

Detail = Literal["minutes", "seconds"]
"""Last part of a time that is shown."""


def in_utc(time: datetime) -> datetime:
    """The zone of logs and JSON."""
    return time.astimezone(UTC)


def local_time(utc: str, zone: Zone, to: Detail = "minutes") -> str:
    """Date, time and offset, such as "2026-11-22 14:05 +01:00".

    utc: ISO 8601; without an offset it is UTC. What is no time, or none that can be converted, stays as it is.
    """
    return " ".join(local_parts(utc, zone, to)).strip()


def local_parts(utc: str, zone: Zone, to: Detail = "seconds") -> tuple[str, str, str]:
    """(date, time, offset) by the clock of the zone. What cannot be converted is (its text, "", "")."""
    try:
        time = datetime.fromisoformat(utc)
        local = zone(time if time.tzinfo is not None else time.replace(tzinfo=UTC))
    except (ValueError, OverflowError, OSError):
        return utc, "", ""
    offset = local.strftime("%z")
    return local.date().isoformat(), local.time().isoformat(to), f"{offset[:3]}:{offset[3:5]}"


def local_column(utcs: Sequence[str], zone: Zone) -> tuple[str, tuple[str, ...]]:
    """Times as a column: their most frequent offset for the header, and each time, with its own offset where that
    differs, such as in the other half of the year."""
    parts = [local_parts(utc, zone, "minutes") for utc in utcs]
    offsets = Counter(offset for _, _, offset in parts if offset)
    usual = offsets.most_common(1)[0][0] if offsets else ""
    return usual, tuple(
        " ".join((date, time, offset if offset != usual else "")).strip() for date, time, offset in parts
    )
