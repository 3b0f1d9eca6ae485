"""The terminal goes away, and the program with it."""

import contextlib
import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

ROOT = Path(__file__).parents[3]


@pytest.fixture
def started(tmp_path):
    """The start screen in a terminal that is not its controlling one, so that no hang-up tells it anything."""
    end, slave = pty.openpty()
    paths = os.pathsep.join((str(ROOT), str(ROOT / "study" / "launcher")))
    command = [sys.executable, "-m", "study", "study", "--data", str(tmp_path)]
    process = subprocess.Popen(
        command,
        stdin=slave,
        stdout=slave,
        stderr=slave,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": paths},
    )
    os.close(slave)
    seen = b""
    while b"Participant" not in seen:
        assert select.select([end], [], [], 30.0)[0]
        seen += os.read(end, 65536)
    yield process, end
    process.kill()
    process.wait()


def test_a_terminal_that_vanishes_without_a_word_ends_the_program(started):
    process, end = started
    os.close(end)
    assert process.wait(timeout=30.0) == 130


def test_a_polite_kill_gives_the_terminal_back(started):
    process, end = started
    process.send_signal(signal.SIGTERM)
    seen, until_s = b"", time.monotonic() + 30.0
    while process.poll() is None and time.monotonic() < until_s:
        if select.select([end], [], [], 0.05)[0]:
            with contextlib.suppress(OSError):  # the other end is closed
                seen += os.read(end, 65536)
    assert process.wait(timeout=10.0) == 130
    assert b"\x1b[?1049l" in seen
    os.close(end)
