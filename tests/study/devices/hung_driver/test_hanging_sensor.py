"""A sensor or a driver that hangs: the force goes all the same."""

import contextlib
import threading
import time

import numpy as np
import pytest

from study.devices.clock import RealClock
from study.devices.device import Fault
from study.devices.drive.compiled_drive import WRITING
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.governor import govern
from study.devices.governor.governor import Governor
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from tests.study.devices.hung_driver.patience import alive, hold, wait_until

pytestmark = pytest.mark.real_time


def in_loop(action):
    """Only in the haptic loop: other threads get through."""
    return lambda *_: action() if threading.current_thread().name == "haptic loop" else None


def test_a_sensor_that_hangs_loses_the_force_although_the_program_is_alive(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    alive(device, 0.3)
    assert not rig.last_n.any()
    assert device.fault() is Fault.LOST
    assert device.release().health.fault is Fault.LOST
    with pytest.raises(DeviceError, match=r"no sign of life\)\. Its force is off"):
        device.hold(rigs.push())


def test_a_force_that_the_hardware_dropped_while_the_loop_was_late_does_not_come_back(rigs, rig):
    """Late by less than makes a loop count as hanging."""

    def be_late_once() -> None:
        rig.before_sensing = None
        written_before.append(len(rig.written_n))
        time.sleep(0.075)

    written_before: list[int] = []
    rig.drops_force_after_s = 0.05
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, RealClock())) as device:
        hold(device, rigs, rig)
        rig.before_sensing = in_loop(be_late_once)
        alive(device, 0.2)
        assert device.fault() in (Fault.STALLED, Fault.LOST)  # LOST: on a busy computer, later than that
    written = rig.written_n[written_before[0] :]
    assert written and not np.any(written)


def test_asking_for_faults_alone_finds_the_hanging_loop_too(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    time.sleep(0.15)
    assert device.fault() is Fault.LOST
    assert not rig.last_n.any()


def test_a_release_does_not_wait_long_for_a_hanging_sensor(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    started_s = time.monotonic()
    assert device.release().health.fault is Fault.LOST
    assert time.monotonic() - started_s < 0.5
    assert not rig.last_n.any()


def test_an_emergency_stop_needs_no_loop(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    time.sleep(0.02)
    device.stop()
    assert not rig.last_n.any()
    assert device.fault() is Fault.STOPPED
    hang.set()
    time.sleep(0.05)
    assert not rig.last_n.any()


def test_an_emergency_stop_that_the_loop_hears_is_left_to_it(device, rigs, rig):
    hold(device, rigs, rig)
    device.stop()
    assert not rig.last_n.any()
    assert device.release().health.fault is Fault.STOPPED


def test_commands_end_when_the_sensor_hangs(device, rigs, rig, hang):
    def hang_in_the_middle(share: float) -> None:
        if share > 0.6:
            rig.before_sensing = hang.wait

    with pytest.raises(DeviceError, match="no sign of life"):
        device.play(rigs.force(np.zeros((1000, 3))), hang_in_the_middle)


def test_a_write_that_goes_through_late_is_taken_back(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_writing = in_loop(hang.wait)
    time.sleep(0.02)
    assert device.release().health.fault is Fault.FORCE_LEFT  # what the late write does is not known
    device.close()
    assert not rig.last_n.any()
    late, closed = len(rig.written_n), rig.closed
    hang.set()
    wait_until(lambda: rig.closed > closed)
    assert rig.written_n[late][0] == pytest.approx(2.9, abs=0.2)  # the late one
    assert not rig.last_n.any()


def test_a_write_that_ends_while_zero_is_written_is_followed_by_a_zero(rigs, rig, hang):
    governor = Governor(rig.info, rigs.SETTINGS)
    runner = SteppedRunner(rig, governor, catches_up=False)
    governor.begin_hold(rigs.push())
    runner.run(20)
    rig.before_writing = in_loop(hang.wait)
    loop = threading.Thread(target=runner.run, args=(1,), name="haptic loop")
    loop.start()
    wait_until(lambda: runner.loop_state[WRITING])
    threading.Timer(0.03, hang.set).start()
    runner.give_up(TimeoutError("late"))  # as of a loop that was stopped in its write, and takes a moment to run again
    loop.join()
    assert governor.fault is Fault.LOST
    assert runner.force_off and not rig.last_n.any()
    runner.disconnect()


def test_a_late_write_of_a_device_that_is_still_open_is_taken_back_too(device, rigs, rig, hang):
    hold(device, rigs, rig)
    rig.before_writing = in_loop(hang.wait)
    alive(device, 0.25)
    late = len(rig.written_n)
    hang.set()
    wait_until(lambda: len(rig.written_n) > late + 1)
    assert not rig.last_n.any()
    assert rig.closed == 0


def test_a_returning_driver_that_refuses_zero_is_not_reported_as_force_off(device, rigs, rig, hang):
    def fail(force_n) -> None:
        raise OSError("usb")

    hold(device, rigs, rig)
    rig.before_sensing = hang.wait
    alive(device, 0.2)
    assert device.fault() is Fault.LOST
    rig.before_writing = fail
    hang.set()
    wait_until(lambda: device.fault() is Fault.FORCE_LEFT)


def test_a_rig_that_was_given_up_gets_no_force_even_from_a_tick_that_was_under_way(rigs, rig):
    governor = Governor(rig.info, rigs.SETTINGS)
    runner = SteppedRunner(rig, governor, catches_up=False)
    governor.begin_hold(rigs.push())
    runner.run(20)
    runner.give_up(OSError("usb"))
    governor.state[govern.PHASE] = govern.PLAYING  # as a tick leaves it that heard of nothing
    given = len(rig.written_n)
    runner.run(20)
    assert not runner.moving
    assert not np.any(rig.written_n[given:])
    runner.disconnect()


@pytest.mark.parametrize("ended", [False, True])
def test_nothing_begins_while_the_loop_is_being_closed(device, rigs, rig, ended):
    device._drive._closing = True
    if ended:
        device._drive.close()
        assert not device._drive._thread.is_alive()
    with pytest.raises(DeviceError, match="cannot do this now"):
        device.hold(rigs.push())
    assert rig.written_n == []


def test_a_driver_that_hangs_with_its_lock_blocks_no_other_caller(device, rigs, rig, hang):
    hold(device, rigs, rig)
    lock = threading.Lock()

    def sense() -> None:
        with lock:
            hang.wait()

    def write(force_n) -> None:
        with lock:
            pass

    rig.before_sensing, rig.before_writing = sense, write
    time.sleep(0.02)
    started_s = time.monotonic()
    assert device.release().health.fault is Fault.FORCE_LEFT
    with pytest.raises(DeviceError, match="Let go of the handle and switch the device off"):
        device.hold(rigs.push())
    device.close()
    assert time.monotonic() - started_s < 1.5
    hang.set()
    wait_until(lambda: not rig.last_n.any())
