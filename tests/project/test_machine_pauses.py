"""The meter that says whether a failure against the clock may be tried again."""

import ctypes
import time

from tests.machine_pauses import PauseMeter


def test_a_process_that_stood_still_is_known_to_have_paused():
    meter = PauseMeter()
    meter.reset()
    time.sleep(0.02)
    ctypes.PyDLL(None).usleep(200_000)  # with the interpreter's lock: no other thread runs
    time.sleep(0.02)
    assert meter.paused()
    assert meter.longest_s > 0.18


def test_a_pause_of_an_earlier_test_does_not_count():
    meter = PauseMeter()
    meter.longest_s = 1.0
    meter.reset()
    assert meter.longest_s < 1.0
