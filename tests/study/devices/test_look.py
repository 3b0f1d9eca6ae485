"""Looking at a device in real time: by the loop's own thread, past no hanging driver, and never with a force."""

import contextlib
import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.drive.realtime_drive import READING_TIMEOUT_S, ReadingRequests
from study.devices.rig import READING_SIZE
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from tests.study.devices.hung_driver.patience import alive

pytestmark = pytest.mark.real_time


@pytest.fixture
def rig(rigs):
    return rigs.ScriptedRig()


def reading(**values: float):
    answer = np.zeros(READING_SIZE)
    for place, value in values.items():
        answer[int(place[1:])] = value
    return lambda: answer


def seconds_for(action) -> float:
    started_s = time.monotonic()
    action()
    return time.monotonic() - started_s


def test_an_idle_rig_is_read_by_the_loop_and_written_nothing(rigs, device, rig):
    readers = []

    def sense():
        readers.append(threading.current_thread().name)
        return np.zeros(READING_SIZE)

    rig.instead_of_sensing = sense
    for _ in range(5):
        assert device.look().position_m == (0.0, 0.0, 0.0)
    assert readers == ["haptic loop"] * 5
    assert len(rigs.written(rig.mass)) == 0


def test_a_reading_that_is_not_finite_is_discarded(device, rig):
    rig.instead_of_sensing = reading(_4=math.nan, _9=1.0)
    look = device.look()
    assert look.position_m == (0.0, 0.0, 0.0)
    assert look.acceleration_mps2 is None
    assert look.sensor_clipped
    rig.instead_of_sensing = reading(_0=math.inf)
    assert device.look().position_m is None


@pytest.mark.parametrize("clock", [RealClock(), VirtualClock()], ids=["real", "virtual"])
def test_a_sensor_that_fails_while_idle_gives_no_reading_until_it_answers_again(rigs, rig, clock):
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        for nonsense in (fail, lambda: np.zeros(3)):
            rig.instead_of_sensing = nonsense
            assert device.look().position_m is None
            rig.instead_of_sensing = None
            assert device.look().position_m is not None
        device.hold(rigs.sine())  # looking alone gives nothing up


def test_a_driver_that_hangs_while_idle_makes_one_caller_wait_and_no_other(rigs, device, rig, hang):
    def hangs():
        hang.wait()
        return np.zeros(READING_SIZE)

    rig.instead_of_sensing = hangs
    assert READING_TIMEOUT_S * 0.9 < seconds_for(device.look) < READING_TIMEOUT_S + 0.3
    assert seconds_for(lambda: [device.look() for _ in range(20)]) < 5 * READING_TIMEOUT_S
    assert device.look().position_m is None
    hang.set()
    time.sleep(0.05)
    assert device.look().position_m is not None
    device.hold(rigs.sine())


def test_a_stimulus_for_a_driver_that_hangs_while_idle_is_refused(rigs, device, rig, hang):
    rig.instead_of_sensing = hang.wait
    device.look()
    with pytest.raises(DeviceError, match=r"its loop hangs\)\. Its force is off"):
        device.hold(rigs.sine())
    assert seconds_for(device.close) < 2.0
    assert rig.closed


def test_a_look_at_a_held_stimulus_finds_a_loop_that_hangs(rigs, device, rig, hang):
    device.hold(rigs.push())
    alive(device, 0.1)
    assert device.look().position_m[0] > 0
    rig.instead_of_sensing = hang.wait
    time.sleep(0.15)
    assert device.look().position_m is None
    assert device.fault() is Fault.LOST


def test_missed_ticks_are_those_of_the_present_stimulus(rigs, device, rig):
    sense = rig.sense

    def slow():
        rig.instead_of_sensing = None
        time.sleep(0.03)
        return sense()

    device.hold(rigs.push())
    alive(device, 0.05)
    rig.instead_of_sensing = slow
    alive(device, 0.1)
    missed = device.look().missed_ticks
    assert missed >= 20
    assert device.release().health.missed_ticks >= missed
    assert device.look().missed_ticks == 0


