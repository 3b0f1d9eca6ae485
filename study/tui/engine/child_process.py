"""Start a child process of the terminal interface, connected by a pipe.

`multiprocessing` is not used to start it: its child would inherit the terminal, and it cannot start a process while
Textual has replaced stdout and stderr.
"""

import socket
import subprocess
import sys
from multiprocessing.connection import Connection
from typing import IO


def start_child(
    module: str, function: str, *arguments: str, output: IO[bytes] | int = subprocess.DEVNULL
) -> tuple[Connection, "subprocess.Popen[bytes]"]:
    """Run a function of a module in a new process; returns this process's end of the pipe, and the process.

    The function is called with the file descriptor of the child's end of the pipe, then `arguments`. Module and
    function are given by name, so that the module is not imported here. output: receives what the child prints.

    The child has its own POSIX session: the terminal's Ctrl-C and Ctrl-Z do not reach it, and it cannot write to the
    screen. It uses this process's import path. When this process ends, the pipe closes, which the child reads as end
    of file. Raises OSError where the process cannot be started.
    """
    parent_end, child_end = socket.socketpair()
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
    return Connection(parent_end.detach()), process
