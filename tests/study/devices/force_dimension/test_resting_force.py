"""The zero that is repeated while nothing is played, in a thread of its own, delays no force of the loop."""

import contextlib
import ctypes
import threading

import pytest
from numba import njit

from study.devices.native import acquire, now_s, release, sleep_until

pytestmark = pytest.mark.real_time

EVERY_S, FOR_S = 0.0002, 1.0
KEPT_S = 0.05
"""For so long the interpreter is kept at a time, as by a program that prepares a stimulus."""


@njit(nogil=True)
def longest_wait_s(calls, every_s, for_s):
    """For the lock of the writes, asked for again and again without the interpreter, as the loop does."""
    longest, until = 0.0, now_s(calls) + for_s
    while now_s(calls) < until:
        asked = now_s(calls)
        if acquire(calls, for_s):
            longest = max(longest, now_s(calls) - asked)
            release(calls)
        sleep_until(calls, now_s(calls) + every_s)
    return longest


def test_the_repeated_zero_keeps_the_lock_for_no_wait_for_the_interpreter(stub):
    stub.set("stretch_in_use", 1000)
    stub.set("watchdog_stretch", 1000)
    keep, over = ctypes.PyDLL(None).usleep, threading.Event()
    with contextlib.closing(stub.rig(rests=True)) as rig:
        calls = rig.halves.calls
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
