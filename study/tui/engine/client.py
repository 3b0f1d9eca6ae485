"""The screen's end of the pipe: starts the engine, delivers its messages, and detects its end.

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

from study.errors import ExitCode
from study.tui.engine.child_process import start_child
from study.tui.engine.from_engine import ErrorText, Failed, FromEngine, SessionReady
from study.tui.engine.to_engine import Heartbeat, ToEngine

CLOSING_S = 6.0
"""Longest wait (s) for the engine to end; an engine that lost its screen ends by itself sooner."""


class EngineClient:
    """Connection to one engine process. deliver: called with each message of the engine, from a thread of this client;
    the last message is a `Failed` if the engine could not be started or ended unexpectedly."""

    def __init__(self, deliver: Callable[[FromEngine], None]) -> None:
        self._deliver = deliver
        self._outbox: SimpleQueue[ToEngine | None] = SimpleQueue()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._closing = False
        self._session: SessionReady | None = None
        self.dead = False
        """Whether the engine could not be started or ended without `close`; a new client can then be started."""
        self._thread = threading.Thread(target=self._run_thread, name="engine-client", daemon=True)

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
        if not isinstance(message, Heartbeat) or self._outbox.empty():
            self._outbox.put(message)

    def close(self, patience_s: float = CLOSING_S) -> None:
        """Close the pipe and wait up to `patience_s` (s) for the engine to release the force, write its last line of
        the log, and end; then kill it. May be called twice."""
        self._closing = True
        self._outbox.put(None)
        if self._thread.ident is None:
            return
        self._thread.join(patience_s)
        process = self._process
        if process is not None and process.poll() is None:
            process.kill()
            process.wait()

    def _run_thread(self) -> None:
        """Start the engine, deliver its messages until the pipe ends, and report an unexpected end."""
        with tempfile.TemporaryFile() as output:
            try:
                connection, process = start_child("study.tui.engine.engine", "run", output=output)
            except OSError as problem:
                self.dead = True
                self._deliver(_not_started(problem))
                return
            self._connection, self._process = connection, process
            writer = threading.Thread(target=self._write, args=(connection,), name="engine-writer", daemon=True)
            writer.start()
            self._read(connection)
            self._outbox.put(None)
            code = _code_at_end(process)
            writer.join()
            connection.close()
            if not self._closing:
                self.dead = True
                self._deliver(_death(code, _last_words(output), self._session))

    def _read(self, connection: Connection) -> None:
        """Deliver messages until the pipe ends or a message cannot be decoded."""
        try:
            while True:
                message: FromEngine = connection.recv()
                if isinstance(message, SessionReady):
                    self._session = message
                self._deliver(message)
        except (EOFError, OSError):
            return
        except Exception:  # noqa: BLE001 - what cannot be understood is the end of the engine, and is told as that
            traceback.print_exc()

    def _write(self, connection: Connection) -> None:
        """Send the queued messages until None is queued, then end this direction of the pipe."""
        with contextlib.suppress(OSError):
            while (message := self._outbox.get()) is not None:
                connection.send(message)
        # Only sending is shut down: the engine sees the end of the pipe, and its last messages still arrive here.
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(connection.fileno())) as end:
            end.shutdown(socket.SHUT_WR)


def _code_at_end(process: "subprocess.Popen[bytes]") -> int:
    """Exit code of an engine whose pipe has ended; it is killed if it does not end."""
    try:
        return process.wait(CLOSING_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _not_started(problem: OSError) -> Failed:
    """Message for an engine process that the system refused to start."""
    explanation = f"The system refused to start the process that drives the device: {problem.strerror or problem}."
    advice = "Close other programs, or start the computer anew, and begin again."
    return Failed(ErrorText("The device program cannot be started", explanation, "", advice, int(ExitCode.ERROR)))


def _last_words(output: IO[bytes]) -> str:
    """Last line that the engine printed, usually of a traceback; empty if it printed nothing."""
    output.seek(0)
    lines = output.read().decode(errors="replace").strip().splitlines()
    return lines[-1].strip() if lines else ""


def _death(code: int, last_words: str, session: SessionReady | None) -> Failed:
    """Message for an engine that ended unexpectedly. code: exit code, negative for a signal. session: the session that
    can be resumed, if any."""
    end_text = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with code {code}"
    explanation = f"The process that drives the device ended {end_text}."
    if last_words:
        explanation += f" Its last words: {last_words}"
    advice = "Take the hand off the handle until you know that no force is on."
    if session is not None:
        advice += f" Then continue with: hapteq resume {session.path}"
    saved = "Every answer that was given is on disk." if session is not None else ""
    text = ErrorText("The device program ended", explanation, saved, advice, int(ExitCode.DEVICE))
    return Failed(text, session.path if session is not None else "")
