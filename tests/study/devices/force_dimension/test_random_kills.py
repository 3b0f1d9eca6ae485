"""Programs that hold the device, killed, stopped, stalled and blinded at random times: the force is off every time.

They have the loop in them, as the loop's process has; what happens to the caller of that: `loop_process`."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.real_time

TESTS = Path(__file__).parents[3]
CAP_N = 4.5

NURSERY = f"""
import os, signal, sys, time
sys.path.insert(0, {str(TESTS)!r})
import rigs
from study.devices.clock import RealClock
from study.devices.opening import open_device
import study.devices.safe, study.devices.rigs_by_name

def hold():
    alive = [True]
    signal.signal(signal.SIGUSR1, lambda number, frame: alive.clear())
    device = open_device("omega3", rigs.SETTINGS, RealClock(), seed=1, own_process=False)
    device.hold(rigs.sine(2.0, 25))
    while True:
        time.sleep(0.02)
        if alive:
            device.keep_alive()
            if device.fault().name != "NONE":
                device.close()
                return

signal.signal(signal.SIGCHLD, signal.SIG_IGN)
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        try:
            hold()
        finally:
            os._exit(0)
    print(child, flush=True)
"""
"""Everything is imported once; each program is a fork of it, with a device of its own and a thread for its loop."""


@pytest.fixture
def nursery(stub):
    process = subprocess.Popen(
        [sys.executable, "-c", NURSERY],
        env=os.environ | {"HAPTEQ_STUB": "stiffness=150"},
        cwd=TESTS.parent,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    children: list[int] = []

    def born() -> int:
        process.stdin.write("one more\n")
        process.stdin.flush()
        children.append(int(process.stdout.readline()))
        return children[-1]

    yield born
    process.stdin.close()
    for child in children:
        end(child)
    process.wait(20)
    process.stdout.close()


def end(child: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)


def runs(child: int) -> bool:
    try:
        os.kill(child, 0)
    except ProcessLookupError:
        return False
    return True


def await_force(stub, child: int) -> bool:
    """False where the program ended before: a busy computer may be too late for the device's watchdog."""
    while runs(child):
        if stub.peek("last_write") > 0.2 and stub.peek("force_on"):
            return True
        time.sleep(0.001)
    return False


def becomes(true, within_s: float) -> bool:
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        if true():
            return True
        time.sleep(0.005)
    return bool(true())


def stays_off(stub) -> bool:
    """Longer than a period of what was held: its zero crossings are no end."""
    for _ in range(20):
        if stub.peek("last_write") != 0.0 and stub.peek("force_on"):
            return False
        time.sleep(0.003)
    return True


def killed(stub, child: int) -> None:
    end(child)
    assert becomes(lambda: not runs(child), 5.0)
    time.sleep(0.1)
    assert stub.safe


def stopped(stub, child: int) -> None:
    os.kill(child, signal.SIGSTOP)
    time.sleep(0.15)
    assert stub.safe
    os.kill(child, signal.SIGCONT)
    time.sleep(0.1)
    assert stays_off(stub)
    killed(stub, child)


def stalled(stub, child: int) -> None:
    """Its main thread gives no sign of life any more; its loop lives."""
    os.kill(child, signal.SIGUSR1)
    assert becomes(lambda: stays_off(stub), 3.0)
    killed(stub, child)


def blinded(stub, child: int) -> None:
    """Each reading fails from now on."""
    stub.set("read_fails", 2)
    try:
        assert becomes(lambda: stays_off(stub), 3.0)
    finally:
        stub.set("read_fails", 0)
    killed(stub, child)


WAYS = (killed, stopped, stalled, blinded)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("times", [8, pytest.param(200, marks=pytest.mark.slow)])
def test_after_any_end_of_a_program_the_force_is_off_and_stayed_below_the_cap(stub, nursery, times):
    draw, done = np.random.default_rng(18), dict.fromkeys(WAYS, 0)
    for attempt in range(3 * times):
        child = nursery()
        if await_force(stub, child):
            time.sleep(float(draw.uniform(0.0, 0.3)))
            way = WAYS[attempt % len(WAYS)]
            way(stub, child)
            done[way] += 1
        else:
            time.sleep(0.1)
            assert stub.safe
        assert stub.get("peak_n") <= CAP_N
        if sum(done.values()) == times:
            break
    assert sum(done.values()) == times
    assert all(done.values()), done


def test_a_device_whose_watchdog_failed_since_it_was_opened_would_be_noticed(stub, nursery):
    child = next(child for child in (nursery() for _ in range(10)) if await_force(stub, child))
    stub.set("watchdog_works", 0)
    with pytest.raises(AssertionError):
        killed(stub, child)
    stub.set("watchdog_works", 1)
