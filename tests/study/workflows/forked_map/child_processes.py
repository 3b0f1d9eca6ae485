"""Child processes of this one, without those of earlier tests; and a piece of work that takes 50 ms."""

import os
import time
from pathlib import Path

left_by_earlier_tests: set[int] = set()


def children() -> list[int]:
    """Processes that this one has, but for those that tests before it have left to the libraries."""
    found = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
    return [int(pid) for pid in found if int(pid) not in left_by_earlier_tests]


def slow(number: float) -> tuple[float, int]:
    time.sleep(0.05)
    return number, os.getpid()