def test_looks_from_two_threads_never_meet_a_tick_in_the_driver(rigs):
    inside, met, looks, over = [], [], [], threading.Event()

    def enter(*_) -> None:
        met.extend(inside)
        inside.append(threading.current_thread().name)
        time.sleep(0.0002)
        inside.clear()

    def watch() -> None:
        while not over.is_set():
            looks.append(device.look())
            time.sleep(0.002)

    rig = rigs.HeldForceRig()
    rig.before_sensing = rig.before_writing = enter
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, RealClock())) as device:
        watchers = [threading.Thread(target=watch) for _ in range(2)]
        for watcher in watchers:
            watcher.start()
        for _ in range(4):
            device.hold(rigs.sine(0.5, 25, fade_s=0.02))
            alive(device, 0.08)
            device.release()
            time.sleep(0.02)
        over.set()
        for watcher in watchers:
            watcher.join()
    assert met == []
    assert len(looks) > 50
    assert np.mean([look.position_m is not None for look in looks]) > 0.9  # all of them, on a computer that is free
    assert rigs.violations(np.array(rig.written_n), rigs.LIMITS) == []


def test_a_loop_that_is_dead_is_not_waited_for(rigs, device):
    device._drive.close()
    device._drive._closing = False
    assert seconds_for(device.look) < 0.05
    assert device.look().position_m is None


def test_a_simulated_device_in_real_time_is_looked_at_while_idle_and_while_held(rigs):
    pressed = {2}
    with contextlib.closing(SafeDevice(rigs.compiled_rig(pressed=pressed), rigs.SETTINGS, RealClock())) as device:
        assert device.look().buttons == {2}
        device.hold(rigs.push())
        alive(device, 0.1)
        assert device.look().position_m[0] > 0
        device.release()
        assert device.look().acceleration_mps2 is not None


def fail():
    raise OSError("usb")


def test_failing_buttons_count_as_a_failing_rig(rigs, rig):
    clock = VirtualClock()
    rig.buttons = fail
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        assert device.look().position_m is None
        device.hold(rigs.push())
        clock.sleep(0.1)
        assert device.fault() is Fault.LOST
        assert not rigs.written(rig.mass)[-1].any()


def test_buttons_of_a_simulation_that_fail_are_no_reading(rigs):
    rig = replace(rigs.compiled_rig(), buttons=fail)
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, VirtualClock())) as device:
        assert device.look().position_m is None


PATIENT_S = 60.0


class StillClock(RealClock):
    def __init__(self) -> None:
        self.seconds = 0.0

    def now_s(self) -> float:
        return self.seconds


def test_concurrent_requests_get_the_same_reading():
    served, requested = [], threading.Semaphore(0)
    # A machine may pause a thread for longer than a caller waits: the long timeout leaves that out of this test.
    glances = ReadingRequests(StillClock(), wake=requested.release, timeout_s=PATIENT_S)
    askers = [threading.Thread(target=lambda: served.append(glances.request_reading())) for _ in range(2)]
    for asker in askers:
        asker.start()
    for _ in askers:
        assert requested.acquire(timeout=PATIENT_S)
    glances.mark_taken()
    for asker in askers:
        asker.join()
    assert served == [True, True]
    assert not glances.is_pending


def test_a_late_request_is_not_waited_for_again_until_it_is_served():
    timeout_s = 2.0
    clock = StillClock()
    glances = ReadingRequests(clock, wake=lambda: None, timeout_s=timeout_s)
    assert seconds_for(glances.request_reading) > timeout_s * 0.9
    clock.seconds = 2 * timeout_s
    assert seconds_for(glances.request_reading) < timeout_s / 2
    glances.mark_taken()
    assert seconds_for(glances.request_reading) > timeout_s * 0.9
