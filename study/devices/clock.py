"""Clock of a session: real time, or virtual time, which lets a simulated session run faster than real time.

`Clock` is the interface. The code of a session takes the clock as an argument, so that the same code runs in real time
and in virtual time.
"""

import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Protocol


class Clock(Protocol):
    """Interface of the clock of a session: monotonic time, date and time (UTC), and sleep."""

    @property
    def virtual(self) -> bool:
        """Whether time passes only by `sleep`, as in `VirtualClock`."""
        ...

    def now_s(self) -> float:
        """Time (s) from an arbitrary origin; never decreases."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait for this time (s); returns at once for zero or less."""
        ...

    def utc(self) -> str:
        """Date and time, UTC, ISO 8601, in milliseconds."""
        ...


class RealClock:
    """Clock of the system: `time.monotonic`, `time.sleep`, and UTC in milliseconds."""

    virtual = False

    def now_s(self) -> float:
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        if seconds > 0:
            time.sleep(seconds)

    def utc(self) -> str:
        return datetime.now(UTC).isoformat(timespec="milliseconds")


class VirtualClock:
    """Time that passes only when the program calls `sleep`. start: date and time at its origin; None = now. A device
    whose ticks must run during a sleep registers a listener (`study.devices.drive.virtual_drive`)."""

    virtual = True

    def __init__(self, start: datetime | None = None) -> None:
        self._start = start if start is not None else datetime.now(UTC)
        self._now_s = 0.0
        self._listeners: list[Callable[[float], None]] = []

    def now_s(self) -> float:
        """Time (s) slept so far."""
        return self._now_s

    def sleep(self, seconds: float) -> None:
        """Advance the time at once by `seconds`, then call each listener; nothing for zero or less."""
        if seconds <= 0:
            return
        self._now_s += seconds
        for listener in tuple(self._listeners):
            listener(self._now_s)

    def utc(self) -> str:
        """Date and time of the start plus the time slept, UTC, ISO 8601, in milliseconds."""
        return (self._start + timedelta(seconds=self._now_s)).isoformat(timespec="milliseconds")

    @classmethod
    def resume_at(cls, utc: str) -> "VirtualClock":
        """Make a virtual clock that starts at `utc` (ISO 8601), or at the present time if that is later. The time in
        the log of a simulated session may be later than real time, and must not go back when the session is resumed."""
        return cls(max(datetime.now(UTC), datetime.fromisoformat(utc)))

    def add_listener(self, listener: Callable[[float], None]) -> None:
        """Add a listener: `listener(now_s)` is called after each `sleep` that advances the time."""
        self._listeners.append(listener)

    def remove_listener(self, listener: Callable[[float], None]) -> None:
        """Remove a listener. Raises ValueError for an unknown one."""
        self._listeners.remove(listener)
