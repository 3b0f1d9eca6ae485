"""Read lines from a terminal or a pipe with a timeout, so that a waiting program can keep the device alive.

The file descriptor is read directly (`select`, `os.read`), because buffered input of Python knows no timeout.
"""

import os
import select
import sys


class LineInput:
    """Reads lines from a file descriptor; by default from standard input. `interactive`: whether it is a terminal."""

    def __init__(self, descriptor: int | None = None) -> None:
        self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self._pending = b""
        self._at_end = False
        self.interactive = os.isatty(self._descriptor)

    def read(self, timeout_s: float) -> str | None:
        """The next line, decoded as UTF-8, without surrounding blanks; None if no whole line comes within `timeout_s`
        (s). Raises EOFError at the end of the input."""
        line = self._take_line()
        if line is not None:
            return line
        ready, _, _ = select.select([self._descriptor], [], [], timeout_s)
        if not ready:
            return None
        if self._read_available():
            return self._take_line()
        if not self._line_is_left():
            raise EOFError
        self._pending += b"\n"
        return self._take_line()

    def has_ended(self) -> bool:
        """Whether the input has ended and no line is left. Does not wait, and consumes no line."""
        while b"\n" not in self._pending and not self._at_end:
            if not select.select([self._descriptor], [], [], 0.0)[0]:
                return False
            self._read_available()
        return not self._line_is_left()

    def forget(self) -> None:
        """Drop lines that were typed at a terminal before now. Lines of a pipe are kept."""
        if not self.interactive:
            return
        import termios

        termios.tcflush(self._descriptor, termios.TCIFLUSH)
        self._pending = b""

    def _read_available(self) -> bool:
        """Read the available bytes into the buffer. False at the end of the input."""
        data = os.read(self._descriptor, 4096)
        self._at_end = not data
        self._pending += data
        return not self._at_end

    def _line_is_left(self) -> bool:
        """Whether a line is left at the end of the input. The last one of a pipe needs no line end, as for other
        programs; what a person typed without Enter is no line."""
        return b"\n" in self._pending or (self._pending != b"" and not self.interactive)

    def _take_line(self) -> str | None:
        """Remove the first whole line from the buffer; None if there is none."""
        line, newline, remainder = self._pending.partition(b"\n")
        if not newline:
            return None
        self._pending = remainder
        return line.decode("utf-8", errors="replace").strip()
