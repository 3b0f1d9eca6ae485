"""Local time of this computer, for texts that a person reads."""

from datetime import UTC, datetime

from study.session.views.local_time import local_time


def machine_zone(time: datetime) -> datetime:
    """A `study.session.views.local_time.Zone`: of this computer, summer time included.

    Raises ValueError, OverflowError or OSError for moments that it cannot convert.
    """
    return time.astimezone()


def local_now() -> str:
    """Local time now, such as "2026-11-22 14:05 +01:00"."""
    return local_time(datetime.now(UTC).isoformat(), machine_zone)
