"""The driver while it plays: odd answers of the device, and what it refuses to send."""

import contextlib
import threading
import time
from ctypes import byref, c_double

import numpy as np
import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.force_dimension.library import LibraryError
from study.devices.force_dimension.tick_io import MAX_SCALED_FORCES, MAX_STALE_READINGS
from study.devices.rig import ACCELERATION, POSITION, SENSOR_CLIPPED, TRUE_ACCELERATION
from study.devices.safe import SafeDevice
from study.errors import DeviceError

CAP_N = 4.5


@pytest.fixture
def rig(stepped_stub):
    rig = stepped_stub.rig(CAP_N)
    yield rig
    stepped_stub.set("write_fails", 0)
    rig.close()


def force(*components: float) -> np.ndarray:
    return np.array(components)


def test_position_sensor_and_buttons_are_read(stepped_stub, rig):
    stepped_stub.move(0.01, -0.02, 0.03)
    stepped_stub.set("buttons", 0b101)
    reading = rig.sense()
    assert reading[POSITION].tolist() == [0.01, -0.02, 0.03]
    assert np.isfinite(reading[ACCELERATION]).all() and reading[SENSOR_CLIPPED] == 0
    assert np.isnan(reading[TRUE_ACCELERATION]).all()
    assert rig.buttons() == {0, 2}


def test_without_a_sensor_there_is_no_acceleration(stepped_stub):
    with contextlib.closing(stepped_stub.rig(sensed=False)) as rig:
        assert np.isnan(rig.sense()[ACCELERATION]).all()


def test_a_force_arrives_as_it_was_asked_for(stepped_stub, rig):
    rig.write(force(1.0, -2.0, 0.5))
    assert stepped_stub.applied_n.tolist() == [1.0, -2.0, 0.5]


@pytest.mark.parametrize("asked", [(4.6, 0, 0), (3, 3, 3), (np.nan, 0, 0), (0, np.inf, 0), (1e300, 1e300, 0)])
def test_forces_above_the_cap_or_not_finite_are_never_sent(stepped_stub, rig, asked):
    rig.write(force(1.0, 0.0, 0.0))
    with pytest.raises(DeviceError, match="refused; at most 4.5 N"):
        rig.write(force(*asked))
    stepped_stub.advance(0.001)
    assert not stepped_stub.applied_n.any()
    assert stepped_stub.get("peak_n") == pytest.approx(1.0)
    with pytest.raises(DeviceError):  # and none after it
        rig.write(force(0.1, 0.0, 0.0))
    assert not stepped_stub.applied_n.any()


def test_the_library_knows_the_cap_too(stepped_stub, rig):
    assert rig._handle.set_force(20.0, 0.0, 0.0)  # past the rig
    assert stepped_stub.applied_n[0] == pytest.approx(CAP_N)


def test_a_repeated_reading_is_accepted_and_many_in_a_row_end_the_force(stepped_stub, rig):
    stepped_stub.set("stale_every", 2)
    for _ in range(4 * MAX_STALE_READINGS):
        rig.sense()
    stepped_stub.set("stale_every", 1)
    for _ in range(MAX_STALE_READINGS - 2):
        rig.sense()
    with pytest.raises(DeviceError, match="repeatedly reports the same position"):
        for _ in range(3):
            rig.sense()


def test_a_briefly_scaled_force_is_accepted_and_a_long_one_ends_the_force(stepped_stub, rig):
    stepped_stub.set("scaled_from_n", 0.5)
    stepped_stub.set("scaled_every", 60)  # a stumble
    for _ in range(1000):
        rig.write(force(1.0, 0.0, 0.0))
    stepped_stub.set("scaled_every", 1)
    for _ in range(MAX_SCALED_FORCES - 1):
        rig.write(force(1.0, 0.0, 0.0))
    with pytest.raises(DeviceError, match="cannot give the commanded force"):
        rig.write(force(1.0, 0.0, 0.0))
    rig.write(np.zeros(3))
    assert not stepped_stub.applied_n.any()


