"""What a test of the loop's process waits for, with a bound."""

import contextlib
import os
import time

LATEST_S = 20.0
"""For what takes a fraction of a second on a quiet computer."""


def becomes(true) -> None:
    until_s = time.monotonic() + LATEST_S
    while not true():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def runs(pid: int) -> bool:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, 0)
        return True
    return False
