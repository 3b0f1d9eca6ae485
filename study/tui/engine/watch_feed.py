"""Views of a running session for a screen: a child process reads and folds the log, so that the screen never waits."""

import contextlib
import subprocess
import threading
from multiprocessing.connection import Connection

from study.session.watching.watch_view import WatchView
from study.tui.engine.child_process import start_child

POLL_EVERY_S = 0.2
"""Interval at which the log is read (s)."""
CLOSING_S = 2.0
"""Longest wait for the child process to end (s)."""


class WatchFeed:
    """Implements `study.tui.watch.watch_source.WatchSource`. The child ends with `close`, and when this process
    dies."""

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
        """Number of the process that reads the log."""
        return self._child.pid

    def close(self) -> None:
        """End the child, and kill it where it does not end within `CLOSING_S`. May be called again."""
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
        """Runs in a thread: takes what the child sends, until it is gone."""
        while True:
            try:
                received = self._connection.recv()
            except (EOFError, OSError):
                if not self._closing and not self._problem:
                    self._problem = "the program that reads the log has ended; leave, and watch again."
                return
            if isinstance(received, WatchView):
                self._latest = received
            else:
                self._problem = received


def feed(descriptor: int, session_path: str) -> None:
    """Main function of the child. It imports here, because the screen's process must load none of this."""
    from pathlib import Path

    from study.devices.clock import RealClock
    from study.errors import StudyError
    from study.workflows.views.watch_session import follow

    connection = Connection(descriptor)
    clock, follower = RealClock(), follow(Path(session_path))
    # Anything that can be read here means the end: a word to close, or a parent that is gone.
    while not connection.poll(POLL_EVERY_S):
        try:
            view = follower.look(clock.utc())
        except StudyError as error:
            view = None
            _send_view(connection, f"{error.happened} {error.do_now}")
        if view is not None and not _send_view(connection, view):
            return


def _send_view(connection: Connection, what: WatchView | str) -> bool:
    try:
        connection.send(what)
    except OSError:
        return False
    return True
