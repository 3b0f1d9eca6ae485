"""Readings while nothing moves: whoever wants one asks the loop's thread, and never enters the driver itself.

So a rig is driven by one thread even then, a stimulus that begins meanwhile cannot collide with the reading, and a
driver that hangs keeps nobody waiting for longer than `PATIENCE_S`.
"""

import threading
from collections.abc import Callable

from study.devices.clock import Clock

PATIENCE_S = 0.1
"""A reading takes well below a millisecond; a busy computer is late by some 10 ms."""


class _Request:
    def __init__(self, until_s: float) -> None:
        self.until_s = until_s
        self.taken = threading.Event()


class Glances:
    """One request at a time: who asks while another waits gets the same reading."""

    def __init__(self, clock: Clock, wake: Callable[[], None]) -> None:
        """`wake` lets the loop's thread look whether something is `wanted`."""
        self._clock = clock
        self._wake = wake
        self._asking = threading.Lock()
        self._request: _Request | None = None

    def ask(self) -> bool:
        """Wait for a reading. False where none came in time; a request that is late already is not waited for."""
        with self._asking:
            request = self._request
            if request is None or request.taken.is_set():
                self._request = request = _Request(self._clock.now_s() + PATIENCE_S)
        self._wake()
        return request.taken.wait(min(PATIENCE_S, max(0.0, request.until_s - self._clock.now_s())))

    @property
    def wanted(self) -> bool:
        return self._request is not None and not self._request.taken.is_set()

    def taken(self) -> None:
        """To be said by the loop's thread after a reading."""
        if self._request is not None:
            self._request.taken.set()
