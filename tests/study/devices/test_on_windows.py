"""What can be tested of Windows without it: the names and calls that are chosen there, and the loop without the clock
calls of Linux. Nothing here ran on Windows."""

import contextlib
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from study.devices import native
from study.devices.clock import RealClock
from study.devices.device import Fault
from study.devices.drive import real_time_class
from study.devices.force_dimension import library
from study.devices.loop_process import serve, start
from study.devices.loop_process.call_pipe import PIPE_NAMES
from study.devices.native import CLOCK, MONOTONIC, SLEEP, SharedLock, collect_system_calls, read_clock_s
from study.devices.safe import SafeDevice

NOT_THERE = ("fcntl", "resource", "termios", "tty", "pty", "grp", "pwd", "syslog", "posix_ipc")
"""Modules of POSIX systems alone."""


class Windows:
    """The calls of its libraries that are made, in order."""

    def __init__(self) -> None:
        self.called: list[tuple[str, int]] = []
        current = type("Function", (), {"__call__": lambda _: -2})()
        self.winmm = SimpleNamespace(
            timeBeginPeriod=self._of("timeBeginPeriod"), timeEndPeriod=self._of("timeEndPeriod")
        )
        self.kernel32 = SimpleNamespace(GetCurrentThread=current, SetThreadPriority=self._priority)

    def _of(self, name: str):
        return lambda milliseconds: self.called.append((name, milliseconds)) or 0

    def _priority(self, thread, level: int) -> int:
        self.called.append(("SetThreadPriority", level))
        return 1


@pytest.fixture
def windows(monkeypatch) -> Windows:
    system = Windows()
    monkeypatch.setattr(native.sys, "platform", "win32")
    monkeypatch.setattr(real_time_class.platform, "system", lambda: "Windows")
    monkeypatch.setattr(real_time_class.ctypes, "windll", system, raising=False)
    return system


def test_the_loop_takes_python_s_clock_and_sleep_there(windows):
    calls = collect_system_calls(SharedLock())
    assert (calls[CLOCK], calls[SLEEP]) == (0, 0)
    assert calls[MONOTONIC] != 0
    before_s = time.monotonic()
    assert before_s <= read_clock_s(calls) <= time.monotonic()


@pytest.mark.real_time
def test_a_stimulus_is_held_on_the_driver_with_the_calls_that_are_made_there(windows, stub, rigs):
    """Timer and priority are asked for with the loop, and the timer is given back with it; no tick is attended by
    compiled code, and the force is what it is elsewhere."""
    stub.set("stiffness", 150)
    stub.set("stretch_in_use", 20)  # the computer of the tests is busier than that of a lab
    with contextlib.closing(SafeDevice(stub.rig(), rigs.SETTINGS, RealClock())) as device:
        assert not device._runner.can_attend
        device.hold(rigs.sine(1.0))
        for _ in range(20):
            time.sleep(0.02)
            device.keep_alive()
        fault = device.fault()
        device.release()
    assert fault in (Fault.NONE, Fault.STALLED, Fault.LOST)  # a busy computer's loop stood still
    assert 0.3 < stub.get("peak_n") <= rigs.LIMITS.total_cap_n
    assert stub.safe
    assert windows.called == [("timeBeginPeriod", 1), ("SetThreadPriority", 15), ("timeEndPeriod", 1)]


def test_a_library_is_loaded_by_its_whole_path_so_that_what_lies_beside_it_is_found(monkeypatch):
    loaded: list[str] = []
    monkeypatch.setattr(library.ctypes, "CDLL", loaded.append)
    library._load_shared_library(Path("sdk") / "bin" / "drd64.dll")
    assert loaded == [str(Path.cwd() / "sdk" / "bin" / "drd64.dll")]


def test_the_loop_s_process_inherits_its_pipes_by_handle_and_has_a_group_of_its_own(monkeypatch):
    """Ctrl-C in the console reaches the program alone; nothing else is inherited than what is made so."""
    made, inheritable = [], []
    monkeypatch.setattr(start.sys, "platform", "win32")
    monkeypatch.setattr(start.os, "set_handle_inheritable", lambda *given: inheritable.append(given), raising=False)
    monkeypatch.setattr(start.subprocess, "CREATE_NEW_PROCESS_GROUP", 0x200, raising=False)
    monkeypatch.setattr(start.subprocess, "Popen", lambda *given, **named: made.append((given, named)))
    start._start_process([404, 408], [])
    ((command,), named) = made[0]
    assert inheritable == [(404, True), (408, True)]
    assert (named["close_fds"], named["creationflags"]) == (False, 0x200)
    assert "pass_fds" not in named and "start_new_session" not in named
    assert command[2].endswith(f"run({os.getpid()}, 404, 408)")


def test_signals_that_are_not_there_are_not_asked_for(monkeypatch):
    asked: list[int] = []
    monkeypatch.delattr(serve.signal, "SIGHUP")
    monkeypatch.setattr(serve.signal, "signal", lambda number, action: asked.append(number))
    serve._install_signal_handlers([])
    assert asked == [signal.SIGINT, signal.SIGTERM]


def test_where_the_parent_s_number_stays_after_its_end_the_closed_pipe_ends_the_process(vendor, rigs, monkeypatch):
    """Windows names the parent for ever."""
    from tests import served_device

    parent = os.getppid()
    monkeypatch.setattr(serve.os, "getppid", lambda: parent)
    assert not serve.CallerWatchdog(parent, []).must_exit()
    device = SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, RealClock())
    here = served_device.ServedHere(device)
    assert not here.server.ended.wait(0.2)
    here.hang_up()
    assert here.server.ended.wait(10.0)
    device.close()


def test_there_the_closed_pipe_starts_the_time_after_which_a_driver_that_hangs_is_ended(rigs, monkeypatch):
    parent, pairs = os.getppid(), [multiprocessing.Pipe() for _ in PIPE_NAMES]
    watchdog = serve.CallerWatchdog(parent, [])
    seen: list[bool] = []
    methods = dict.fromkeys(("hold", "release", "play", "keep_alive", "fault", "health", "look", "stop"), int)
    device = SimpleNamespace(**methods, info="opened", close=lambda: seen.append(watchdog.must_exit()))
    monkeypatch.setattr(serve.os, "getppid", lambda: parent)
    monkeypatch.setattr(serve, "gc", SimpleNamespace(collect=int, freeze=int, disable=int))
    monkeypatch.setattr(serve, "open_device", lambda *given, **named: device)
    pairs[0][0].send(("open", ("omega3", rigs.SETTINGS, 1, "")))
    hanging_up = threading.Timer(0.2, lambda: [end.close() for end, _ in pairs])
    hanging_up.start()
    serve._open_and_serve(watchdog, tuple(end for _, end in pairs))
    hanging_up.join()
    assert seen[0]


@pytest.mark.slow
def test_nothing_that_the_driver_imports_is_of_posix_alone():
    """In a program of its own, in which those modules are missing."""
    program = (
        f"import sys; sys.modules.update(dict.fromkeys({NOT_THERE!r}))\n"
        "import study.cli.main, study.devices.opening, study.devices.rigs_by_name, study.devices.safe\n"
        "import study.devices.loop_process.remote_device, study.devices.loop_process.serve\n"
        "import study.devices.force_dimension.findings, study.devices.force_dimension.linkage\n"
        "import study.devices.accelerometer.serial_reader, study.devices.onset_line\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
