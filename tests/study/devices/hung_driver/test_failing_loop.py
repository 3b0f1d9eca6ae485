"""Writes that fail, and a loop that dies: the force goes, and what is not known is said."""

import contextlib
import threading
import time

import numpy as np
import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from tests.study.devices.hung_driver.patience import alive, hold, wait_until

pytestmark = pytest.mark.real_time


def test_failing_writes_are_not_reported_as_force_off(device, rigs, rig):
    def fail(force_n) -> None:
        raise OSError("usb")

    hold(device, rigs, rig)
    rig.before_writing = fail
    alive(device, 0.1)
    assert device.fault() is Fault.FORCE_LEFT
    device.stop()
    assert device.fault() is Fault.FORCE_LEFT  # a stop does not hide it
    device.release()
    advice = r"usb\)\. It took no zero force.*force may still be on\. Let go of the handle and switch the device off"
    with pytest.raises(DeviceError, match=advice):
        device.hold(rigs.push())


@pytest.mark.parametrize("clock", [VirtualClock(), RealClock()], ids=["virtual", "real"])
def test_a_final_zero_that_fails_does_not_close_a_trial_without_fault(rigs, rig, clock):
    def fail_at_the_end(force_n) -> None:
        if not device._governor.moving:
            time.sleep(0.02)  # as long as that, all seems over
            raise OSError("usb")

    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        device.hold(rigs.push())
        clock.sleep(0.2)
        rig.before_writing = fail_at_the_end
        assert device.release().health.fault is Fault.FORCE_LEFT


@pytest.mark.parametrize("clock", [VirtualClock(), RealClock()], ids=["virtual", "real"])
def test_a_zero_that_fails_while_the_force_fades_leaves_it_on_and_reports_it(rigs, rig, clock):
    def fail_at_zero(force_n) -> None:
        if not force_n.any():
            raise OSError("usb")

    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        device.hold(rigs.push())
        clock.sleep(0.2)
        rig.before_writing = fail_at_zero
        assert device.release().health.fault is Fault.FORCE_LEFT
        assert rig.last_n.any()


class TreacherousClock(RealClock):
    """Ends the haptic loop, outside of any tick."""

    def __init__(self) -> None:
        self.treacherous = False

    def now_s(self) -> float:
        if self.treacherous and threading.current_thread().name == "haptic loop":
            raise SystemExit
        return super().now_s()


def test_a_loop_that_dies_between_two_ticks_leaves_no_force(rigs, rig):
    clock = TreacherousClock()
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        hold(device, rigs, rig)
        clock.treacherous = True
        wait_until(lambda: device.fault() is Fault.LOST)
        assert not rig.last_n.any()
        assert device.release().health.fault is Fault.LOST
        with pytest.raises(DeviceError, match="SystemExit"):
            device.hold(rigs.push())


def test_a_driver_that_ends_the_loop_is_lost(device, rigs, rig):
    def leave() -> None:
        raise SystemExit

    hold(device, rigs, rig)
    rig.before_sensing = leave
    wait_until(lambda: not rig.last_n.any())
    rig.before_sensing = None
    device.release()
    with pytest.raises(DeviceError, match="SystemExit"):
        device.hold(rigs.push())


@pytest.mark.parametrize("kind", ["HeldForceRig", "compiled_rig"])
def test_a_loop_that_is_dead_plays_nothing(rigs, kind):
    with contextlib.closing(SafeDevice(getattr(rigs, kind)(), rigs.SETTINGS, RealClock())) as device:
        drive = device._drive
        drive.close()
        drive._closing = False
        with pytest.raises(DeviceError, match="its loop hangs"):
            device.hold(rigs.push())


@pytest.mark.parametrize("kind", ["HeldForceRig", "compiled_rig"])
def test_callers_detect_a_loop_that_died_silently(rigs, kind):
    with contextlib.closing(SafeDevice(getattr(rigs, kind)(), rigs.SETTINGS, RealClock())) as device:
        device.hold(rigs.push())
        device._drive._thread = threading.Thread()  # never started, so not alive
        device.keep_alive()
        assert device.fault() is Fault.LOST
        device._drive._thread.start()


def test_a_second_start_is_refused_where_the_ticks_run(rigs, rig, device):
    device.hold(rigs.push())
    alive(device, 0.1)
    device._held_stimulus = None  # as another thread sees it, which looked a moment earlier
    with pytest.raises(DeviceError, match="still playing"):
        device.hold(rigs.push(-2.9))
    with pytest.raises(DeviceError, match="still playing"):
        device.play(rigs.force(np.zeros((10, 3))))
    alive(device, 0.05)
    assert rig.last_n[0] == pytest.approx(2.9)
    assert rigs.violations(np.array(rig.written_n), rigs.LIMITS) == []


def test_two_threads_that_hold_at_once_do_not_break_the_slew_limit(rigs, rig, device):
    slow = rigs.HeldStimulus(rigs.force(np.tile([[-2.9, 0.0, 0.0]], (1_000_000, 1))), 0.05, 0.05, "linear")
    refused = []

    def hold(stimulus) -> None:
        try:
            device.hold(stimulus)
        except DeviceError as error:
            refused.append(error)

    threads = [threading.Thread(target=hold, args=(stimulus,)) for stimulus in (slow, rigs.push())]
    for thread in threads:
        thread.start()
        time.sleep(0.01)
    while any(thread.is_alive() for thread in threads):
        alive(device, 0.02)
    alive(device, 0.1)
    assert len(refused) == 1
    assert rigs.violations(np.array(rig.written_n), rigs.LIMITS) == []
