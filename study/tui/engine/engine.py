"""The engine: the process in which sessions, the device, the disk and analyses run, so that none blocks the screen.

It lives as long as its pipe. When the screen is gone for any reason, the device is released, the log records that the
session was interrupted, and this process ends.
"""

import faulthandler
import os
import signal
import sys
import threading
import time
import traceback
from importlib import import_module
from multiprocessing.connection import Connection
from types import FrameType
from typing import TYPE_CHECKING

from study.errors import ExitCode, StudyError
from study.tui.engine.from_engine import ErrorText, Failed
from study.tui.engine.screen_link import ScreenLink
from study.tui.engine.to_engine import Command

if TYPE_CHECKING:
    from study.tui.engine.engine_commands import EngineCommands

NEEDED_FOR_A_SESSION = ("study.devices.safe", "study.devices.rigs_by_name", "study.store.sessions.trial_recordings")
"""Imported while the participant's code is typed, so that a session starts quickly."""

NEEDED_AT_THE_END = ("study.workflows.results.analyze_data",)
"""Statistics and plots: imported afterwards if there is time, so that results come quickly."""

LAST_RESORT_S = 5.0
"""The device was stopped long before."""

INTERRUPTED = StudyError(
    "Interrupted", "No force is on.", "Begin again, or leave.", "Every answer that was given is on disk."
)
"""Error of a command that the user let go of."""


class Engine:
    """Performs the screen's commands one after another until the screen is gone; signals interrupt the current one."""

    def __init__(self, connection: Connection) -> None:
        self._busy = False
        self._link = ScreenLink(connection, self._interrupt, _end_by_force)
        self._commands: EngineCommands | None = None
        for name in ("SIGINT", "SIGTERM"):
            signal.signal(getattr(signal, name), self._on_signal)

    def work(self) -> None:
        """Perform commands until the screen is gone."""
        self._link.start()
        while not self._link.ended:
            try:
                command = self._next_command()
                if command is None:
                    return
                self._perform(command)
            except KeyboardInterrupt:  # it came when there was nothing left to interrupt
                if not self._link.ended:
                    self._fail(INTERRUPTED, ExitCode.INTERRUPTED)

    def _next_command(self) -> Command | None:
        if not self._link.command_waits:
            self._warm_up()
        return self._link.next_command()

    def _warm_up(self) -> None:
        for name in ("study.tui.engine.engine_commands", *NEEDED_FOR_A_SESSION, *NEEDED_AT_THE_END):
            if not self._link.command_waits:
                import_module(name)

    def _perform(self, command: Command) -> None:
        commands = self._load_commands()
        try:
            self._busy = True
            commands.perform(command)
        except KeyboardInterrupt:
            self._busy = False
            self._fail(INTERRUPTED, ExitCode.INTERRUPTED)
        except StudyError as error:
            self._busy = False
            self._fail(error, error.exit_code)
        except Exception as bug:  # noqa: BLE001 - the screen must say it, and the device is closed
            self._busy = False
            traceback.print_exc()
            self._fail(_bug_error(bug), ExitCode.ERROR)
        finally:
            self._busy = False

    def _load_commands(self) -> "EngineCommands":
        if self._commands is None:
            from study.tui.engine.engine_commands import EngineCommands

            self._commands = EngineCommands(self._link)
        return self._commands

    def _fail(self, error: StudyError, exit_code: ExitCode) -> None:
        opened = self._commands.opened if self._commands is not None else None
        # A participant who withdrew left nothing to go on with.
        path = str(opened.path) if opened is not None and not opened.withdrawn else ""
        text = ErrorText(error.title, error.happened, error.saved, error.do_now, int(exit_code))
        self._link.send(Failed(text, path))

    def _interrupt(self) -> None:
        """Called from the reading thread. A real signal, because only that wakes a main thread that sleeps or waits."""
        main = threading.main_thread().ident
        if self._busy and main is not None:
            signal.pthread_kill(main, signal.SIGINT)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if number == signal.SIGTERM:
            self._link.ended = True
        if self._busy or self._link.ended:
            # Once: what cleans up after it must not be interrupted.
            self._busy = False
            raise KeyboardInterrupt


def _end_by_force() -> None:
    """Kill the process if it has lost its screen and does not end: it hangs in a driver, or on a disk."""
    time.sleep(LAST_RESORT_S)
    os._exit(1)


def _bug_error(bug: Exception) -> StudyError:
    return StudyError(
        "Something in hapteq went wrong",
        f"{type(bug).__name__}: {bug}.",
        "Resume the session; if it happens again, report it with these words.",
        "Every answer that was given is on disk.",
    )


def run(descriptor: int) -> None:
    """The main function of the process: `descriptor` is its end of the pipe."""
    faulthandler.enable(sys.stderr)
    Engine(Connection(descriptor)).work()
