"""Real-time scheduling of the loop's thread, and locking of its memory (no swapping), where the system allows them.

`realtime_drive`, `force_dimension.rig` and `opening.raise_thread_priority` enter `request_real_time_class` in their
threads. Where the system refuses the rights, the loop runs without them; `check_real_time_rights` reports that with the
remedy (`hapteq doctor`).

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
loop has requested it. Chosen: half a tick at 1 kHz. Python's default is 5 ms."""

LOCK_CURRENT_ON_FAULT = 1 | 4
"""Flags MCL_CURRENT | MCL_ONFAULT of mlockall(2): lock the pages that are mapped now, each at its first use, so that
reserved but unused memory occupies no RAM."""

LOCK_FUTURE = 2
"""Flag MCL_FUTURE of mlockall(2): lock pages mapped later as well. Used only where locked memory has no limit:
allocations beyond a limit would fail and end the program."""

RT_RUNTIME_PATH = Path("/proc/sys/kernel/sched_rt_runtime_us")
"""File with the time in µs per period (by default 1 s) that Linux grants to real-time threads; -1: all of it."""

STARVING_ADVICE = (
    "This computer lets such a loop take a whole core for itself (kernel.sched_rt_runtime_us is -1): while it hangs, "
    "what would stop it may never run. As administrator: sysctl -w kernel.sched_rt_runtime_us=950000"
)
"""Advice where `_may_starve_others`: restores Linux's default, 95 % for real-time threads."""

WINDOWS_TIME_CRITICAL = 15
"""THREAD_PRIORITY_TIME_CRITICAL of Windows' SetThreadPriority: the highest priority of a thread in its process's
class."""

LINUX_ADVICE = (
    "As administrator, write the lines '@haptics - rtprio 50' and '@haptics - memlock unlimited' into "
    "/etc/security/limits.d/haptics.conf, add the account to the group haptics, and log in anew."
)
"""Advice where Linux refuses the priority or the memory lock; rtprio 50 permits `PRIORITY`."""


@dataclass(frozen=True, slots=True)
class GrantedRights:
    """Rights that the operating system granted to the loop."""

    scheduled: bool
    """Whether the thread has the real-time class; on Windows also whether the timer resolution is 1 ms."""
    locked: bool
    """Whether the program's memory is locked."""
    advice: str
    """How to get what was not granted; empty where all was."""


class _SettingsUsers:
    """Reference counter for settings of the whole program (switch interval, memory lock, timer): users change them, the
    last to end restores them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._user_count = 0
        self._undo_functions: list[Callable[[], object]] = []
        self._original_switch_s = 0.0

    def add_user(self) -> GrantedRights:
        """Request the class for the calling thread, and the memory lock; the first user also shortens the switch
        interval. Returns what was granted."""
        with self._lock:
            granted, undo = _request_real_time()  # for each user: the class is a thread's, and new pages are locked
            if self._user_count == 0:
                self._original_switch_s = sys.getswitchinterval()
                sys.setswitchinterval(min(SWITCH_INTERVAL_S, self._original_switch_s))
            self._user_count += 1
            self._undo_functions.append(undo)
            return granted

    def remove_user(self) -> None:
        """Remove a user; the last one restores the switch interval, the memory lock and the timer."""
        with self._lock:
            self._user_count -= 1
            if self._user_count == 0:
                while self._undo_functions:
                    self._undo_functions.pop()()
                sys.setswitchinterval(self._original_switch_s)


_SETTINGS_USERS = _SettingsUsers()
"""The only counter of this program, because its threads share the settings."""


@contextlib.contextmanager
def request_real_time_class() -> Iterator[GrantedRights]:
    """Context manager that gives the calling thread the real-time class until the thread ends, and locks the program's
    memory until the last user leaves its context. Yields the rights that were granted; a refusal raises nothing."""
    granted = _SETTINGS_USERS.add_user()
    try:
        yield granted
    finally:
        _SETTINGS_USERS.remove_user()


def check_real_time_rights() -> DeviceFinding:
    """Finding on the rights that the system grants to this account, determined by a request in a separate thread."""
    granted_rights: list[GrantedRights] = []

    def request_rights() -> None:
        with request_real_time_class() as granted:
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
        return RT_RUNTIME_PATH.read_text("ascii").strip() == "-1"
    except (OSError, ValueError):  # another system, or a kernel without this file
        return False


def _request_real_time() -> tuple[GrantedRights, Callable[[], None]]:
    """Request the class for the calling thread, and the memory lock, as this system offers them. Also returns the
    function that undoes the memory lock (Linux) or the timer resolution (Windows); the class ends with the thread."""
    if platform.system() == "Linux":
        return _request_on_linux(ctypes.CDLL(None, use_errno=True))
    windll = getattr(ctypes, "windll", None)
    if windll is not None:
        return _request_on_windows(windll)
    return GrantedRights(False, False, "This system offers none: close other programs."), lambda: None


def _request_on_linux(libc: Any) -> tuple[GrantedRights, Callable[[], None]]:
    """Request SCHED_FIFO for the calling thread, then the memory lock."""
    try:
        # RESET_ON_FORK: a program that is started from here does not inherit the class.
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(threading.get_native_id(), policy, os.sched_param(PRIORITY))
        scheduled = True
    except (OSError, AttributeError):  # AttributeError: a Python without these functions
        scheduled = False
    try:
        locked = libc.mlockall(LOCK_CURRENT_ON_FAULT | (LOCK_FUTURE if _has_unlimited_memory() else 0)) == 0
    except AttributeError:
        locked = False
    advice = "" if scheduled and locked else LINUX_ADVICE
    return GrantedRights(scheduled, locked, advice), libc.munlockall if locked else lambda: None


def _has_unlimited_memory() -> bool:
    """Whether the account may lock memory without a limit."""
    import resource  # not on Windows

    return resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY


def _request_on_windows(windll: Any) -> tuple[GrantedRights, Callable[[], None]]:
    """Request a timer resolution of 1 ms instead of 16 ms, and the priority `WINDOWS_TIME_CRITICAL` for the calling
    thread. The memory of a whole program is not locked on Windows."""
    has_fine_timer = windll.winmm.timeBeginPeriod(1) == 0
    kernel32 = windll.kernel32
    kernel32.GetCurrentThread.restype = ctypes.c_void_p
    scheduled = bool(kernel32.SetThreadPriority(ctypes.c_void_p(kernel32.GetCurrentThread()), WINDOWS_TIME_CRITICAL))
    advice = "Windows locks no program's memory: close other programs, and leave memory free."
    undo = (lambda: windll.winmm.timeEndPeriod(1)) if has_fine_timer else (lambda: None)
    return GrantedRights(scheduled and has_fine_timer, False, advice), undo
