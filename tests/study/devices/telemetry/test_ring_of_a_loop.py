"""The ring of a real device's loop in its own process, on the stub: read here while it plays, gone when it is closed,
also where the loop was killed."""

import contextlib
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from study.devices.clock import RealClock
from study.devices.device import Fault
from study.devices.opening import open_device, open_telemetry
from study.errors import DeviceError

pytestmark = pytest.mark.real_time


TRIES = 5
"""A busy computer may give the loop, or this program, no processor for so long that the force is let go."""


def test_the_program_reads_the_loop_while_it_plays(stub, rigs):
    for _ in range(TRIES):
        began_s = time.monotonic()
        fault = read_beside(rigs)
        if fault is Fault.NONE:
            return
    pytest.fail(f"{TRIES} times: {fault.value}, {time.monotonic() - began_s:.1f} s after the opening")


def read_beside(rigs) -> Fault:
    with contextlib.closing(open_device("omega3", rigs.SETTINGS, RealClock(), seed=1)) as device:
        path = Path(device.telemetry)
        reader = open_telemetry(device.telemetry)
        device.hold(rigs.sine(1.0))
        began_s, reads = time.monotonic(), []
        while time.monotonic() < began_s + 0.5:
            time.sleep(0.02)
            device.keep_alive()
            reads.append(reader.read())
        health = device.release().health
        reads.append(reader.read())
    assert not path.exists()
    if health.fault is Fault.NONE:
        time_s, tick = (np.concatenate([getattr(read, name) for read in reads]) for name in ("time_s", "tick"))
        assert sum(len(read) > 0 for read in reads) > 2
        # Missed ticks have no row: what is there and what was missed is all.
        assert len(tick) + reads[-1].missed[-1] == health.ticks and reader.lost == 0
        assert np.all(np.diff(tick) > 0) and np.all(np.diff(time_s) > 0)
        assert time_s[0] < began_s + 0.5 and time_s[-1] < time.monotonic()
        assert time_s[-1] - time_s[0] == pytest.approx(0.001 * (tick[-1] - tick[0]), abs=0.1)
    return health.fault


def test_a_loop_that_is_killed_leaves_no_ring_behind(stub, rigs):
    device = open_device("omega3", rigs.SETTINGS, RealClock(), seed=1)
    path = Path(device.telemetry)
    try:
        reader = open_telemetry(device.telemetry)
        device.hold(rigs.sine(1.0))
        time.sleep(0.2)
        os.kill(device._process.pid, signal.SIGKILL)
        with contextlib.suppress(DeviceError):
            device.release()
        assert len(reader.read()) > 0
    finally:
        device.close()
    assert not path.exists()
