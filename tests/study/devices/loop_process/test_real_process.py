"""The loop's process for real, on the stub: programs and loops that are killed and stopped; Ctrl-C in a terminal."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from study.devices.clock import RealClock
from study.devices.device import Fault
from study.devices.opening import open_device
from study.errors import DeviceError
from tests.slow_instances import slow_rows
from tests.study.devices.loop_process.awaited import STARTS, becomes, hold_force, runs

pytestmark = pytest.mark.real_time

PATIENT = {"stretch_in_use": 1000}
"""The device's own watchdog waits: what lets go is the program."""

CAME_TOO_LATE = "the program came too late for the device's watchdog"
"""Of a force that is played, which ends with an error where one that is held has a fault."""

PROGRAM_CLOSED, WATCHDOG = 4, 3
"""Why the force is off, as the device says."""

PROGRAM = """
import pickle, sys, time
from study.devices.clock import RealClock
from study.devices.opening import open_device
settings, stimulus, commands = pickle.load(sys.stdin.buffer)
device = open_device("omega3", settings, RealClock(), 1)
print(device._process.pid, flush=True)
try:
    if commands is not None:
        device.play(commands)
    device.hold(stimulus)
    while device.fault().name == "NONE":
        time.sleep(0.02)
        device.keep_alive()
    print(device.release().health.fault.name)
finally:
    device.close()
"""


