"""Client of the engine process in the process that draws the screen: start it, deliver its messages, detect its end.

The engine is the process that drives the device and runs the session; the screen only draws. The drawing thread never
blocks: one further thread starts the engine and reads from it, another writes to it.
"""

import contextlib
import os
import signal
import socket
import subprocess
import tempfile
import threading
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import IO

from study.errors import DeviceError, StudyError
from study.session.views.resume_command import format_resume_command
from study.tui.engine.child_process import start_child
from study.tui.engine.from_engine import Failed, FromEngine, SessionReady
from study.tui.engine.to_engine import Heartbeat, ToEngine

ENGINE_EXIT_TIMEOUT_S = 6.0
"""Longest wait (s) for the engine to end. Chosen: an engine whose screen process has ended exits sooner by itself."""


class EngineClient:
    """Connection to one engine process. deliver: called with each message of the engine, from a thread of this client;
    the last one is a `Failed` if the engine could not be started or ended before `close`."""

    def __init__(self, deliver: Callable[[FromEngine], None]) -> None:
        self._deliver = deliver
        self._send_queue: SimpleQueue[ToEngine | None] = SimpleQueue()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._is_closing = False
        self._session: SessionReady | None = None
        self.has_failed = False
        """Whether the engine could not be started or ended without `close`; a new client can then be started."""
        self._thread = threading.Thread(target=self._run_engine, name="engine-client", daemon=True)

    @property
    def pid(self) -> int | None:
        """Process identifier of the engine; None before it has started."""
        return self._process.pid if self._process is not None else None

    def start(self) -> None:
        """Start the engine in the background and return at once. Messages sent before it runs are queued."""
        self._thread.start()

    def send(self, message: ToEngine) -> None:
        """Queue a message and return at once. A heartbeat is dropped while other messages are queued, because it would
        be late."""
        if not isinstance(message, Heartbeat) or self._send_queue.empty():
            self._send_queue.put(message)

    def close(self, timeout_s: float = ENGINE_EXIT_TIMEOUT_S) -> None:
        """Close the pipe, wait up to `timeout_s` (s) for the engine to release the force, write the last line of the
        log, and end; then kill it. May be called repeatedly, and before `start`."""
        self._is_closing = True
        self._send_queue.put(None)
        if self._thread.ident is None:
            return
        self._thread.join(timeout_s)
        process = self._process
        if process is not None and process.poll() is None:
            process.kill()
            process.wait()

    def _run_engine(self) -> None:
        """Start the engine, deliver its messages until the pipe ends, and report an unexpected end."""
        with tempfile.TemporaryFile() as output:
            try:
                connection, process = start_child("study.tui.engine.engine", "run", output=output)
            except OSError as problem:
                self.has_failed = True
                self._deliver(_make_start_failure(problem))
                return
            self._connection, self._process = connection, process
            writer = threading.Thread(target=self._send_messages, args=(connection,), name="engine-writer", daemon=True)
            writer.start()
            self._deliver_messages(connection)
            self._send_queue.put(None)
            exit_code = _await_exit_code(process)
            writer.join()
            connection.close()
            if not self._is_closing:
                self.has_failed = True
                self._deliver(_make_end_failure(exit_code, _read_last_line(output), self._session))

    def _deliver_messages(self, connection: Connection) -> None:
        """Deliver messages until the pipe ends, a message cannot be decoded, or `deliver` raises."""
        try:
            while True:
                message: FromEngine = connection.recv()
                if isinstance(message, SessionReady):
                    self._session = message
                self._deliver(message)
        except (EOFError, OSError):
            return
        except Exception:  # noqa: BLE001 - a message that cannot be decoded is reported as the end of the engine
            traceback.print_exc()

    def _send_messages(self, connection: Connection) -> None:
        """Send the queued messages until None is queued, then end this direction of the pipe."""
        with contextlib.suppress(OSError):
            while (message := self._send_queue.get()) is not None:
                connection.send(message)
        # Only sending is shut down: the engine sees the end of the pipe, and its last messages still arrive here.
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(connection.fileno())) as write_end:
            write_end.shutdown(socket.SHUT_WR)


def _await_exit_code(process: "subprocess.Popen[bytes]") -> int:
    """Wait for an engine whose pipe has ended, and kill it after `ENGINE_EXIT_TIMEOUT_S` (s). Returns its exit code,
    negative for a signal."""
    try:
        return process.wait(ENGINE_EXIT_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _make_start_failure(problem: OSError) -> Failed:
    """Make the message for an engine process that the system refused to start."""
    explanation = f"The system refused to start the process that drives the device: {problem.strerror or problem}."
    advice = "Close other programs, or start the computer anew, and begin again."
    return Failed(StudyError("The device program cannot be started", explanation, advice))


def _read_last_line(output: IO[bytes]) -> str:
    """Read the last line that the engine printed, usually of a traceback; empty if it printed nothing."""
    output.seek(0)
    lines = output.read().decode(errors="replace").strip().splitlines()
    return lines[-1].strip() if lines else ""


def _make_end_failure(exit_code: int, last_line: str, session: SessionReady | None) -> Failed:
    """Make the message for an engine that ended unexpectedly. exit_code: negative for a signal. session: the session
    that can be resumed, if any."""
    end_text = f"by signal {signal.Signals(-exit_code).name}" if exit_code < 0 else f"with code {exit_code}"
    explanation = f"The process that drives the device ended {end_text}."
    if last_line:
        explanation += f" Its last words: {last_line}"
    advice = "Take the hand off the handle until you know that no force is on."
    if session is not None:
        advice += f" Then continue with: {format_resume_command(session.path, session.device)}"
    saved_text = "Every answer that was given is on disk." if session is not None else ""
    error = DeviceError("The device program ended", explanation, advice, saved_text)
    return Failed(error, session.path if session is not None else "")
