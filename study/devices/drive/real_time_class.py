"""The loop's thread before all others of the computer, and its memory kept from being swapped, where the system allows.

What is not allowed is said, with the cure, and everything goes on without it. Below the priority of interrupt threads
(50 on Linux): the device's own USB must go first. A loop that hangs starves nothing: Linux leaves the ordinary threads
5 % of every second.
"""

import contextlib
import ctypes
import os
import platform
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from study.session.views.views import DeviceFinding

PRIORITY = 40
SWITCH_S = 0.0005
"""How long another thread of this program may keep the interpreter once the loop wants it; Python's own is 5 ms."""

PRESENT_WHEN_TOUCHED = 1 | 4
"""MCL_CURRENT | MCL_ONFAULT: what is mapped now, page by page as it is used; reserved room is not filled."""

TIME_CRITICAL = 15
"""THREAD_PRIORITY_TIME_CRITICAL of Windows."""

LINUX_ADVICE = (
    "As administrator, write the lines '@haptics - rtprio 50' and '@haptics - memlock unlimited' into "
    "/etc/security/limits.d/haptics.conf, add the account to the group haptics, and log in anew."
)


@dataclass(frozen=True, slots=True)
class Granted:
    scheduled: bool
    locked: bool
    advice: str
    """How to get what was not granted; empty where all was."""


@contextlib.contextmanager
def real_time_class() -> Iterator[Granted]:
    """For the calling thread until it ends, and for the program's memory as long as this lasts. Raises nothing."""
    switch_s = sys.getswitchinterval()
    sys.setswitchinterval(min(SWITCH_S, switch_s))
    granted, undo = _asked_for()
    try:
        yield granted
    finally:
        undo()
        sys.setswitchinterval(switch_s)


def real_time_finding() -> DeviceFinding:
    """What this account would be granted, tried in a thread of its own."""
    found: list[Granted] = []

    def ask() -> None:
        with real_time_class() as granted:
            found.append(granted)

    thread = threading.Thread(target=ask, name="real-time class")
    thread.start()
    thread.join()
    (granted,) = found
    told = (
        "the loop goes before all other programs" if granted.scheduled else "other programs may delay the loop",
        "its memory stays" if granted.locked else "its memory may be swapped",
    )
    fine = granted.scheduled and granted.locked
    return DeviceFinding("Priority", "; ".join(told), fine, granted.advice, warning=not fine)


def _asked_for() -> tuple[Granted, Callable[[], None]]:
    """And what takes back what the thread's end does not."""
    if platform.system() == "Linux":
        return _of_linux(ctypes.CDLL(None, use_errno=True))
    windows = getattr(ctypes, "windll", None)
    if windows is not None:
        return _of_windows(windows)
    return Granted(False, False, "This system offers none: close other programs."), lambda: None


def _of_linux(library: Any) -> tuple[Granted, Callable[[], None]]:
    try:
        # A program that is started from here must not inherit it.
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(threading.get_native_id(), policy, os.sched_param(PRIORITY))
        scheduled = True
    except (OSError, AttributeError):  # AttributeError: a Python built without it
        scheduled = False
    try:
        locked = library.mlockall(PRESENT_WHEN_TOUCHED) == 0
    except AttributeError:
        locked = False
    advice = "" if scheduled and locked else LINUX_ADVICE
    return Granted(scheduled, locked, advice), library.munlockall if locked else lambda: None


def _of_windows(windows: Any) -> tuple[Granted, Callable[[], None]]:
    """Sleeps of 1 ms instead of 16, and the thread's priority. Its memory is locked by no call that a program has."""
    fine_sleep = windows.winmm.timeBeginPeriod(1) == 0
    kernel = windows.kernel32
    kernel.GetCurrentThread.restype = ctypes.c_void_p
    scheduled = bool(kernel.SetThreadPriority(ctypes.c_void_p(kernel.GetCurrentThread()), TIME_CRITICAL))
    advice = "Windows locks no program's memory: close other programs, and leave memory free."
    undo = (lambda: windows.winmm.timeEndPeriod(1)) if fine_sleep else (lambda: None)
    return Granted(scheduled and fine_sleep, False, advice), undo