def test_a_device_that_releases_during_a_force_ends_it_with_the_reason(stepped_stub, rig):
    rig.write(force(1.0, 0.0, 0.0))
    stepped_stub.set("off_by", 2)
    stepped_stub.advance(0.001)
    with pytest.raises(DeviceError, match="moved faster than the device allows"):
        for _ in range(20):
            rig.sense()
    stepped_stub.set("off_by", 0)
    with pytest.raises(DeviceError):
        rig.write(force(1.0, 0.0, 0.0))
    assert not stepped_stub.get("force_on")


def test_after_a_silence_without_force_the_device_is_woken(stub):
    with contextlib.closing(stub.rig()) as rig:
        time.sleep(0.1)
        assert stub.safe and stub.get("cause") == 3
        rig.sense()
        rig.write(np.zeros(3))
        rig.write(force(0.5, 0.0, 0.0))
        assert stub.applied_n.any() or stub.get("force_on")


def test_after_a_silence_with_a_force_the_device_is_not_woken(stub):
    with contextlib.closing(stub.rig()) as rig:
        rig.write(force(0.5, 0.0, 0.0))
        time.sleep(0.1)
        assert stub.safe
        with pytest.raises(DeviceError, match="too late for the device's watchdog"):
            rig.write(force(0.5, 0.0, 0.0))
        assert stub.safe


def test_a_zero_after_a_cut_off_force_does_not_wake_the_device(stub):
    """The call that was to hold the force may hang still: it must not find a device that takes forces again."""
    with contextlib.closing(stub.rig(rests=True)) as rig:
        rig.write(force(0.5, 0.0, 0.0))
        time.sleep(0.1)
        enabled = stub.get("enables")
        rig.write(np.zeros(3))
        time.sleep(0.1)
        assert stub.safe
        assert stub.get("enables") == enabled
        with pytest.raises(DeviceError, match="too late for the device's watchdog"):
            rig.write(force(0.5, 0.0, 0.0))


def test_while_nothing_is_played_gravity_stays_compensated(stub):
    """The library compensates gravity only in forces that it is given."""
    stub.set("watchdog_stretch", 10)  # a busy computer may be late for the watchdog itself
    with contextlib.closing(stub.rig(rests=True)) as rig:
        before = stub.get("writes")
        time.sleep(0.3)
        assert stub.get("writes") > before + 3
        assert stub.get("force_on") and stub.get("last_write") == 0
        rig.write(force(0.5, 0.0, 0.0))  # from now on it is the loop's: nothing is sent between two forces
        during = stub.get("writes")
        time.sleep(0.1)
        assert stub.get("writes") == during and stub.get("last_write") == 0.5
    after = stub.get("writes")
    time.sleep(0.1)
    assert stub.get("writes") == after and stub.safe


