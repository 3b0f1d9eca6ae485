"""Starts the loop's process and opens the pipes to it.

Not `multiprocessing`: that would run the caller's main module again in there, and hand the terminal on. Not a fork: the
caller has threads.
"""

import contextlib
import os
import signal
import subprocess
import sys
from multiprocessing import Pipe
from typing import Any

from study.devices.loop_process.line import LINES, End, Line
from study.errors import DeviceError

DEAD_S = 2.0
"""Timeout for the system to end a process that was killed."""


class LoopProcess:
    """Raises `DeviceError` where the system starts none.

    It has a session of its own: the terminal's Ctrl-C and Ctrl-Z do not reach it. It sees the end of its pipes when
    this process ends for any reason. What it must say past all pipes goes to this process's stderr.
    """

    def __init__(self) -> None:
        pairs = [Pipe() for _ in LINES]
        child_ends = [end for _, end in pairs]
        try:
            self._process = _start([end.fileno() for end in child_ends], child_ends)
        except OSError as error:
            for own_end, _ in pairs:
                own_end.close()
            raise DeviceError(
                "The device's loop cannot be started",
                f"The system refused to start the process for it: {error.strerror or error}.",
                "Close other programs, then try again.",
            ) from error
        finally:
            for end in child_ends:
                end.close()
        self._killed = False
        try:
            self.pid = self._process.pid
            self.work, self.signs, self.look, self.stop, self.close = (
                Line(own_end, name) for (own_end, _), name in zip(pairs, LINES, strict=True)
            )
        except BaseException:  # interrupted, or no more threads: nothing is held yet
            self.kill()
            raise

    def hang_up(self) -> None:
        """Ask it to release the force and to end by itself."""
        for line in (self.work, self.signs, self.look, self.stop, self.close):
            line.end()

    def kill(self) -> None:
        """Kill it: the device's own watchdog then drops the force."""
        self._killed = True
        self._process.kill()

    def end(self, patience_s: float) -> str:
        """How it ended. A process that does not end by itself is killed."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(patience_s)
        if self._process.returncode is None:
            self.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(DEAD_S)
        code = self._process.returncode
        if code is None:
            return "was killed, but has not ended"
        if self._killed:
            return "and was killed"
        return f"by signal {_signal_name(-code)}" if code < 0 else f"with code {code}"


def _start(handles: list[int], ends: list[End]) -> "subprocess.Popen[bytes]":
    call = f"run({', '.join(map(str, (os.getpid(), *handles)))})"
    program = f"import sys; sys.path[:] = {sys.path!r}; from study.devices.loop_process.serve import run; {call}"
    popen_options: dict[str, Any]
    if sys.platform == "win32":
        for handle in handles:
            os.set_handle_inheritable(handle, True)
        popen_options = {"close_fds": False, "creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    else:
        popen_options = {"pass_fds": handles, "start_new_session": True}
    return subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, **popen_options
    )


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return str(number)