class Holding:
    """A program that holds or plays a force. Begins a process group of its own, as from a shell."""

    def __init__(self, rigs, stub, plays: bool = False) -> None:
        self.program = subprocess.Popen(
            [sys.executable, "-c", PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        commands = rigs.force(np.tile(rigs.sine(2.0, 25).loop.samples, (200, 1))) if plays else None
        self.program.stdin.write(pickle.dumps((rigs.SETTINGS, rigs.sine(2.0, 25), commands)))
        self.program.stdin.close()
        self.program.stdin = None

    def holds(self, stub) -> bool:
        """Waits for the force. False where the program ended before."""
        self.loop_pid = int(self.program.stdout.readline())
        becomes(lambda: self.program.poll() is not None or (stub.get("last_write") > 0.5 and stub.get("force_on")))
        return self.program.poll() is None

    def end(self) -> str:
        self.program.send_signal(signal.SIGCONT)
        said, errors = self.program.communicate(timeout=60)
        return said.decode() + errors.decode()


@pytest.fixture
def holding(stub, rigs):
    """Starts a program and waits for its force. Where a busy computer gave the program or its loop no processor, so
    that the device let go before that could be seen, another is started."""
    started: list[Holding] = []

    def start(plays: bool = False) -> Holding:
        set_switches(stub, PATIENT)
        said = ""
        for _ in range(STARTS):
            begun = Holding(rigs, stub, plays)
            started.append(begun)
            if begun.holds(stub):
                return begun
            said = begun.end()
            assert said == "STALLED\n" or CAME_TOO_LATE in said
        pytest.fail(f"none of {STARTS} programs held a force: {said}")

    yield start
    for begun in started:
        begun.program.kill()
        begun.end()


def set_switches(stub, switches: dict[str, float]) -> None:
    for name, value in switches.items():
        stub.set(name, value)


@pytest.fixture
def opened(stub, rigs):
    """In this program, which then kills its loop."""
    set_switches(stub, PATIENT)
    with contextlib.closing(open_device("omega3", rigs.SETTINGS, RealClock(), seed=1)) as device:
        yield device


@pytest.mark.parametrize("plays", [pytest.param(False, marks=pytest.mark.slow), True])
def test_when_its_program_is_killed_the_loop_fades_brakes_and_ends(stub, rigs, holding, plays):
    held = holding(plays)
    held.program.kill()
    becomes(lambda: not runs(held.loop_pid))
    assert stub.safe
    assert (stub.get("opened"), stub.get("cause")) == (0, PROGRAM_CLOSED)
    assert stub.get("peak_n") <= rigs.LIMITS.total_cap_n


@pytest.mark.parametrize("plays", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_when_its_program_is_stopped_the_loop_fades_to_zero_and_lives(stub, rigs, holding, plays):
    held = holding(plays)
    held.program.send_signal(signal.SIGSTOP)
    time.sleep(rigs.LIMITS.watchdog_s + rigs.LIMITS.release_s)
    becomes(lambda: stays_zero(stub))
    assert runs(held.loop_pid) and stub.get("opened")
    if plays:
        held.program.kill()
    said = held.end()
    assert plays or said == "STALLED\n"
    becomes(lambda: not runs(held.loop_pid))
    assert stub.safe and stub.get("cause") == PROGRAM_CLOSED


def stays_zero(stub) -> bool:
    """Longer than a period of what was held."""
    for _ in range(20):
        if stub.get("last_write") != 0.0:
            return False
        time.sleep(0.003)
    return True


def holding_on(holding, stub):
    """A program whose loop was sent the signals of a terminal, and holds its force all the same. One that a busy
    computer made let go says so, and another is tried; a loop that ended would be LOST."""
    for _ in range(STARTS):
        held = holding()
        assert os.getsid(held.loop_pid) != os.getsid(held.program.pid)
        os.kill(held.loop_pid, signal.SIGINT)  # even so
        os.kill(held.loop_pid, signal.SIGHUP)
        time.sleep(0.5)
        if runs(held.loop_pid) and not stays_zero(stub):
            return held
        assert held.end() == "STALLED\n"
    pytest.fail(f"none of {STARTS} programs went on holding")


def test_ctrl_c_in_the_terminal_reaches_the_program_alone_and_ends_with_a_fade(stub, holding):
    held = holding_on(holding, stub)
    os.killpg(held.program.pid, signal.SIGINT)
    assert "KeyboardInterrupt" in held.end()
    becomes(lambda: not runs(held.loop_pid))
    assert stub.safe and stub.get("cause") == PROGRAM_CLOSED


def check_it_is_lost(device, rigs, said: str) -> None:
    with pytest.raises(DeviceError, match=f"The device was lost.*{said}"):
        device.hold(rigs.push())
    with pytest.raises(DeviceError, match=f"The device was lost.*{said}"):
        device.play(rigs.sine(1.0).loop)
    assert device.look().position_m is None
    played = device.release()
    assert (played.recording, played.health.fault) == (None, Fault.LOST)


@pytest.mark.parametrize("end", [signal.SIGKILL, pytest.param(signal.SIGSTOP, marks=pytest.mark.slow)])
def test_a_loop_that_is_killed_or_stopped_loses_its_force_by_the_watchdog_and_the_program_says_so(
    stub, rigs, opened, end
):
    hold_force(opened, rigs, stub)
    stub.set("stretch_in_use", 1)
    os.kill(opened._process.pid, end)
    becomes(lambda: stub.safe)
    assert stub.get("cause") == WATCHDOG
    becomes(lambda: opened.fault() is Fault.LOST)
    check_it_is_lost(
        opened, rigs, "by signal SIGKILL" if end == signal.SIGKILL else "did not answer for .* and was killed"
    )
    assert not runs(opened._process.pid)
    assert stub.safe


@pytest.mark.slow
def test_a_loop_that_is_told_to_end_fades_first(stub, rigs, opened):
    hold_force(opened, rigs, stub)
    os.kill(opened._process.pid, signal.SIGTERM)
    becomes(lambda: opened.fault() is Fault.LOST)
    assert stub.safe and stub.get("cause") == PROGRAM_CLOSED
    check_it_is_lost(opened, rigs, "it ended, with code 0")


def test_a_loop_that_was_stopped_for_a_moment_lets_go_and_serves_again(stub, rigs, opened):
    hold_force(opened, rigs, stub)
    os.kill(opened._process.pid, signal.SIGSTOP)
    time.sleep(0.3)
    os.kill(opened._process.pid, signal.SIGCONT)
    becomes(lambda: opened.fault() is not Fault.NONE)
    becomes(lambda: not stub.applied_n.any())  # the fault is said as the fade begins
    assert opened.release().health.fault in (Fault.STALLED, Fault.LOST)


@pytest.mark.slow
def test_recordings_come_back_and_no_loop_runs_in_this_program(stub, rigs, opened):
    before = locked_kb()
    opened.hold(rigs.sine(2.0, 25))
    for _ in range(30):
        time.sleep(0.05)
        opened.keep_alive()
    assert not {"haptic loop", "gravity compensation"} & {thread.name for thread in threading.enumerate()}
    assert locked_kb() == before
    if opened.fault() is Fault.NONE:  # a busy computer may be late
        recording = opened.release().recording
        assert np.linalg.norm(recording.excitation.samples, axis=1).max() == pytest.approx(2.0)
    else:
        opened.release()
    shares: list[float] = []
    played = opened.play(rigs.sine(1.0).loop, shares.append)
    assert shares == sorted(shares)
    if played.health.fault is Fault.NONE:
        assert len(played.recording) == 200 and shares[-1] == 1.0


def locked_kb() -> int:
    return int(Path("/proc/self/status").read_text("ascii").partition("VmLck:")[2].split()[0])


@pytest.mark.parametrize(
    ("switches", "said"),
    [({"devices": 0}, "No device of the vendor answers"), *slow_rows(({"calibrated": 0}, "not calibrated"))],
)
def test_why_it_does_not_open_is_said_in_the_same_words_and_nothing_is_left_running(stub, rigs, switches, said):
    set_switches(stub, switches)
    words = []
    for own_process in (False, True):
        with pytest.raises(DeviceError, match=said) as refusal:
            open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=own_process)
        words.append((type(refusal.value), str(refusal.value)))
    assert words[0] == words[1]
    assert stub.safe and not stub.get("opened")


def test_a_loop_that_dies_while_it_opens_is_an_error(stub, rigs, monkeypatch):
    monkeypatch.setenv("HAPTEQ_STUB_FILE", "/dev/full")  # no place for a device: the stub aborts
    with pytest.raises(DeviceError, match="The device was not opened.*it ended, by signal SIG"):
        open_device("omega3", rigs.SETTINGS, RealClock(), 1)


CHILD = """
import gc, os, pickle, sys, threading
from multiprocessing import Pipe
from study.devices.loop_process import serve
settings = pickle.load(sys.stdin.buffer)
pairs = [Pipe() for _ in serve.PIPE_NAMES]
ours = [end for end, _ in pairs]

def ask() -> None:
    ours[0].send(("open", ("omega3", settings, 1, "")))
    assert ours[0].recv()[0] == serve.VALUE
    print(gc.isenabled(), gc.get_freeze_count() > 0)
    print(*sorted({name.partition(".")[0] for name in sys.modules}))
    ours[4].send(("close", ()))
    assert ours[4].recv()[0] == serve.VALUE

asking = threading.Thread(target=ask)
asking.start()
serve._open_and_serve(serve.CallerWatchdog(os.getppid(), []), tuple(end for _, end in pairs))
asking.join()
"""


def test_the_loop_s_process_imports_no_screen_no_tables_and_looks_for_no_garbage(stub, rigs):
    program = subprocess.run(
        [sys.executable, "-c", CHILD], input=pickle.dumps(rigs.SETTINGS), capture_output=True, timeout=120
    )
    assert program.returncode == 0, program.stderr.decode()
    collecting, modules = program.stdout.decode().splitlines()
    assert collecting == "False True"
    assert {"study", "numpy", "numba"} <= set(modules.split())
    assert not {"textual", "rich", "typer", "pandas", "matplotlib", "statsmodels", "jinja2"} & set(modules.split())
    assert stub.safe
