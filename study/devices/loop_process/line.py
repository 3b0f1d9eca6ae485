"""This side of a pipe to the loop's process. A thread writes and reads, so that a caller who is interrupted leaves no
half message behind, and waits no longer than it is willing to for a process that hangs."""

import contextlib
import sys
import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any

if sys.platform == "win32":
    from multiprocessing.connection import PipeConnection

    End = PipeConnection
else:
    from multiprocessing.connection import Connection

    End = Connection

LINES = ("work", "signs", "look", "stop", "close")
"""A pipe each: neither a long `release`, `play` or `close` nor a reading that hangs holds up a sign of life or a
stop."""

VALUE, ERROR, PROGRESS, GONE = range(4)
"""What a message is. After PROGRESS the other side waits for a bool: whether to go on."""


GRACE_S = 0.5
"""When this process stood still, the other looks late too: it gets so long to answer."""

CLOSE_S = 6.0
"""Beyond the fade: a driver that hangs is left to itself after less."""


class LoopGoneError(Exception):
    """The loop's process ended, or hangs."""

    def __init__(self, happened: str, hangs: bool) -> None:
        super().__init__(happened)
        self.hangs = hangs


class Call:
    """One call under way."""

    def __init__(self, name: str, arguments: tuple[Any, ...]) -> None:
        self.request = (name, arguments)
        self.said: SimpleQueue[tuple[int, Any]] = SimpleQueue()
        self.goes_on: SimpleQueue[bool] = SimpleQueue()
        self.over = False
        """Answered, or known to be never."""

    def answer(
        self, patience_s: float, on_progress: Callable[[float], None] | None = None, grace_s: float | None = None
    ) -> Any:
        """patience_s, grace_s (`GRACE_S`): for each message. Raises what was raised there, `LoopGoneError`, and what
        `on_progress` raises: then the call is not `over`."""
        while (message := self._next(patience_s, grace_s))[0] == PROGRESS:
            if on_progress is not None:
                on_progress(message[1])
            self.goes_on.put(True)
        if message[0] == ERROR:
            raise message[1]
        return message[1]

    def break_off(self, patience_s: float) -> None:
        """Have it end early, and wait until it has. Raises `LoopGoneError`."""
        self.goes_on.put(False)
        while not self.over:
            self._next(patience_s)

    def _next(self, patience_s: float, grace_s: float | None = None) -> tuple[int, Any]:
        for wait_s in (patience_s, GRACE_S if grace_s is None else grace_s):
            with contextlib.suppress(Empty):
                message = self.said.get(timeout=wait_s)
                break
        else:
            self.over = True
            raise LoopGoneError(f"it did not answer for {patience_s:g} s", hangs=True)
        self.over = message[0] != PROGRESS
        if message[0] == GONE:
            raise LoopGoneError("it ended", hangs=False)
        return message


class Line:
    def __init__(self, connection: End, name: str) -> None:
        self._connection = connection
        self._calls: SimpleQueue[Call | None] = SimpleQueue()
        threading.Thread(target=self._work, name=f"line {name}", daemon=True).start()

    def begin(self, name: str, *arguments: Any) -> Call:
        """Returns at once; sent when all earlier calls of this line are over."""
        call = Call(name, arguments)
        self._calls.put(call)
        return call

    def end(self) -> None:
        """Close the pipe after the calls so far."""
        self._calls.put(None)

    def _work(self) -> None:
        with self._connection:
            while (call := self._calls.get()) is not None:
                try:
                    self._transact(call)
                except Exception:  # noqa: BLE001 - end of file, a broken pipe, an answer that cannot be read: all the same
                    call.said.put((GONE, None))

    def _transact(self, call: Call) -> None:
        connection = self._connection
        connection.send(call.request)
        message = connection.recv()
        while message[0] == PROGRESS:
            call.said.put(message)
            # Without a bound: a caller that hangs gives no sign of life, and the force fades.
            connection.send(call.goes_on.get())
            message = connection.recv()
        call.said.put(message)
