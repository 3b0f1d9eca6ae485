"""A process beside the one that draws, and a pipe to it.

Not `multiprocessing`: that hands the terminal on, and cannot start anything while Textual holds stdout and stderr.
"""

import socket
import subprocess
import sys
from multiprocessing.connection import Connection
from typing import IO


def start_child(
    module: str, function: str, *arguments: str, output: IO[bytes] | int = subprocess.DEVNULL
) -> tuple[Connection, "subprocess.Popen[bytes]"]:
    """Run `function(descriptor of its end of the pipe, *arguments)` in a new process. It is named by text because its
    module is not loaded here. What it prints goes to `output`.

    The process has a session of its own: the terminal's Ctrl-C and Ctrl-Z do not reach it, and it cannot write on the
    screen. It uses this process's import path. It sees the end of the pipe when this process ends for any reason.
    Raises OSError where the system refuses.
    """
    own_end, child_end = socket.socketpair()
    with child_end:
        call = f"{function}({', '.join(map(repr, (child_end.fileno(), *arguments)))})"
        program = f"import sys; sys.path[:] = {sys.path!r}; from {module} import {function}; {call}"
        process = subprocess.Popen(
            [sys.executable, "-c", program],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            pass_fds=(child_end.fileno(),),
            start_new_session=True,
        )
    return Connection(own_end.detach()), process
