"""The engine's end of the pipe to the screen.

A thread reads all messages while the main thread runs a session, so that Ctrl-C at the screen switches the force off at
once. It sorts messages into commands, replies and requests, and detects that the screen's process has ended.
"""

import threading
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue

from study.tui.engine.from_engine import FromEngine
from study.tui.engine.to_engine import Command, ForwardRequest, Heartbeat, Interrupt, Reply, ToEngine
from study.workflows.trial.requests_port import QueuedRequests


class ScreenLink:
    """Sends messages to the screen and distributes those from it.

    interrupt: raises KeyboardInterrupt in the main thread if a command runs. on_screen_ended: called last, when the
    screen's process has ended. Both are called from the reading thread.
    """

    def __init__(
        self, connection: Connection, interrupt: Callable[[], None], on_screen_ended: Callable[[], None]
    ) -> None:
        self._commands: SimpleQueue[Command | None] = SimpleQueue()
        self._received_count, self._taken_count, self._interrupted_count = 0, 0, 0
        """Numbers of commands received, taken by the main thread, and received before the last interruption. They are
        needed because an interrupted command may not have been begun or taken yet."""
        # Requests of the screen to the session that runs in this engine.
        self.requests = QueuedRequests()
        self.stop_device: Callable[[], None] | None = None
        """Takes the force of the device off, and may be called from any thread; None while no device is open."""
        self.ended = False
        """Whether the screen's process has ended, or the engine shall end."""
        self._connection = connection
        self._interrupt = interrupt
        self._on_screen_ended = on_screen_ended
        self._replies: SimpleQueue[Reply] = SimpleQueue()
        self._send_lock = threading.Lock()
        self._last_message_s = time.monotonic()
        """Time of the last message (s, monotonic clock)."""

    def start(self) -> None:
        """Start the thread that reads messages until the screen's process has ended."""
        threading.Thread(target=self._listen, name="screen-link", daemon=True).start()

    def send(self, message: FromEngine) -> None:
        """Send a message to the screen, from any thread. Raises KeyboardInterrupt if the screen's process has ended."""
        try:
            with self._send_lock:
                self._connection.send(message)
        except OSError:
            self.ended = True
            raise KeyboardInterrupt from None

    def wait_for_command(self) -> Command | None:
        """Wait for the next command; None if the screen's process has ended."""
        command = self._commands.get()
        self._taken_count += 1
        return command

    @property
    def has_waiting_command(self) -> bool:
        """Whether a received command waits to be taken."""
        return not self._commands.empty()

    @property
    def is_taken_command_interrupted(self) -> bool:
        """Whether the user interrupted (`Interrupt`) after sending the command that was taken last."""
        return self._taken_count <= self._interrupted_count

    def wait_for_reply(self, timeout_s: float) -> Reply | None:
        """Wait for the next reply, of any number; None if no reply came within `timeout_s` (s). Raises
        KeyboardInterrupt if the screen's process has ended and no reply is left, such as a withdrawal sent before."""
        try:
            return self._replies.get(timeout=0.0 if self.ended else timeout_s)
        except Empty:
            if self.ended:
                raise KeyboardInterrupt from None
            return None

    def drop_replies(self) -> None:
        """Drop replies to an earlier sitting, whose requests may have had the same numbers."""
        while not self._replies.empty():
            self._replies.get()

    def compute_silence_s(self) -> float:
        """Compute the time since the last message of the screen (s)."""
        return time.monotonic() - self._last_message_s

    def _listen(self) -> None:
        """Read messages until the pipe is closed or a message cannot be read; then switch the force off and end the
        engine. Runs in a thread."""
        try:
            while True:
                self._handle_message(self._connection.recv())
        except (EOFError, OSError):
            pass
        except Exception:  # noqa: BLE001 - an engine that cannot read messages must not continue
            traceback.print_exc()
        finally:
            self.ended = True
            self._commands.put(None)
            try:
                self._interrupt_command()
            finally:
                self._on_screen_ended()

    def _handle_message(self, message: ToEngine) -> None:
        """Put a message into the queue of its kind, pass a request to the session (`ForwardRequest`), or interrupt at
        once (`Interrupt`)."""
        # Any message shows that the screen's event loop runs, not only the heartbeat.
        self._last_message_s = time.monotonic()
        match message:
            case Heartbeat():
                return
            case Reply():
                self._replies.put(message)
            case ForwardRequest(request=request):
                self.requests.send(request)
            case Interrupt():
                self._interrupt_command()
            case _:
                self._received_count += 1
                self._commands.put(message)

    def _interrupt_command(self) -> None:
        """Interrupt the current command and switch the force off. The interrupted main thread switches it off too, but
        it may be waiting for a disk or a driver."""
        self._interrupted_count = self._received_count
        self._interrupt()
        if (stop_device := self.stop_device) is not None:
            stop_device()
