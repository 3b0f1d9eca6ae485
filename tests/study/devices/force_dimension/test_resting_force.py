"""Zeros while nothing is played: in a thread of its own, which delays no force of the loop, and counted as the device
counts them."""

import contextlib
import ctypes
import threading
import time

import numpy as np
import pytest
from numba import njit

from study.devices.drive.stepped_runner import DEVICE_CLOSE_TIMEOUT_S
from study.devices.force_dimension.rig import JOIN_TIMEOUT_S
from study.devices.native import acquire, read_clock_s, release, sleep_until
from tests.slow_instances import slow_rows

pytestmark = pytest.mark.real_time

EVERY_S, FOR_S = 0.0002, 1.0
KEPT_S = 0.05
"""For so long the interpreter is kept at a time, as by a program that prepares a stimulus."""


@njit(nogil=True)
def longest_wait_s(calls, every_s, for_s):
    """For the lock of the writes, asked for again and again without the interpreter, as the loop does."""
    longest, until = 0.0, read_clock_s(calls) + for_s
    while read_clock_s(calls) < until:
        asked = read_clock_s(calls)
        if acquire(calls, for_s):
            longest = max(longest, read_clock_s(calls) - asked)
            release(calls)
        sleep_until(calls, read_clock_s(calls) + every_s)
    return longest


def test_the_repeated_zero_keeps_the_lock_for_no_wait_for_the_interpreter(stub):
    stub.set("stretch_in_use", 1000)
    stub.set("watchdog_stretch", 1000)
    keep, over = ctypes.PyDLL(None).usleep, threading.Event()
    with contextlib.closing(stub.rig(rests=True)) as rig:
        calls = rig.compiled_io.calls
        longest_wait_s(calls, EVERY_S, 0.01)  # compiled
        sent = stub.get("writes")

        def keep_the_interpreter() -> None:
            while not over.is_set():
                keep(round(1e6 * KEPT_S))

        keeper = threading.Thread(target=keep_the_interpreter)
        keeper.start()
        try:
            longest_s = longest_wait_s(calls, EVERY_S, FOR_S)
        finally:
            over.set()
            keeper.join()
        assert stub.get("writes") > sent  # zeros were sent meanwhile
        assert longest_s < KEPT_S / 2


@pytest.mark.parametrize("late_s", [0.02, 0.028])
def test_a_device_that_let_go_while_a_zero_was_sent_late_is_woken_for_the_next_force(stub, late_s):
    """Its watchdog counts from when the zero came, not from when the call ended: at the force it has let go."""
    stub.set("stretch_in_use", 100)  # from the first force on: the computer of the tests may be busy
    with contextlib.closing(stub.rig()) as rig:
        stub.set("write_late_s", late_s)
        stub.set("write_late_every", 1)
        rig.write(np.zeros(3))
        stub.set("write_late_every", 0)
        time.sleep(rig.drops_force_after_s - late_s + 0.005)
        assert not stub.get("force_on")
        rig.write(np.array([0.5, 0.0, 0.0]))
        assert stub.get("force_on") and stub.applied_n.any()


def test_a_device_that_let_go_while_it_was_opened_is_woken_for_the_first_force(stub, vendor, monkeypatch):
    """A busy computer may come back to the opening after the watchdog's time."""
    stub.set("stretch_in_use", 100)
    make_ready = vendor.make_ready

    def make_ready_and_stand_still(*arguments) -> float:
        drops_after_s: float = make_ready(*arguments)
        time.sleep(drops_after_s + 0.02)
        return drops_after_s

    monkeypatch.setattr(vendor, "make_ready", make_ready_and_stand_still)
    with contextlib.closing(stub.rig()) as rig:
        assert not stub.get("force_on")
        rig.write(np.array([0.5, 0.0, 0.0]))
        assert stub.get("force_on") and stub.applied_n.any()


def hang_a_zero(stub, rig, late_s: float) -> None:
    """The next zeros but one: its call lasts so long, and those of the closing do not."""
    stub.set("write_late_s", late_s)
    last = stub.get("writes") + 3
    stub.set("write_late_every", last)
    while stub.get("writes") < last:
        time.sleep(0.001)


def braked_within_s(stub) -> float:
    began_s = time.monotonic()
    while not stub.safe and time.monotonic() - began_s < 10.0:
        time.sleep(0.001)
    return time.monotonic() - began_s


def test_closing_brakes_at_once_and_ends_the_thread_of_the_zeros(stub):
    stub.set("watchdog_stretch", 1000)
    with contextlib.closing(stub.rig(rests=True)) as rig:
        hang_a_zero(stub, rig, 0.4)
        closing = threading.Thread(target=rig.close)
        closing.start()
        braked_within_s(stub)
        assert rig._zero_thread.is_alive()  # what hangs holds up neither zero nor brakes
        closing.join()
        assert not rig._zero_thread.is_alive()
        assert stub.safe and (stub.get("stops"), stub.get("closes")) == (1, 1)


def test_closing_waits_for_a_zero_that_hangs_no_longer_than_half_of_its_time(stub):
    stub.set("watchdog_stretch", 1000)
    with contextlib.closing(stub.rig(rests=True)) as rig:
        hang_a_zero(stub, rig, 3.0)
        began_s = time.monotonic()
        assert rig.close()
        assert JOIN_TIMEOUT_S <= time.monotonic() - began_s < DEVICE_CLOSE_TIMEOUT_S
        assert rig._zero_thread.is_alive() and stub.safe


@pytest.mark.parametrize(
    ("function", "late_s"),
    [
        *(("dhdGetStatus", 0.3), ("dhdSetBrakes", 0.8), ("dhdEnableForce", 0.3)),
        *slow_rows(("dhdGetStatus", 0.8), ("dhdSetBrakes", 0.3), ("dhdEnableForce", 0.8)),
    ],
    ids=lambda value: {0.3: "waited for", 0.8: "given up"}.get(value),
)
def test_a_call_that_wakes_the_device_too_late_leaves_it_braked_once_it_is_closed(
    stub, vendor, monkeypatch, function, late_s
):
    """It hangs while the device is closed, and the device does not even disconnect."""
    make_ready = vendor.make_ready

    def make_ready_and_stand_still(*arguments) -> float:
        drops_after_s: float = make_ready(*arguments)
        time.sleep(drops_after_s + 0.02)
        assert not stub.get("force_on")  # so that the first zero wakes it
        stub.set("watchdog_stretch", 1000)
        stub.delay(function, late_s, 1)
        return drops_after_s

    monkeypatch.setattr(vendor, "make_ready", make_ready_and_stand_still)
    with contextlib.closing(stub.rig(rests=True)) as rig:
        time.sleep(0.1)
        stub.fail("dhdClose")
        rig.close()
        assert stub.safe
        rig._zero_thread.join()
        assert stub.safe
        stub.fail("dhdClose", times=0)
    assert (stub.get("opened"), stub.safe) == (0, True)
