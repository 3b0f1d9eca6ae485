"""Local time of this computer, for texts that people read; logs and data keep UTC."""

from datetime import UTC, datetime

from study.session.views.local_time import format_time_in_zone


def convert_to_machine_zone(time: datetime) -> datetime:
    """Convert a moment to the local time of this computer, summer time included; a `local_time.Zone`. A moment without
    UTC offset is taken as local time.

    Raises ValueError, OverflowError or OSError for a moment that cannot be converted.
    """
    return time.astimezone()


def format_local_now() -> str:
    """Format the current local time, such as "2026-11-22 14:05 +01:00"."""
    return format_time_in_zone(datetime.now(UTC).isoformat(), convert_to_machine_zone)
