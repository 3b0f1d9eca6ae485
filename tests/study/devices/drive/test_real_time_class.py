"""The loop before all other programs: asked for by real devices only, said where it is refused, and taken back."""

import contextlib
import os
import sys
import threading
from dataclasses import replace
from types import SimpleNamespace

import pytest

from study.devices.clock import RealClock
from study.devices.drive import real_time_class as module
from study.devices.drive.real_time_class import (
    LINUX_ADVICE,
    PRIORITY,
    STARVING_ADVICE,
    SWITCH_INTERVAL_S,
    check_real_time_rights,
    request_real_time_class,
)
from study.devices.safe import SafeDevice

FIFO, RESET_ON_FORK = 1, 0x40000000
"""As Linux has them, for systems without."""

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="what Linux grants is asked of Linux")


class Library:
    """The C library's part: whether memory may be locked."""

    def __init__(self, allowed: bool) -> None:
        self.allowed, self.locked = allowed, False
        self.flags: list[int] = []

    def mlockall(self, flags: int) -> int:
        self.flags.append(flags)
        self.locked = self.locked or self.allowed
        return 0 if self.allowed else -1

    def munlockall(self) -> None:
        self.locked = False


@pytest.fixture(autouse=True)
def as_linux_comes(monkeypatch, tmp_path):
    """What Linux leaves to ordinary threads: the file that says so."""
    path = tmp_path / "sched_rt_runtime_us"
    path.write_text("950000\n")
    monkeypatch.setattr(module, "RT_RUNTIME_PATH", path)
    return path


@pytest.fixture
def allow(monkeypatch):
    """allow(class, lock): what the system grants from now on. What was asked of the scheduler is in `asked`."""
    asked: list[tuple[int, int]] = []

    def settle(scheduled: bool, locked: bool) -> tuple[Library, list[tuple[int, int]]]:
        def sched(thread: int, policy: int, parameters: SimpleNamespace) -> None:
            if not scheduled:
                raise PermissionError(1, "not permitted")
            asked.append((policy, parameters.sched_priority))

        library = Library(locked)
        monkeypatch.setattr(module.platform, "system", lambda: "Linux")
        monkeypatch.setattr(module.os, "sched_setscheduler", sched, raising=False)
        monkeypatch.setattr(
            module.os, "sched_param", lambda level: SimpleNamespace(sched_priority=level), raising=False
        )
        monkeypatch.setattr(module.os, "SCHED_FIFO", FIFO, raising=False)
        monkeypatch.setattr(module.os, "SCHED_RESET_ON_FORK", RESET_ON_FORK, raising=False)
        monkeypatch.setattr(module.ctypes, "CDLL", lambda name, use_errno: library)
        return library, asked

    return settle


def test_real_time_priority_lasts_as_long_as_the_loop(allow):
    library, asked = allow(True, True)
    before_s = sys.getswitchinterval()
    with request_real_time_class() as granted:
        assert (granted.scheduled, granted.locked, granted.advice) == (True, True, "")
        assert library.locked and sys.getswitchinterval() == pytest.approx(SWITCH_INTERVAL_S)
    assert asked == [(FIFO | RESET_ON_FORK, PRIORITY)]
    assert not library.locked and sys.getswitchinterval() == pytest.approx(before_s)


@pytest.mark.parametrize(("scheduled", "locked"), [(False, False), (True, False), (False, True)])
def test_a_refused_priority_is_a_warning_with_its_remedy(allow, scheduled, locked):
    allow(scheduled, locked)
    finding = check_real_time_rights()
    assert (finding.fine, finding.warning, finding.wrong) == (False, True, False)
    assert finding.advice == LINUX_ADVICE and "rtprio" in finding.advice
    assert ("may delay" in finding.value) == (not scheduled)
    assert ("swapped" in finding.value) == (not locked)


def test_with_all_permissions_there_is_no_warning(allow):
    allow(True, True)
    assert check_real_time_rights().fine and check_real_time_rights().advice == ""


@pytest.mark.parametrize("first_begun_ends_first", [True, False])
def test_overlapping_loops_keep_the_priority_until_the_later_end(allow, first_begun_ends_first):
    library, _ = allow(True, True)
    before_s = sys.getswitchinterval()
    begun = [request_real_time_class(), request_real_time_class()]
    for each in begun:
        each.__enter__()
    earlier, later = begun if first_begun_ends_first else reversed(begun)
    earlier.__exit__(None, None, None)
    assert library.locked and sys.getswitchinterval() == pytest.approx(SWITCH_INTERVAL_S)
    later.__exit__(None, None, None)
    assert not library.locked and sys.getswitchinterval() == pytest.approx(before_s)


