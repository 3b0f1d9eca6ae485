"""Another device with other faults: those that come and go, of an axis alone, or in the time that calls take. The
force goes or the trial is void, and nothing is sent beyond the cap."""

import contextlib
import time

import numpy as np
import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.force_dimension.tick_io import repeat_zero_once
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from study.session.stimulus.timing_verdict import MAX_LATE_FRACTION


def held_under(stepped_stub, rigs, stimulus, switches: dict[str, float], seconds: float = 2.0) -> Fault:
    """The fault, after the switches were set in the middle of the stimulus. The force stays within the cap, and is off
    at the end of a fault."""
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(stimulus)
        clock.sleep(0.25)
        assert stepped_stub.get("peak_n") > 0.3
        for name, value in switches.items():
            stepped_stub.set(name, value)
        for _ in range(round(seconds / 0.1)):
            device.keep_alive()
            clock.sleep(0.1)
        fault = device.fault()
        if fault is not Fault.NONE:
            assert not stepped_stub.applied_n.any()
        device.release()
    stepped_stub.advance(0.05)
    assert stepped_stub.safe
    assert stepped_stub.get("peak_n") <= rigs.LIMITS.total_cap_n
    return fault


@pytest.mark.parametrize("every", [1, 2, 7, 100, 500])
def test_a_jump_of_a_single_reading_ends_the_force(stepped_stub, rigs, every):
    fault = held_under(stepped_stub, rigs, rigs.sine(2.0), {"jump_m": 0.06, "jump_every": every})
    assert fault is Fault.JUMPED


@pytest.mark.parametrize("jump_m", [0.003, 0.01, -0.02])
def test_small_jumps_again_and_again_end_the_force(stepped_stub, rigs, jump_m):
    """Each alone could be a quick hand."""
    fault = held_under(stepped_stub, rigs, rigs.sine(2.0), {"jump_m": jump_m, "jump_every": 3})
    assert fault in (Fault.JUMPED, Fault.SHAKEN)


@pytest.mark.parametrize("every", [1, 3, 20])
def test_a_force_that_is_scaled_again_and_again_ends_the_trial(stepped_stub, rigs, every):
    fault = held_under(stepped_stub, rigs, rigs.sine(2.0), {"scaled_from_n": 0.1, "scaled_every": every})
    assert fault is Fault.LOST


@pytest.mark.parametrize("frequency_hz", [5, 25, 35, 45])
def test_a_force_whose_peaks_alone_are_scaled_ends_the_trial(stepped_stub, rigs, frequency_hz):
    """At 45 Hz a peak is scaled for 3 ms at a time."""
    fault = held_under(stepped_stub, rigs, rigs.sine(2.0, frequency_hz), {"scaled_from_n": 1.8})
    assert fault is Fault.LOST


def test_readings_of_which_most_are_repeated_end_the_trial(stepped_stub, rigs):
    """49 of 50, never 50 in a row."""
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(1.0))
        for tick in range(1000):
            stepped_stub.set("stale_every", 0 if tick % 50 == 0 else 1)
            clock.sleep(0.001)
            device.keep_alive()
        assert device.fault() in (Fault.LOST, Fault.JUMPED, Fault.SHAKEN)
        assert not stepped_stub.applied_n.any()


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_an_axis_that_freezes_pulls_no_harder_than_the_feedback_may(stepped_stub, rigs, axis):
    """The other axes move on: as long as its share of the force need not have moved it, what it may do is bounded."""
    held_under(stepped_stub, rigs, rigs.sine(2.0), {"frozen_axis": axis})
    assert stepped_stub.get("peak_n") <= 2.0 + rigs.LIMITS.feedback_cap_n


