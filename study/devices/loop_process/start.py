"""Starts the loop's process and opens the pipes to it, for `remote_device`.

The process is a new interpreter (`serve.run`). `multiprocessing` is not used, because it would run the caller's main
module again and leave the new process attached to the terminal; a fork is not used, because the caller has threads.
"""

import contextlib
import os
import signal
import subprocess
import sys
from multiprocessing import Pipe
from typing import Any

from study.devices.loop_process.call_pipe import PIPE_NAMES, CallPipe, PipeEnd
from study.errors import DeviceError

KILL_TIMEOUT_S = 2.0
"""Timeout (s) for the system to end a process that was killed. Chosen."""


class LoopProcess:
    """The process of the device loop, with a `CallPipe` for each group of methods, named as in `PIPE_NAMES`. The
    constructor starts it, and raises `DeviceError` where the system refuses pipes or a process.

    It has its own session (on Windows, process group), so that the terminal's Ctrl-C and Ctrl-Z do not reach it. Its
    pipes are closed when this process ends for any reason. It inherits stderr, for warnings after that.
    """

    def __init__(self) -> None:
        try:
            # Where the system refuses one of them, the others are closed by their destructors.
            pipe_pairs = [Pipe() for _ in PIPE_NAMES]
        except OSError as error:
            raise _make_start_error(error) from error
        child_ends = [pipe_end for _, pipe_end in pipe_pairs]
        try:
            self._process = _start_process([pipe_end.fileno() for pipe_end in child_ends], child_ends)
        except OSError as error:
            for caller_end, _ in pipe_pairs:
                caller_end.close()
            raise _make_start_error(error) from error
        finally:
            for pipe_end in child_ends:
                pipe_end.close()
        self._killed = False
        try:
            self.pid = self._process.pid
            self.work, self.signs, self.look, self.stop, self.close = (
                CallPipe(caller_end, name) for (caller_end, _), name in zip(pipe_pairs, PIPE_NAMES, strict=True)
            )
        except BaseException:  # interrupted, or no more threads: nothing is held yet
            self.kill()
            raise

    def hang_up(self) -> None:
        """Close the pipes after the queued calls: the process then fades the force and ends by itself."""
        for pipe in (self.work, self.signs, self.look, self.stop, self.close):
            pipe.close_after_calls()

    def kill(self) -> None:
        """Kill the process: only the watchdog of the device, if it has one, then drops the force."""
        self._killed = True
        self._process.kill()

    def end(self, timeout_s: float) -> str:
        """Wait for timeout_s (s) until the process ends, else kill it. Returns how it ended, as the end of a
        sentence for a message."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout_s)
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


def _start_process(handles: list[int], pipe_ends: list[PipeEnd]) -> "subprocess.Popen[bytes]":
    """Start an interpreter that runs `serve.run`. handles: file descriptors (on Windows, handles) of the ends of the
    pipes that it inherits; pipe_ends: those ends, referenced so that they stay open until then. Raises OSError."""
    run_call = f"run({', '.join(map(str, (os.getpid(), *handles)))})"
    program_text = (
        f"import sys; sys.path[:] = {sys.path!r}; from study.devices.loop_process.serve import run; {run_call}"
    )
    popen_options: dict[str, Any]
    if sys.platform == "win32":
        for handle in handles:
            os.set_handle_inheritable(handle, True)
        popen_options = {"close_fds": False, "creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    else:
        popen_options = {"pass_fds": handles, "start_new_session": True}
    return subprocess.Popen(
        [sys.executable, "-c", program_text], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, **popen_options
    )


def _make_start_error(error: OSError) -> DeviceError:
    """Make the error for pipes or a process that the system refuses."""
    return DeviceError(
        "The device's loop cannot be started",
        f"The system refused to start the process for it: {error.strerror or error}.",
        "Close other programs, then try again.",
    )


def _name_signal(signal_number: int) -> str:
    """Return the name of a signal, such as SIGKILL; its number where the system has no name for it."""
    try:
        return signal.Signals(signal_number).name
    except ValueError:
        return str(signal_number)
