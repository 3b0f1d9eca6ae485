"""Real-time scheduling of the loop's thread, and locking of its memory (no swapping), where the system allows them.

Where the system refuses them, `check_real_time_rights` reports that with the remedy, and the loop runs without them.
The priority is below that of interrupt threads (50 on Linux), because the device's own USB transfers must come first. A
loop that hangs cannot starve the computer under Linux's default, which reserves 5 % of every second for ordinary
threads (`sched_rt_runtime_us`); where that is switched off, the finding reports it.

Reference: Linux manual pages sched(7), mlockall(2).
"""

import contextlib
import ctypes
import os
import platform
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from study.session.views.participant_views import DeviceFinding

PRIORITY = 40
"""Real-time priority of the loop's thread under SCHED_FIFO of Linux, 1 to 99: below interrupt threads (50)."""
SWITCH_INTERVAL_S = 0.0005
"""Switch interval of the interpreter (s): time for which another Python thread keeps the interpreter lock after the
loop has requested it. Python's default is 5 ms."""

LOCK_CURRENT_ON_FAULT = 1 | 4
"""Flags MCL_CURRENT | MCL_ONFAULT of mlockall(2): lock the pages that are mapped now, each at its first use, so that
reserved but unused memory occupies no RAM."""

LOCK_FUTURE = 2
"""Flag MCL_FUTURE of mlockall(2): lock pages mapped later as well. Used only where locked memory has no limit:
allocations beyond a limit would fail and end the program."""

RT_RUNTIME = Path("/proc/sys/kernel/sched_rt_runtime_us")
"""File with the time in µs per period (by default 1 s) that Linux grants to real-time threads; -1: all of it."""

STARVING_ADVICE = (
    "This computer lets such a loop take a whole core for itself (kernel.sched_rt_runtime_us is -1): while it hangs, "
    "what would stop it may never run. As administrator: sysctl -w kernel.sched_rt_runtime_us=950000"
)

WINDOWS_TIME_CRITICAL = 15
"""THREAD_PRIORITY_TIME_CRITICAL of Windows."""

LINUX_ADVICE = (
    "As administrator, write the lines '@haptics - rtprio 50' and '@haptics - memlock unlimited' into "
    "/etc/security/limits.d/haptics.conf, add the account to the group haptics, and log in anew."
)


@dataclass(frozen=True, slots=True)
class GrantedRights:
    """Rights that the operating system granted to the loop."""

    scheduled: bool
    """Whether the thread has the real-time class."""
    locked: bool
    """Whether the program's memory is locked."""
    advice: str
    """How to get what was not granted; empty where all was."""


class _SettingsUsers:
    """Reference counter for settings of the whole program (switch interval, memory lock, timer): the first user changes
    them, the last to end restores them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._count = 0
        self._undos: list[Callable[[], object]] = []
        self._switch_s = 0.0

    def add_user(self) -> GrantedRights:
        """Add a user, in whose thread the class is requested."""
        with self._lock:
            granted, undo = _request_class()  # for each user: the class belongs to a thread, memory grows
            if self._count == 0:
                self._switch_s = sys.getswitchinterval()
                sys.setswitchinterval(min(SWITCH_INTERVAL_S, self._switch_s))
            self._count += 1
            self._undos.append(undo)
            return granted

    def remove_user(self) -> None:
        """Remove a user; the last one restores all settings."""
        with self._lock:
            self._count -= 1
            if self._count == 0:
                while self._undos:
                    self._undos.pop()()
                sys.setswitchinterval(self._switch_s)


_USERS = _SettingsUsers()
"""The only counter of this program, because its threads share the settings."""


@contextlib.contextmanager
def real_time_class() -> Iterator[GrantedRights]:
    """Context manager that gives the calling thread the real-time class until the thread ends, and locks the program's
    memory until the last user leaves its context. Yields the rights that were granted; a refusal raises nothing."""
    granted = _USERS.add_user()
    try:
        yield granted
    finally:
        _USERS.remove_user()


def check_real_time_rights() -> DeviceFinding:
    """Finding on the rights that the system grants to this account, determined by a request in a separate thread."""
    granted_rights: list[GrantedRights] = []

    def request_rights() -> None:
        with real_time_class() as granted:
            granted_rights.append(granted)

    thread = threading.Thread(target=request_rights, name="real-time class")
    thread.start()
    thread.join()
    (granted,) = granted_rights
    clauses = [
        "the loop goes before all other programs" if granted.scheduled else "other programs may delay the loop",
        "its memory stays" if granted.locked else "its memory may be swapped",
    ]
    may_starve = granted.scheduled and _may_starve_others()
    if may_starve:
        clauses.append("a loop that hangs may starve them")
    has_all_rights = granted.scheduled and granted.locked and not may_starve
    advice = " ".join(filter(None, (granted.advice, STARVING_ADVICE if may_starve else "")))
    return DeviceFinding("Priority", "; ".join(clauses), has_all_rights, advice, warning=not has_all_rights)


def _may_starve_others() -> bool:
    """Whether real-time threads may take all of the processor time, so that a loop that hangs blocks other programs."""
    try:
        return RT_RUNTIME.read_text("ascii").strip() == "-1"
    except (OSError, ValueError):  # another system, or a kernel without this file
        return False


def _request_class() -> tuple[GrantedRights, Callable[[], None]]:
    """Request the class of the calling thread and the memory lock. Also returns the function that undoes what does not
    end with the thread."""
    if platform.system() == "Linux":
        return _request_on_linux(ctypes.CDLL(None, use_errno=True))
    windows = getattr(ctypes, "windll", None)
    if windows is not None:
        return _request_on_windows(windows)
    return GrantedRights(False, False, "This system offers none: close other programs."), lambda: None


def _request_on_linux(library: Any) -> tuple[GrantedRights, Callable[[], None]]:
    """Request SCHED_FIFO for the calling thread, then the memory lock."""
    try:
        # RESET_ON_FORK: a program that is started from here does not inherit the class.
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(threading.get_native_id(), policy, os.sched_param(PRIORITY))
        scheduled = True
    except (OSError, AttributeError):  # AttributeError: a Python without these functions
        scheduled = False
    try:
        locked = library.mlockall(LOCK_CURRENT_ON_FAULT | (LOCK_FUTURE if _has_unlimited_memory() else 0)) == 0
    except AttributeError:
        locked = False
    advice = "" if scheduled and locked else LINUX_ADVICE
    return GrantedRights(scheduled, locked, advice), library.munlockall if locked else lambda: None


def _has_unlimited_memory() -> bool:
    """Whether the account may lock memory without a limit."""
    import resource  # not on Windows

    return resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY


def _request_on_windows(windows: Any) -> tuple[GrantedRights, Callable[[], None]]:
    """Request a timer resolution of 1 ms instead of 16 ms, and the priority `WINDOWS_TIME_CRITICAL` for the calling
    thread. The memory of a whole program is not locked on Windows."""
    has_fine_timer = windows.winmm.timeBeginPeriod(1) == 0
    kernel = windows.kernel32
    kernel.GetCurrentThread.restype = ctypes.c_void_p
    scheduled = bool(kernel.SetThreadPriority(ctypes.c_void_p(kernel.GetCurrentThread()), WINDOWS_TIME_CRITICAL))
    advice = "Windows locks no program's memory: close other programs, and leave memory free."
    undo = (lambda: windows.winmm.timeEndPeriod(1)) if has_fine_timer else (lambda: None)
    return GrantedRights(scheduled and has_fine_timer, False, advice), undo
