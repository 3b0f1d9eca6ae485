"""Programs, the stub and a board, as they are seen and ended from outside."""

import subprocess
import sys
import time
from pathlib import Path

TESTS = Path(__file__).parents[1]
OFF_S = 6.0
"""Loose, for a busy machine: what stays on for so long is on for good."""

BOARD = f"""
import os, sys, time
sys.path.insert(0, {str(TESTS / "study" / "devices" / "accelerometer")!r})
from pty_board import Board, table_of
board = Board(2000.0)
link, lab = sys.argv[1:]
if os.path.lexists(link):
    os.unlink(link)
os.symlink(board.path, link)
if not os.path.exists(lab):
    open(lab, "w").write(table_of(board).replace(board.path, link))
print("on", flush=True)
time.sleep(3600)
"""


def children(pid: int) -> list[int]:
    found: list[int] = []
    try:
        for task in Path(f"/proc/{pid}/task").iterdir():
            found += map(int, (task / "children").read_text("ascii").split())
    except OSError:  # it ended just now
        return found
    return found


def runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def force_is_on(stub) -> bool:
    return bool(stub.peek("last_write") > 0.2 and stub.peek("force_on"))


def is_off(stub) -> bool:
    """For longer than a period of what is held: a zero crossing is no end."""
    for _ in range(20):
        if stub.get("force_on") and stub.applied_n.any():
            return False
        time.sleep(0.003)
    return True


def goes_off(stub) -> bool:
    until_s = time.monotonic() + OFF_S
    while not is_off(stub):
        if time.monotonic() > until_s:
            return False
    return True


class Board:
    """An accelerometer's board as a program of its own. Each has another pseudo-terminal; the lab's file names a link
    to it."""

    def __init__(self, link: Path, lab: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", BOARD, str(link), str(lab)], stdout=subprocess.PIPE, cwd=TESTS.parent
        )
        assert self.process.stdout.readline() == b"on\n"

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
