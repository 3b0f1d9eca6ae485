"""Source of the views of a running session, for the experimenter's screen.

A child process reads the session's log at short intervals and sends a view each time; the screen takes the latest view
without waiting for the disk.
"""

import contextlib
import subprocess
import threading
from multiprocessing.connection import Connection

from study.session.watching.watch_view import WatchView
from study.tui.engine.child_process import start_child

POLL_EVERY_S = 0.2
"""Interval at which the child process reads the log (s)."""
CLOSING_S = 2.0
"""Longest wait for the child process to end (s)."""


class WatchFeed:
    """Implements `study.tui.watch.watch_source.WatchSource`, whose docstrings apply. The child process ends with
    `close`, and when this process ends."""

    def __init__(self, session_path: str) -> None:
        self._connection, self._child = start_child("study.tui.engine.watch_feed", "feed", session_path)
        self._latest: WatchView | None = None
        self._problem = ""
        self._closing = False
        self._reader = threading.Thread(target=self._read, daemon=True, name="watch-feed")
        self._reader.start()

    def latest(self) -> WatchView | None:
        return self._latest

    @property
    def problem(self) -> str:
        return self._problem

    @property
    def child_pid(self) -> int:
        """Process identifier of the child process."""
        return self._child.pid

    def close(self) -> None:
        """End the child process; kill it if it has not ended after `CLOSING_S`. Further calls do nothing."""
        if self._closing:
            return
        self._closing = True
        with contextlib.suppress(OSError):
            self._connection.send(None)
        try:
            self._child.wait(CLOSING_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._reader.join(CLOSING_S)
        self._connection.close()

    def _read(self) -> None:
        """Store the views and problems that the child process sends, until it ends. Runs in a thread."""
        while True:
            try:
                received = self._connection.recv()
            except (EOFError, OSError):
                if not self._closing and not self._problem:
                    self._problem = "the program that reads the log has ended; leave, and watch again."
                return
            if isinstance(received, WatchView):
                self._latest, self._problem = received, ""
            else:
                self._problem = received


def feed(descriptor: int, session_path: str) -> None:
    """Main function of the child process. descriptor: file descriptor of its end of the pipe. The imports are in here,
    because the screen's process, which imports this module too, must not load them."""
    from pathlib import Path

    from study.devices.clock import RealClock
    from study.errors import StudyError
    from study.workflows.views.watch_session import follow

    connection = Connection(descriptor)
    clock, follower = RealClock(), follow(Path(session_path))
    # Anything to read means the end: the message of `close`, or the end of the pipe when the parent has ended.
    while not connection.poll(POLL_EVERY_S):
        try:
            view = follower.look(clock.utc())
        except StudyError as error:
            view = None
            _send_view(connection, f"{error.happened} {error.do_now}")
        if view is not None and not _send_view(connection, view):
            return


def _send_view(connection: Connection, view_or_problem: WatchView | str) -> bool:
    """Send a view, or a problem as a sentence. False if the parent process has ended."""
    try:
        connection.send(view_or_problem)
    except OSError:
        return False
    return True