@pytest.mark.parametrize("stiffness", [0, 150, 1000])
@pytest.mark.parametrize(("amplitude_n", "frequency_hz"), [(2.0, 5), (2.0, 25), (3.0, 40)])
@pytest.mark.parametrize("axis", [2, 3])
def test_an_axis_that_freezes_is_noticed_where_the_force_along_it_moves_any_hand(
    stepped_stub, rigs, axis, amplitude_n, frequency_hz, stiffness
):
    stepped_stub.set("stiffness", stiffness)
    stimulus = rigs.sine(amplitude_n, frequency_hz)
    fault = held_under(stepped_stub, rigs, stimulus, {"frozen_axis": axis}, seconds=1.0)
    assert fault is Fault.STALE


@pytest.mark.parametrize("frequency_hz", [5, 25, 40])
def test_an_axis_that_stands_still_without_a_force_along_it_is_not_frozen(stepped_stub, rigs, frequency_hz):
    """Nothing acts along x."""
    assert held_under(stepped_stub, rigs, rigs.sine(3.0, frequency_hz), {"frozen_axis": 1}) is Fault.NONE


@pytest.mark.real_time
@pytest.mark.parametrize(
    "switches",
    [{"write_late_every": 1, "write_late_s": 0.004}, {"late_every": 1, "late_s": 0.004}, {"status_late_s": 0.015}],
    ids=["writes", "readings", "status"],
)
def test_calls_that_take_too_long_are_missed_ticks_and_never_a_stretched_force(stub, rigs, switches):
    with contextlib.closing(SafeDevice(stub.rig(rests=True), rigs.SETTINGS, RealClock())) as device:
        for name, value in switches.items():
            stub.set(name, value)
        device.hold(rigs.sine(1.0))
        for _ in range(25):
            time.sleep(0.02)
            device.keep_alive()
        health = device.release().health
        for name in switches:
            stub.set(name, 0)
    assert health.fault is not Fault.NONE or health.missed_ticks > 5 * MAX_LATE_FRACTION * health.ticks
    assert stub.safe
    assert stub.get("peak_n") <= rigs.LIMITS.total_cap_n


@pytest.mark.real_time
def test_a_write_that_hangs_leaves_the_force_to_the_watchdog(stub, rigs):
    with contextlib.closing(SafeDevice(stub.rig(rests=True), rigs.SETTINGS, RealClock())) as device:
        device.hold(rigs.push(1.0))
        time.sleep(0.1)
        device.keep_alive()
        stub.set("write_late_s", 0.3)
        stub.set("write_late_every", 1)
        deadline_s = time.monotonic() + 5.0
        while device.fault() is Fault.NONE and time.monotonic() < deadline_s:
            time.sleep(0.01)
        assert device.fault() is not Fault.NONE
        stub.set("write_late_every", 0)
        time.sleep(0.1)
        assert not stub.applied_n.any()
        device.release()
    assert stub.safe


@pytest.mark.parametrize("answer", [-1, -2147483647, 3])
def test_a_zero_that_is_answered_with_an_error_is_followed_by_the_brakes(stepped_stub, answer):
    """The device may give the force before for as long as its watchdog lets it."""
    stepped_stub.set("answer_of_errors", answer)
    with contextlib.closing(stepped_stub.rig()) as rig:
        rig.write(np.array([1.0, 0.0, 0.0]))
        stepped_stub.fail("dhdSetForce", 7)
        with pytest.raises(DeviceError, match="dhdSetForce: timeout"):
            rig.write(np.zeros(3))
        stepped_stub.advance(0.001)
        assert stepped_stub.safe


def test_a_repeated_zero_that_is_answered_with_an_error_is_followed_by_the_brakes(stepped_stub):
    stepped_stub.set("keeps_force", 1)
    with contextlib.closing(stepped_stub.rig()) as rig:
        rig.write(np.array([1.0, 0.0, 0.0]))
        rig.write(np.zeros(3))
        assert stepped_stub.applied_n.any()
        stepped_stub.fail("dhdSetForce", 7)
        assert repeat_zero_once(rig.compiled_io.calls, rig.compiled_io.cells, 0.0, np.zeros(3)) != 0
        stepped_stub.advance(0.001)
        assert stepped_stub.safe
