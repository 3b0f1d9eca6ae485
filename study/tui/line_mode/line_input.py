"""Read lines from a terminal or a pipe with a timeout, so that the waiting program can serve the device's watchdog.

The file descriptor is read directly (`select`, `os.read`), because Python's buffered input has no timeout.
"""

import os
import select
import sys


class LineInput:
    """Reader of lines from a file descriptor, with a buffer for incomplete lines. `is_interactive`: whether the input
    is a terminal."""

    def __init__(self, descriptor: int | None = None) -> None:
        """descriptor: file descriptor of a terminal or pipe; None: standard input."""
        self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self._buffer = b""
        self._has_reached_end = False
        self.is_interactive = os.isatty(self._descriptor)

    def read(self, timeout_s: float) -> str | None:
        """Read the next line, decoded as UTF-8, without surrounding blanks. None if nothing arrives within `timeout_s`
        (s), or if what arrives first is an incomplete line; the last line of a pipe needs no line end. Raises EOFError
        at the end of the input."""
        line = self._take_line()
        if line is not None:
            return line
        ready, _, _ = select.select([self._descriptor], [], [], timeout_s)
        if not ready:
            return None
        if self._read_available():
            return self._take_line()
        if not self._has_remaining_line():
            raise EOFError
        self._buffer += b"\n"
        return self._take_line()

    def has_ended(self) -> bool:
        """Whether the input has ended and all lines were returned. Does not wait, and consumes no line."""
        while b"\n" not in self._buffer and not self._has_reached_end:
            if not select.select([self._descriptor], [], [], 0.0)[0]:
                return False
            self._read_available()
        return not self._has_remaining_line()

    def discard_early_lines(self) -> None:
        """Discard all input typed at a terminal before this call, complete lines included. Lines of a pipe are kept."""
        if not self.is_interactive:
            return
        import termios

        termios.tcflush(self._descriptor, termios.TCIFLUSH)
        self._buffer = b""

    def _read_available(self) -> bool:
        """Read available bytes into the buffer, at most 4096 per call (chosen). Returns False at the end of the
        input."""
        received_bytes = os.read(self._descriptor, 4096)
        self._has_reached_end = not received_bytes
        self._buffer += received_bytes
        return not self._has_reached_end

    def _has_remaining_line(self) -> bool:
        """Whether the buffer holds a line at the end of the input. The last line of a pipe needs no line end; text
        typed at a terminal without Enter is no line."""
        return b"\n" in self._buffer or (self._buffer != b"" and not self.is_interactive)

    def _take_line(self) -> str | None:
        """Remove the first complete line from the buffer and return it; None if there is none."""
        line, newline, remainder = self._buffer.partition(b"\n")
        if not newline:
            return None
        self._buffer = remainder
        return line.decode("utf-8", errors="replace").strip()