@pytest.mark.parametrize("granted_again", [True, False])
def test_querying_the_priority_does_not_change_a_running_loop(allow, granted_again):
    library, _ = allow(True, True)
    with request_real_time_class():
        library.allowed = granted_again
        assert check_real_time_rights().fine == granted_again
        assert library.locked and sys.getswitchinterval() == pytest.approx(SWITCH_INTERVAL_S)
    assert not library.locked


@pytest.mark.parametrize(("limit", "flags"), [(-1, 1 | 2 | 4), (2**20, 1 | 4)], ids=["without limit", "limited"])
def test_future_memory_is_locked_only_without_a_memory_limit(allow, monkeypatch, limit, flags):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda which: {resource.RLIMIT_MEMLOCK: (limit, -1)}[which])
    library, _ = allow(True, True)
    with request_real_time_class():
        assert library.flags == [flags]


@pytest.mark.parametrize("scheduled", [True, False])
def test_unlimited_real_time_runtime_of_the_kernel_is_a_warning(allow, as_linux_comes, scheduled):
    allow(scheduled, True)
    as_linux_comes.write_text("-1\n")
    finding = check_real_time_rights()
    assert finding.warning and not finding.wrong
    assert (STARVING_ADVICE in finding.advice) == scheduled  # a loop of the ordinary kind starves nothing
    as_linux_comes.unlink()
    assert check_real_time_rights().fine == scheduled


def test_an_error_inside_restores_the_priority(allow):
    library, _ = allow(True, True)
    with pytest.raises(OSError, match="usb"), request_real_time_class():
        raise OSError("usb")
    assert not library.locked


@linux
def test_only_the_calling_thread_gets_the_priority():
    """As this system really grants it, or not: then nothing changed."""
    found: list[tuple[bool, int]] = []

    def ask() -> None:
        with request_real_time_class() as granted:
            found.append((granted.scheduled, os.sched_getscheduler(threading.get_native_id())))

    before = os.sched_getscheduler(0)
    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    ((scheduled, policy),) = found
    assert (policy & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO) == scheduled
    assert os.sched_getscheduler(0) == before


@pytest.mark.parametrize(("fine_sleep", "priority"), [(True, True), (True, False), (False, True)])
def test_on_windows_sleeps_are_made_finer_and_the_thread_comes_first(monkeypatch, fine_sleep, priority):
    ended: list[int] = []
    winmm = SimpleNamespace(timeBeginPeriod=lambda ms: 0 if fine_sleep else 97, timeEndPeriod=ended.append)
    kernel = SimpleNamespace(
        GetCurrentThread=lambda: 2, SetThreadPriority=lambda thread, level: priority and level == 15
    )
    kernel.GetCurrentThread = type("Function", (), {"__call__": lambda self: 2})()
    monkeypatch.setattr(module.platform, "system", lambda: "Windows")
    monkeypatch.setattr(module.ctypes, "windll", SimpleNamespace(winmm=winmm, kernel32=kernel), raising=False)
    with request_real_time_class() as granted:
        assert granted.scheduled == (fine_sleep and priority)
        assert not granted.locked and granted.advice.startswith("Windows")
        assert ended == []
    assert ended == ([1] if fine_sleep else [])


def test_another_operating_system_is_reported_as_offering_no_priority(monkeypatch):
    monkeypatch.setattr(module.platform, "system", lambda: "Darwin")
    monkeypatch.delattr(module.ctypes, "windll", raising=False)
    assert check_real_time_rights().advice == "This system offers none: close other programs."


@pytest.mark.parametrize("simulated", [False, True])
def test_a_real_device_s_loop_asks_in_its_own_thread_and_gives_back_when_it_is_closed(rigs, monkeypatch, simulated):
    told: list[str] = []

    @contextlib.contextmanager
    def noted():
        told.append(threading.current_thread().name)
        yield
        told.append("given back")

    monkeypatch.setattr("study.devices.drive.realtime_drive.request_real_time_class", noted)

    class Rig(rigs.ScriptedRig):
        info = replace(rigs.INFO, simulated=simulated)

    with contextlib.closing(SafeDevice(Rig(), rigs.SETTINGS, RealClock())) as device:
        device.look()
        assert told == ([] if simulated else ["haptic loop"])
    assert told == ([] if simulated else ["haptic loop", "given back"])