def test_the_error_is_that_of_the_thread_whose_call_failed(stub):
    handle = stub.opened()
    texts: dict[str, str] = {}
    barrier = threading.Barrier(2)
    to_xyz = [byref(c_double()) for _ in range(3)]

    def fail(name: str, call) -> None:
        barrier.wait()
        try:
            call()
        except LibraryError as error:
            texts[name] = error.text

    stub.set("read_fails", 7)
    stub.set("write_fails", 12)
    for _ in range(200):
        threads = [
            threading.Thread(target=fail, args=("read", lambda: handle.library.call("dhdGetPosition", *to_xyz, 0))),
            threading.Thread(target=fail, args=("write", lambda: handle.set_force(0.0, 0.0, 0.0))),
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert texts == {"read": "timeout", "write": "device not ready"}


def test_closing_tries_again_and_may_be_called_twice(stepped_stub, rig):
    rig.write(force(2.0, 0.0, 0.0))
    stepped_stub.set("stop_fails", 2)
    rig.close()
    rig.close()
    assert stepped_stub.safe
    assert (stepped_stub.get("stops"), stepped_stub.get("closes")) == (1, 1)
    assert rig._accelerometer.closed
    rig.write(np.zeros(3))  # harmless: it is braked
    with pytest.raises(DeviceError):
        rig.write(force(1.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("switch", "value", "fault"),
    [
        ("frozen", 1, Fault.STALE),
        ("jump_m", 0.06, Fault.JUMPED),
        ("jump_m", 0.2, Fault.OUTSIDE),
        ("no_number", 1, Fault.NOT_A_NUMBER),
        ("unplugged", 1, Fault.FORCE_LEFT),
        ("read_fails", 2, Fault.LOST),
        ("stale_every", 1, Fault.LOST),
        ("scaled_from_n", 0.01, Fault.LOST),
        ("off_by", 2, Fault.LOST),
    ],
)
def test_each_fault_of_the_device_ends_without_force(stepped_stub, rigs, switch, value, fault):
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(2.0))
        clock.sleep(0.25)
        assert stepped_stub.get("peak_n") > 0.5
        stepped_stub.set(switch, value)
        for _ in range(5):
            device.keep_alive()
            clock.sleep(0.1)
        assert device.fault() is fault
        stepped_stub.set(switch, 1e9 if switch == "scaled_from_n" else 0)
        if fault is not Fault.FORCE_LEFT:  # unplugged, no zero arrives: the watchdog's part
            assert not stepped_stub.applied_n.any()
        device.release()
    stepped_stub.advance(0.05)
    assert stepped_stub.safe
    assert stepped_stub.get("peak_n") <= rigs.LIMITS.total_cap_n


@pytest.mark.real_time
def test_a_loop_that_hangs_in_the_driver_leaves_the_force_to_the_watchdog(stub, rigs):
    """A read that lasts 300 ms: the loop hangs in it, the firmware lets go, and the session hears of it."""
    with contextlib.closing(SafeDevice(stub.rig(rests=True), rigs.SETTINGS, RealClock())) as device:
        device.hold(rigs.push(1.0))
        for _ in range(10):
            time.sleep(0.02)
            device.keep_alive()
        stub.set("late_s", 0.3)
        stub.set("late_every", 1)
        deadline = time.monotonic() + 5.0
        while device.fault() is Fault.NONE and time.monotonic() < deadline:
            time.sleep(0.01)
        assert device.fault() is not Fault.NONE
        stub.set("late_every", 0)
        time.sleep(0.1)
        assert not stub.applied_n.any()
        device.release()
    assert stub.safe
    assert stub.get("peak_n") <= rigs.LIMITS.total_cap_n


FAULTS = {
    "frozen": 1, "jump_m": 0.06, "no_number": 1, "unplugged": 1, "read_fails": 2, "write_fails": 2, "stale_every": 3,
    "scaled_from_n": 0.5, "off_by": 3, "stop_fails": 2, "powered": 0, "weight": 3, "stiffness": 300,
    "jump_every": 7, "scaled_every": 3, "frozen_axis": 2,
}  # fmt: skip


@pytest.mark.parametrize("seed", range(40))
def test_after_random_faults_at_random_times_the_cap_holds_and_the_end_is_braked(stepped_stub, rigs, seed):
    random = np.random.default_rng(seed)
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        for _ in range(3):
            with contextlib.suppress(DeviceError):
                device.hold(rigs.sine(float(random.uniform(0.5, 3.0)), periods_per_s=int(random.choice([5, 20, 25]))))
                for _ in range(int(random.integers(1, 6))):
                    clock.sleep(float(random.uniform(0.01, 0.2)))
                    if random.random() < 0.5:
                        switch = str(random.choice(list(FAULTS)))
                        stepped_stub.set(switch, FAULTS[switch])
                    if random.random() < 0.3:
                        stepped_stub.move(*random.uniform(-0.03, 0.03, 3))
                    if random.random() < 0.2:
                        device.stop()
                    device.keep_alive()
                device.release()
        for switch in FAULTS:  # what a cable and a person would mend; the device itself remembers
            stepped_stub.set(switch, 1e9 if switch == "scaled_from_n" else 0)
    stepped_stub.advance(0.05)
    assert stepped_stub.safe
    assert stepped_stub.get("peak_n") <= rigs.LIMITS.total_cap_n
