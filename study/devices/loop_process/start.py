"""Starts the loop's process and opens the pipes to it, for `remote_device`.

Not by `multiprocessing`, which would run the caller's main module again in the new process and leave it the terminal.
Not by a fork, because the caller has threads.
"""

import contextlib
import os
import signal
import subprocess
import sys
from multiprocessing import Pipe
from typing import Any

from study.devices.loop_process.line import LINE_NAMES, Line, PipeEnd
from study.errors import DeviceError

KILL_TIMEOUT_S = 2.0
"""Timeout for the system to end a process that was killed."""


class LoopProcess:
    """The process of the device loop, with a `Line` for each of `LINE_NAMES`. The constructor starts it, and raises
    `DeviceError` where the system refuses.

    It has a separate session, so that the terminal's Ctrl-C and Ctrl-Z do not reach it. Its pipes are closed when this
    process ends for any reason. It inherits this process's stderr, for warnings after its pipes are closed.
    """

    def __init__(self) -> None:
        pairs = [Pipe() for _ in LINE_NAMES]
        child_ends = [end for _, end in pairs]
        try:
            self._process = _start_process([end.fileno() for end in child_ends], child_ends)
        except OSError as error:
            for caller_end, _ in pairs:
                caller_end.close()
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
                Line(caller_end, name) for (caller_end, _), name in zip(pairs, LINE_NAMES, strict=True)
            )
        except BaseException:  # interrupted, or no more threads: nothing is held yet
            self.kill()
            raise

    def hang_up(self) -> None:
        """Close the pipes after the queued calls: the process then fades the force and ends by itself."""
        for line in (self.work, self.signs, self.look, self.stop, self.close):
            line.end()

    def kill(self) -> None:
        """Kill the process: the device's own watchdog then drops the force."""
        self._killed = True
        self._process.kill()

    def end(self, patience_s: float) -> str:
        """Wait for patience_s (s) until the process ends, else kill it. Returns how it ended, as a predicate for a
        message."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(patience_s)
        if self._process.returncode is None:
            self.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(KILL_TIMEOUT_S)
        return_code = self._process.returncode
        if return_code is None:
            return "was killed, but has not ended"
        if self._killed:
            return "and was killed"
        return f"by signal {_name_signal(-return_code)}" if return_code < 0 else f"with code {return_code}"


def _start_process(handles: list[int], ends: list[PipeEnd]) -> "subprocess.Popen[bytes]":
    """Start an interpreter that runs `serve.run`. handles: file descriptors (on Windows, handles) of the ends of the
    pipes that it inherits; ends: those ends, which must stay open meanwhile. Raises OSError."""
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


def _name_signal(signal_number: int) -> str:
    """Name of a signal, such as SIGKILL; its number where the system has no name for it."""
    try:
        return signal.Signals(signal_number).name
    except ValueError:
        return str(signal_number)
