"""A real pseudo-terminal with `hapteq` in it: type keys, wait for words, kill."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from pathlib import Path

ESCAPE_SEQUENCE = re.compile(r"\x1b(\[[0-9;?<>=]*[A-Za-z]|[=>])")

ROOT = Path(__file__).resolve().parents[2]


def _own_the_terminal() -> None:
    """So that Ctrl-C typed into it reaches the program as a signal, also when the tests run in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


class Terminal:
    def __init__(self, *arguments: str) -> None:
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
        paths = os.pathsep.join((str(ROOT), str(ROOT / "study" / "launcher")))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "study", *arguments],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env={**os.environ, "PYTHONPATH": paths, "COLUMNS": "100", "LINES": "30"},
            start_new_session=True,
            preexec_fn=_own_the_terminal,
        )
        os.close(slave)
        self.screen = ""

    def type(self, text: str) -> None:
        os.write(self._master, text.encode())

    def wait_for(self, pattern: str, timeout_s: float = 60.0) -> str:
        """Until the pattern appears in what was printed since the last wait; line breaks count as spaces."""
        until_s = time.monotonic() + timeout_s
        fresh = ""
        while not re.search(pattern, " ".join(fresh.split())):
            left_s = until_s - time.monotonic()
            if left_s <= 0:
                raise AssertionError(f"'{pattern}' did not appear in:\n{fresh[-2000:]}")
            if select.select([self._master], [], [], min(left_s, 0.2))[0]:
                fresh += self._read()
            elif self.process.poll() is not None:
                raise AssertionError(f"the program ended without '{pattern}':\n{fresh[-2000:]}")
        return " ".join(fresh.split())

    def press_until(self, key: str, pattern: str, timeout_s: float = 60.0) -> None:
        """Presses the key again where nothing came of it: what is typed before a screen can have been read counts
        for nothing there, and on a busy machine that may last."""
        until_s = time.monotonic() + timeout_s
        while True:
            self.type(key)
            try:
                self.wait_for(pattern, min(15.0, timeout_s))
            except AssertionError:
                if time.monotonic() > until_s or self.process.poll() is not None:
                    raise
            else:
                return

    def drain(self, seconds: float) -> str:
        """What is printed within so many seconds, escape sequences left out."""
        until_s, fresh = time.monotonic() + seconds, ""
        while (left_s := until_s - time.monotonic()) > 0:
            if select.select([self._master], [], [], left_s)[0]:
                fresh += self._read()
        return ESCAPE_SEQUENCE.sub("", fresh)

    def end(self, timeout_s: float = 60.0) -> int:
        """Read to the end; returns the exit code."""
        until_s = time.monotonic() + timeout_s
        while self.process.poll() is None and time.monotonic() < until_s:
            if select.select([self._master], [], [], 0.1)[0]:
                self._read()
        code = self.process.wait(timeout=1)
        while select.select([self._master], [], [], 0)[0] and self._read():
            pass
        return code

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def hang_up(self) -> None:
        """Close the terminal's window: the program gets a hang-up and has no reader."""
        os.close(self._master)
        self._master = -1

    def close(self) -> None:
        if self.process.poll() is None:
            self.kill()
        if self._master >= 0:
            os.close(self._master)

    def _read(self) -> str:
        try:
            text = os.read(self._master, 65536).decode(errors="replace")
        except OSError:
            return ""
        self.screen += text
        return text
