"""Caller's end of a pipe to the loop's process. A thread writes and reads, so that an interrupted caller leaves no half
message, and waits no longer than its timeout for a process that hangs."""

import contextlib
import pickle
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

VALUE, ERROR, PROGRESS = range(3)
"""Kinds of messages. After PROGRESS the other side waits for a bool: whether to go on."""


GRACE_S = 0.5
"""When this process stood still, the other looks late too: it gets so long to answer."""

CLOSE_S = 6.0
"""Time granted beyond the fade to end in order; a driver that hangs is abandoned sooner."""


class LoopGoneError(Exception):
    """The loop's process ended, or hangs."""

    def __init__(self, happened: str, hangs: bool) -> None:
        super().__init__(happened)
        self.hangs = hangs


class Call:
    """One call under way. Raises where the arguments cannot be sent."""

    def __init__(self, name: str, arguments: tuple[Any, ...]) -> None:
        self.request = pickle.dumps((name, arguments))
        self.goes_on: SimpleQueue[bool] = SimpleQueue()
        self._progress: SimpleQueue[float] = SimpleQueue()
        self._last: tuple[int, Any] | None = None
        """Kept, not taken: a caller that was interrupted as it came asks again."""
        self._news = threading.Event()

    @property
    def over(self) -> bool:
        """Answered, or known to be never."""
        return self._last is not None

    def hear(self, message: tuple[int, Any]) -> None:
        """Take a message of the process: progress, or the answer that ends the call. From the line's thread."""
        if message[0] == PROGRESS:
            self._progress.put(message[1])
        else:
            self._last = message
        self._news.set()

    def answer(
        self,
        patience_s: float,
        on_progress: Callable[[float], None] | None = None,
        grace_s: float | None = None,
        sending_s: float = 0.0,
    ) -> Any:
        """patience_s, grace_s (`GRACE_S`): for each message. sending_s: beyond that, before the first progress and
        after that of 1, when a request and a recording are sent. Raises what was raised there, `LoopGoneError`, and
        what `on_progress` raises. May be called again when it was interrupted."""
        share: float | None = 1.0
        while (share := self._next_progress(patience_s + sending_s * (share == 1.0), grace_s)) is not None:
            if on_progress is not None:
                on_progress(share)
            self.goes_on.put(True)
        assert self._last is not None
        kind, value = self._last
        if kind == ERROR:
            raise value
        return value

    def break_off(self, patience_s: float) -> None:
        """Have it end early, and wait until it has. Raises `LoopGoneError`."""
        self.goes_on.put(False)
        while self._next_progress(patience_s) is not None:
            pass
        if self._last is not None and isinstance(self._last[1], LoopGoneError):
            raise self._last[1]

    def _next_progress(self, patience_s: float, grace_s: float | None = None) -> float | None:
        """The next progress, or None when the call is over."""
        for wait_s in (patience_s, GRACE_S if grace_s is None else grace_s):
            self._news.clear()
            if self._last is None and self._progress.empty():
                self._news.wait(wait_s)
            with contextlib.suppress(Empty):
                return self._progress.get_nowait()
            if self._last is not None:
                return None
        self._last = (ERROR, LoopGoneError(f"it did not answer for {patience_s:g} s", hangs=True))
        return None


class Line:
    """A pipe to the loop's process, with a thread that sends its calls in order. A broken pipe ends them with
    `LoopGoneError`."""

    def __init__(self, connection: End, name: str) -> None:
        self._connection = connection
        self._calls: SimpleQueue[Call | None] = SimpleQueue()
        self._ended = threading.Event()
        threading.Thread(target=self._run_thread, name=f"line {name}", daemon=True).start()

    def begin(self, name: str, *arguments: Any) -> Call:
        """Returns at once; sent when all earlier calls of this line are over. Raises where it cannot be sent."""
        call = Call(name, arguments)
        self._calls.put(call)
        if self._ended.is_set():
            self._refuse_all()
        return call

    def end(self) -> None:
        """Close the pipe after the calls so far."""
        self._calls.put(None)

    def _run_thread(self) -> None:
        try:
            with self._connection:
                while (call := self._calls.get()) is not None:
                    try:
                        self._transact(call)
                    except Exception as error:  # noqa: BLE001 - a broken pipe, or an answer that cannot be read
                        call.hear((ERROR, _loop_gone_error(error)))
        finally:
            self._ended.set()
            self._refuse_all()

    def _refuse_all(self) -> None:
        """Answer with an error the calls that were begun as the pipe closed."""
        with contextlib.suppress(Empty):
            while True:
                if (call := self._calls.get_nowait()) is not None:
                    call.hear((ERROR, LoopGoneError("it was given up", hangs=False)))

    def _transact(self, call: Call) -> None:
        connection = self._connection
        connection.send_bytes(call.request)
        message = connection.recv()
        while message[0] == PROGRESS:
            call.hear(message)
            # Without a bound: a caller that hangs gives no sign of life, and the force fades.
            connection.send(call.goes_on.get())
            message = connection.recv()
        call.hear(message)


def _loop_gone_error(error: Exception) -> LoopGoneError:
    if isinstance(error, EOFError | OSError):
        return LoopGoneError("it ended", hangs=False)
    return LoopGoneError(f"its answer cannot be read ({type(error).__name__}: {error})", hangs=False)
