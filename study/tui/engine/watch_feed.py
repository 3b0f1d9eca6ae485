"""Source of the views of a running session, for the experimenter's screen.

A child process reads the session's log at short intervals and sends views; the screen takes the latest view without
waiting for the disk.
"""

import contextlib
import subprocess
import threading
from multiprocessing.connection import Connection

from study.session.watching.watch_view import WatchView
from study.tui.engine.child_process import start_child

LOG_POLL_INTERVAL_S = 0.2
"""Interval at which the child process reads the log (s). Chosen: no noticeable delay of the view."""
CHILD_EXIT_TIMEOUT_S = 2.0
"""Longest wait (s) for the child process to end, and then for the reading thread. Chosen: ten times
`LOG_POLL_INTERVAL_S`."""


class WatchFeed:
    """Implementation of `study.tui.watch.watch_source.WatchSource`, whose docstrings apply. session_path: folder of the
    session. The child process ends with `close`, and when this process ends."""

    def __init__(self, session_path: str) -> None:
        self._connection, self._child = start_child("study.tui.engine.watch_feed", "feed", session_path)
        self._latest: WatchView | None = None
        self.problem = ""
        self._is_closing = False
        self._reader = threading.Thread(target=self._receive_views, daemon=True, name="watch-feed")
        self._reader.start()

    def latest(self) -> WatchView | None:
        return self._latest

    @property
    def child_pid(self) -> int:
        return self._child.pid

    def close(self) -> None:
        """End the child process; kill it if it has not ended after `CHILD_EXIT_TIMEOUT_S`. Further calls do nothing."""
        if self._is_closing:
            return
        self._is_closing = True
        with contextlib.suppress(OSError):
            self._connection.send(None)
        try:
            self._child.wait(CHILD_EXIT_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._reader.join(CHILD_EXIT_TIMEOUT_S)
        self._connection.close()

    def _receive_views(self) -> None:
        """Store the views and problems that the child process sends, until it ends. Runs in a thread."""
        while True:
            try:
                view_or_problem = self._connection.recv()
            except (EOFError, OSError):
                if not self._is_closing and not self.problem:
                    self.problem = "the program that reads the log has ended; leave, and watch again."
                return
            if isinstance(view_or_problem, WatchView):
                self._latest, self.problem = view_or_problem, ""
            else:
                self.problem = view_or_problem


def feed(descriptor: int, session_path: str) -> None:
    """Main function of the child process: send a view of the session at intervals of `LOG_POLL_INTERVAL_S`, nothing
    while its log has no complete line, or the problem if the log cannot be read, until the parent ends it. descriptor:
    of its end of the pipe. The imports are inside, because the screen's process, which imports this module, must not
    load them."""
    from pathlib import Path

    from study.devices.clock import RealClock
    from study.errors import StudyError
    from study.workflows.views.watch_session import follow

    connection = Connection(descriptor)
    clock, follower = RealClock(), follow(Path(session_path))
    # Anything to read means the end: the message of `close`, or the end of the pipe when the parent has ended.
    while not connection.poll(LOG_POLL_INTERVAL_S):
        try:
            view = follower.look(clock.utc())
        except StudyError as error:
            view = None
            _send_view(connection, f"{error.happened} {error.do_now}")
        if view is not None and not _send_view(connection, view):
            return


def _send_view(connection: Connection, view_or_problem: WatchView | str) -> bool:
    """Send a view, or a problem as a sentence. Returns False if the parent process has ended."""
    try:
        connection.send(view_or_problem)
    except OSError:
        return False
    return True
