"""Main program of the engine process, which runs sessions, drives the device, writes to disk and analyses.

A separate process is used so that none of this can block the screen. It receives commands and sends results through a
pipe, and runs as long as the pipe exists. When the screen's process ends, the device is released, the log of a running
session records its interruption, and the engine ends; by force where its main thread hangs (`_force_exit`).
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

from study.errors import StudyError, UserInterruptError
from study.tui.engine.from_engine import Failed
from study.tui.engine.screen_link import ScreenLink
from study.tui.engine.to_engine import Command

if TYPE_CHECKING:
    from study.tui.engine.engine_commands import EngineCommands

SESSION_MODULES = ("study.devices.safe", "study.devices.rigs_by_name", "study.store.sessions.trial_recordings")
"""Modules that are imported while no command waits, so that a session starts quickly."""

ANALYSIS_MODULES = ("study.workflows.results.analyze_data",)
"""Modules of statistics and plots, imported next, so that results appear quickly."""

FORCED_EXIT_S = 5.0
"""Time (s) from the loss of the screen to the forced end of this process. The device was stopped before. Chosen by
hand."""

INTERRUPTED = UserInterruptError(
    "Interrupted", "No force is on.", "Begin again, or leave.", "Every answer that was given is on disk."
)
"""Error that is reported for a command that the user interrupted."""


class Engine:
    """Main loop of the engine process: the commands of the screen, one after another, until the screen's process has
    ended. SIGINT interrupts the current command, SIGTERM ends the engine."""

    def __init__(self, connection: Connection) -> None:
        self._busy = False  # whether a command runs that may be interrupted
        self._link = ScreenLink(connection, self._interrupt, _force_exit)
        self._commands: EngineCommands | None = None
        for signal_name in ("SIGINT", "SIGTERM"):
            signal.signal(getattr(signal, signal_name), self._on_signal)

    def perform_commands(self) -> None:
        """Perform commands until the screen's process has ended."""
        self._link.start()
        while not self._link.ended:
            try:
                command = self._await_command()
                if command is None:
                    return
                self._perform(command)
            except KeyboardInterrupt:  # the interrupt came just after a command had ended
                if not self._link.ended:
                    self._report_failure(INTERRUPTED)

    def _await_command(self) -> Command | None:
        """Import modules in advance, then wait for the next command; None after the end of the screen's process."""
        if not self._link.has_waiting_command:
            self._import_in_advance()
        return self._link.wait_for_command()

    def _import_in_advance(self) -> None:
        """Import modules in advance, skipping the rest once a command waits."""
        for module_name in ("study.tui.engine.engine_commands", *SESSION_MODULES, *ANALYSIS_MODULES):
            if not self._link.has_waiting_command:
                import_module(module_name)

    def _perform(self, command: Command) -> None:
        """Perform a command; an error or an interruption is sent to the screen as `Failed`."""
        commands = self._load_commands()
        try:
            self._busy = True
            commands.perform(command)
        except KeyboardInterrupt:
            self._busy = False
            self._report_failure(INTERRUPTED)
        except StudyError as error:
            self._busy = False
            self._report_failure(error)
        except Exception as exception:  # noqa: BLE001 - the screen shows it, and the device is closed
            self._busy = False
            traceback.print_exc()
            self._report_failure(_make_bug_error(exception))
        finally:
            self._busy = False

    def _load_commands(self) -> "EngineCommands":
        """Import and create the commands at first use, because the import takes long."""
        if self._commands is None:
            from study.tui.engine.engine_commands import EngineCommands

            self._commands = EngineCommands(self._link)
        return self._commands

    def _report_failure(self, error: StudyError) -> None:
        """Send an error to the screen, with the path of the session that can be resumed; "" without one."""
        session_folder = self._commands.session_folder if self._commands is not None else None
        # A withdrawn session cannot be resumed.
        resumable_path = str(session_folder.path) if session_folder is not None and not session_folder.withdrawn else ""
        self._link.send(Failed(error, resumable_path))

    def _interrupt(self) -> None:
        """Interrupt the current command; called from the reading thread. A signal of the operating system is used,
        because nothing else wakes a main thread that sleeps or waits."""
        main_thread_id = threading.main_thread().ident
        if self._busy and main_thread_id is not None:
            signal.pthread_kill(main_thread_id, signal.SIGINT)

    def _on_signal(self, signal_number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt in the main thread if a command runs, or if the engine is to end; SIGTERM ends it."""
        if signal_number == signal.SIGTERM:
            self._link.ended = True
        if self._busy or self._link.ended:
            # Only once per command: the cleaning up that follows must not be interrupted.
            self._busy = False
            raise KeyboardInterrupt


def _force_exit() -> None:
    """End the process `FORCED_EXIT_S` after the loss of the screen. Reached only if the main thread hangs, in a driver
    or on a disk; called in a daemon thread, which ends with the process otherwise."""
    time.sleep(FORCED_EXIT_S)
    os._exit(1)


def _make_bug_error(exception: Exception) -> StudyError:
    """Convert an unexpected exception to an error that the screen can show."""
    return StudyError(
        "Something in hapteq went wrong",
        f"{type(exception).__name__}: {exception}.",
        "Resume the session; if it happens again, report it with these words.",
        "Every answer that was given is on disk.",
    )


def run(descriptor: int) -> None:
    """Main function of the process, which `study.tui.engine.client` starts. descriptor: file descriptor of its end of
    the pipe."""
    faulthandler.enable(sys.stderr)
    Engine(Connection(descriptor)).perform_commands()
