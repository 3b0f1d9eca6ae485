"""Local time of this computer, for texts that people read. Logs and data keep UTC."""

from datetime import UTC, datetime

from study.session.views.local_time import format_time_in_zone


def machine_zone(time: datetime) -> datetime:
    """Convert a moment to the local time of this computer, summer time included; a
    `study.session.views.local_time.Zone`.

    Raises ValueError, OverflowError or OSError for a moment that cannot be converted.
    """
    return time.astimezone()


def local_now() -> str:
    """Local time now, such as "2026-11-22 14:05 +01:00"."""
    return format_time_in_zone(datetime.now(UTC).isoformat(), machine_zone)
