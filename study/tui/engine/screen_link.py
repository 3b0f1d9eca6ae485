"""The engine's end of the pipe: a thread that listens to the screen while the engine is busy with a session."""

import threading
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue

from study.tui.engine.from_engine import FromEngine
from study.tui.engine.to_engine import Command, Heartbeat, LetGo, Relay, Reply, ToEngine
from study.workflows.trial.requests_port import QueuedRequests


class ScreenLink:
    """interrupt: raises KeyboardInterrupt in the main thread if it is busy. gone: called last, when the screen is
    gone. Both are called from the reading thread."""

    def __init__(self, connection: Connection, interrupt: Callable[[], None], gone: Callable[[], None]) -> None:
        self._commands: SimpleQueue[Command | None] = SimpleQueue()
        self._heard, self._taken, self._let_go_up_to = 0, 0, 0
        """Commands, counted: one that is let go of may not have been begun, or not even taken."""
        self.requests = QueuedRequests()
        self.stop_device: Callable[[], None] | None = None
        """While a device is open: what takes its force away from any thread."""
        self.ended = False
        self._connection = connection
        self._interrupt = interrupt
        self._gone = gone
        self._replies: SimpleQueue[Reply] = SimpleQueue()
        self._sending = threading.Lock()
        self._heard_s = time.monotonic()

    def start(self) -> None:
        """Listen to the screen in a thread, until it is gone."""
        threading.Thread(target=self._listen, name="screen-link", daemon=True).start()

    def send(self, message: FromEngine) -> None:
        """Raises KeyboardInterrupt if the screen is gone."""
        try:
            with self._sending:
                self._connection.send(message)
        except OSError:
            self.ended = True
            raise KeyboardInterrupt from None

    def next_command(self) -> Command | None:
        """Wait for the next command. None: the screen is gone."""
        command = self._commands.get()
        self._taken += 1
        return command

    @property
    def command_waits(self) -> bool:
        """Whether a command has come that was not taken yet."""
        return not self._commands.empty()

    @property
    def taken_is_let_go(self) -> bool:
        """Whether the user let go after the command that was taken last had been sent."""
        return self._taken <= self._let_go_up_to

    def reply(self, patience_s: float) -> Reply | None:
        """The next reply, of any number; None after the timeout. Raises KeyboardInterrupt if the screen is
        gone."""
        if self.ended:
            raise KeyboardInterrupt
        try:
            return self._replies.get(timeout=patience_s)
        except Empty:
            return None

    def forget_replies(self) -> None:
        """Drop replies of an earlier sitting, whose requests had the same numbers."""
        while not self._replies.empty():
            self._replies.get()

    def silent_s(self) -> float:
        """Seconds since the last sign of life of the screen."""
        return time.monotonic() - self._heard_s

    def _listen(self) -> None:
        try:
            while True:
                self._handle_message(self._connection.recv())
        except (EOFError, OSError):
            pass
        except Exception:  # noqa: BLE001 - an engine that understands nothing any more must not go on
            traceback.print_exc()
        finally:
            self.ended = True
            self._commands.put(None)
            try:
                self._let_go()
            finally:
                self._gone()

    def _handle_message(self, message: ToEngine) -> None:
        # Each message was sent by a living screen; only heartbeats come all the time.
        self._heard_s = time.monotonic()
        match message:
            case Heartbeat():
                return
            case Reply():
                self._replies.put(message)
            case Relay(request=request):
                self.requests.send(request)
            case LetGo():
                self._let_go()
            case _:
                self._heard += 1
                self._commands.put(message)

    def _let_go(self) -> None:
        """The main thread takes the force away too, but it may be waiting for a disk or a driver."""
        self._let_go_up_to = self._heard
        self._interrupt()
        if (stop := self.stop_device) is not None:
            stop()
