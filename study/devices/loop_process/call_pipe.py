"""Caller's end of the pipes to the process of the device loop: remote calls with progress, timeout and cancellation.
The process's end is `serve`.

Each pipe has a thread that writes and reads, so that an interrupted caller leaves no incomplete message in the pipe and
waits no longer than its timeout for a process that hangs. Messages are pickled: (name, arguments) as request; (kind,
value) as progress or answer, a bool as the reply to a progress.
"""

import contextlib
import pickle
import sys
import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any

if sys.platform == "win32":
    from multiprocessing.connection import PipeConnection

    PipeEnd = PipeConnection
else:
    from multiprocessing.connection import Connection

    PipeEnd = Connection

PIPE_NAMES = ("work", "signs", "look", "stop", "close")
"""Names of the pipes, one per group of methods: `hold`, `release` and `play`, after the first message (`open`);
`keep_alive`, `fault` and `health`; `look`; `stop`; `close`. So neither a long call nor a reading that hangs delays a
keep-alive or a stop."""

VALUE, ERROR, PROGRESS = range(3)
"""Kinds of messages from the process: result of the method, exception that it raised, share done (0 to 1). After
PROGRESS the process waits for a bool: whether to continue."""


ANSWER_GRACE_S = 0.5
"""Additional wait (s) after a timeout: after a suspension of this process an answer is late without a fault. Chosen."""

CLOSE_TIMEOUT_S = 6.0
"""Time (s) beyond the fade in which the process may end in an orderly way. Chosen."""


class LoopGoneError(Exception):
    """The loop's process ended, was given up, hangs (`hangs`: it did not answer within the timeout), or sent an answer
    that cannot be read. reason: a clause on the process."""

    def __init__(self, reason: str, hangs: bool) -> None:
        super().__init__(reason)
        self.hangs = hangs


class Call:
    """A call of one method in the loop's process. The constructor raises pickle's errors for arguments that cannot be
    pickled."""

    def __init__(self, name: str, arguments: tuple[Any, ...]) -> None:
        self.request = pickle.dumps((name, arguments))
        self.continue_decisions: SimpleQueue[bool] = SimpleQueue()
        self._progress: SimpleQueue[float] = SimpleQueue()
        self._final_message: tuple[int, Any] | None = None
        """The answer (kind, value), kept so that a caller that was interrupted on its arrival can ask for it again."""
        self._message_arrived = threading.Event()

    @property
    def is_over(self) -> bool:
        """Whether the answer has arrived, or the process counts as gone."""
        return self._final_message is not None

    def receive(self, message: tuple[int, Any]) -> None:
        """Store a message of the process: progress, or the answer that ends the call."""
        if message[0] == PROGRESS:
            self._progress.put(message[1])
        else:
            self._final_message = message
        self._message_arrived.set()

    def wait_for_answer(
        self,
        timeout_s: float,
        on_progress: Callable[[float], None] | None = None,
        grace_s: float | None = None,
        sending_s: float = 0.0,
    ) -> Any:
        """Wait for the answer and return it. timeout_s: timeout (s) for each message. grace_s: additional wait (s),
        None = `ANSWER_GRACE_S`. on_progress(share): called for each progress, 0 to 1. sending_s: time (s) added to the
        timeout before the first progress and after a progress of 1, when a request or a recording is sent. Raises what
        the method raised, `LoopGoneError`, and what `on_progress` raises. May be called again after an interruption."""
        share: float | None = 1.0
        while (share := self._wait_for_progress(timeout_s + sending_s * (share == 1.0), grace_s)) is not None:
            if on_progress is not None:
                on_progress(share)
            self.continue_decisions.put(True)
        assert self._final_message is not None
        kind, value = self._final_message
        if kind == ERROR:
            raise value
        return value

    def cancel(self, timeout_s: float) -> None:
        """Cancel the call at its next progress, and wait until it has ended; timeout_s: for each message. Raises
        `LoopGoneError`; any other error of the call is ignored."""
        self.continue_decisions.put(False)
        while self._wait_for_progress(timeout_s) is not None:
            pass
        if self._final_message is not None and isinstance(self._final_message[1], LoopGoneError):
            raise self._final_message[1]

    def _wait_for_progress(self, timeout_s: float, grace_s: float | None = None) -> float | None:
        """Wait for the next progress and return it (0 to 1); None when the call is over. Without a message within
        timeout_s and then grace_s, the call ends with `LoopGoneError`."""
        for wait_s in (timeout_s, ANSWER_GRACE_S if grace_s is None else grace_s):
            self._message_arrived.clear()
            if self._final_message is None and self._progress.empty():
                self._message_arrived.wait(wait_s)
            with contextlib.suppress(Empty):
                return self._progress.get_nowait()
            if self._final_message is not None:
                return None
        self._final_message = (ERROR, LoopGoneError(f"it did not answer for {timeout_s:g} s", hangs=True))
        return None


class CallPipe:
    """A pipe to the loop's process, with a thread that sends its calls in order. A broken pipe ends every open call
    with `LoopGoneError`."""

    def __init__(self, connection: PipeEnd, name: str) -> None:
        self._connection = connection
        self._calls: SimpleQueue[Call | None] = SimpleQueue()
        self._ended = threading.Event()
        threading.Thread(target=self._run_thread, name=f"line {name}", daemon=True).start()

    def queue_call(self, name: str, *arguments: Any) -> Call:
        """Queue a call and return at once. It is sent when all earlier calls of this pipe are over. Raises as `Call`
        does."""
        call = Call(name, arguments)
        self._calls.put(call)
        if self._ended.is_set():
            self._fail_queued_calls()
        return call

    def close_after_calls(self) -> None:
        """Close the pipe when the calls queued so far are over."""
        self._calls.put(None)

    def _run_thread(self) -> None:
        """Send the queued calls one by one, until `close_after_calls` is called."""
        try:
            with self._connection:
                while (call := self._calls.get()) is not None:
                    try:
                        self._transact(call)
                    except Exception as error:  # noqa: BLE001 - a broken pipe, or an answer that cannot be read
                        call.receive((ERROR, _make_loop_gone_error(error)))
        finally:
            self._ended.set()
            self._fail_queued_calls()

    def _fail_queued_calls(self) -> None:
        """End all queued calls with `LoopGoneError`, once the pipe is closed."""
        with contextlib.suppress(Empty):
            while True:
                if (call := self._calls.get_nowait()) is not None:
                    call.receive((ERROR, LoopGoneError("it was given up", hangs=False)))

    def _transact(self, call: Call) -> None:
        """Send a request and pass its messages to the call, until the answer has come."""
        connection = self._connection
        connection.send_bytes(call.request)
        message = connection.recv()
        while message[0] == PROGRESS:
            call.receive(message)
            # No timeout: where the caller hangs, its keep-alives stop and the device fades the force.
            connection.send(call.continue_decisions.get())
            message = connection.recv()
        call.receive(message)


def _make_loop_gone_error(error: Exception) -> LoopGoneError:
    """Make the error of a call whose pipe broke or whose answer cannot be unpickled."""
    if isinstance(error, EOFError | OSError):
        return LoopGoneError("it ended", hangs=False)
    return LoopGoneError(f"its answer cannot be read ({type(error).__name__}: {error})", hangs=False)
