"""Clock port: real time, or virtual time in which a session of half an hour runs in a second."""

import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Protocol


class Clock(Protocol):
    """Interface of the clock of a session: monotonic time, UTC and sleep."""

    @property
    def virtual(self) -> bool:
        """Whether time passes only by `sleep`."""
        ...

    def now_s(self) -> float:
        """Seconds from an arbitrary start; never goes back."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let this much time pass (s); none for zero or less."""
        ...

    def utc(self) -> str:
        """Date and time, ISO 8601."""
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
    """Time that passes only when the program sleeps. What must act meanwhile (a device) listens."""

    virtual = True

    def __init__(self, start: datetime | None = None) -> None:
        self._start = start if start is not None else datetime.now(UTC)
        self._now_s = 0.0
        self._listeners: list[Callable[[float], None]] = []

    def now_s(self) -> float:
        return self._now_s

    def sleep(self, seconds: float) -> None:
        """Advance the time at once, then call each listener."""
        if seconds <= 0:
            return
        self._now_s += seconds
        for listener in tuple(self._listeners):
            listener(self._now_s)

    def utc(self) -> str:
        return (self._start + timedelta(seconds=self._now_s)).isoformat(timespec="milliseconds")

    @classmethod
    def not_before(cls, utc: str) -> "VirtualClock":
        """The same clock from this time on, or from now where that is later: a simulated session runs ahead of real
        time."""
        return cls(max(datetime.now(UTC), datetime.fromisoformat(utc)))

    def listen(self, listener: Callable[[float], None]) -> None:
        """`listener(now_s)` is called after every passing of time."""
        self._listeners.append(listener)

    def forget(self, listener: Callable[[float], None]) -> None:
        """Call this listener no more. Raises ValueError for an unknown one."""
        self._listeners.remove(listener)
