"""Closing that is interrupted, and programs that end without it: no force is left."""

import contextlib
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from study.devices.clock import RealClock
from study.devices.device import Fault
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from tests.study.devices.hung_driver.patience import hold, wait_until

pytestmark = pytest.mark.real_time
TESTS = Path(__file__).parents[3]


class ImpatientClock(RealClock):
    """Every sleep of the main thread is interrupted, from a certain moment on."""

    def __init__(self) -> None:
        self.impatient = False

    def sleep(self, seconds: float) -> None:
        if self.impatient and threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt
        super().sleep(seconds)


def test_an_interrupted_close_turns_the_force_off_and_can_be_repeated(rigs, rig):
    clock = ImpatientClock()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    hold(device, rigs, rig)
    clock.impatient = True
    with pytest.raises(KeyboardInterrupt):
        device.close()
    assert not rig.last_n.any()
    assert rig.closed == 1
    with pytest.raises(DeviceError, match="is closed"):
        device.hold(rigs.push())
    assert device._closed is False  # so that it is closed once more when the program ends
    clock.impatient = False
    device.close()
    assert device._closed


def test_a_close_that_is_interrupted_once_more_while_the_loop_ends_disconnects_all_the_same(rigs, rig):
    def interrupt() -> None:
        raise KeyboardInterrupt

    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    hold(device, rigs, rig)
    device._drive.close = interrupt
    with pytest.raises(KeyboardInterrupt):
        device.close()
    assert rig.closed == 1
    assert not rig.last_n.any()
    del device._drive.close
    device.close()


def test_an_interruption_while_a_recording_lets_go_stops_at_once(rigs, rig):
    clock = ImpatientClock()
    rig.trembling_axes = [0, 1, 2]  # the force changes along x: a position that stood still there would be stale

    def interrupt(share: float) -> None:
        if share > 0.6:
            clock.impatient = True
            raise KeyboardInterrupt

    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        with pytest.raises(KeyboardInterrupt):
            device.play(rigs.force(np.minimum(np.arange(2000) * 0.01, 2.9)[:, None] * [1.0, 0.0, 0.0]), interrupt)
        clock.impatient = False
        assert device.fault() is Fault.STOPPED
        wait_until(lambda: not rig.last_n.any(), 1.0)


PROGRAM = """
import os, struct, sys, time
sys.path.insert(0, {tests!r})
import rigs
from study.devices.clock import RealClock
from study.devices.safe import SafeDevice

class Witness(rigs.HeldForceRig):
    # The file is the device: one system call writes a whole force or none.
    file = os.open({path!r}, os.O_CREAT | os.O_WRONLY)

    def write(self, force_n):
        super().write(force_n)
        os.pwrite(self.file, struct.pack("d", force_n[0]), 0)

device = SafeDevice(Witness(), rigs.SETTINGS, RealClock())
device.hold(rigs.push())
for k in range({naps}):
    device.keep_alive()
    time.sleep(0.02)
    if k == 10:
        print("held", flush=True)
"""


def program(tmp_path, naps: int) -> tuple[subprocess.Popen, Path]:
    path = tmp_path / "force"
    code = PROGRAM.format(tests=str(TESTS), path=str(path), naps=naps)
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=TESTS.parent, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process, path


def force_left_n(path: Path) -> float:
    (force_n,) = struct.unpack("d", path.read_bytes())
    return float(force_n)


def test_a_program_that_ends_without_closing_leaves_no_force(tmp_path):
    process, path = program(tmp_path, naps=12)
    with process:
        assert process.wait(20) == 0
    assert force_left_n(path) == 0.0


def test_a_program_that_is_interrupted_again_and_again_leaves_no_force(tmp_path):
    process, path = program(tmp_path, naps=1000)
    with process:
        # Eight at least, and more as long as it runs: on a busy machine many arrive as one, and Python drops one that
        # comes while it tidies up.
        for number in range(1000):
            if number >= 8 and process.poll() is not None:
                break
            process.send_signal(signal.SIGINT)
            time.sleep(0.01)
        process.wait(20)
    assert force_left_n(path) == 0.0
