"""Another device with other faults: errors of each function of its library in turn, calls that hang while it is closed,
answers that are no numbers, and forces that are not those that it was sent."""

import contextlib
import time

import numpy as np
import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.force_dimension.library import SIGNATURES
from study.devices.opening import open_device
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from tests.slow_instances import each_pair_once, slow

WATCHED = ("dhdSetWatchdog", "dhdGetWatchdog")
OPENING = (
    "dhdOpenID", "dhdGetSystemType", "dhdGetSerialNumber", "dhdGetVersion", "dhdGetStatus", "dhdEnableForce",
    "dhdSetBrakes", "dhdSetForce", "dhdSetGravityCompensation", "dhdSetEffectorMass", "dhdSetMaxForce",
    "dhdSetTimeGuard", *WATCHED,
)  # fmt: skip


def lost_words(stepped_stub, rigs, disturb) -> tuple[Fault, str]:
    """The fault of a held stimulus that is disturbed, and what the next stimulus is refused with."""
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(2.0))
        clock.sleep(0.25)
        disturb(stepped_stub)
        for _ in range(20):
            device.keep_alive()
            clock.sleep(0.05)
        fault = device.fault()
        assert fault is Fault.NONE or not stepped_stub.applied_n.any()
        device.release()
        said = ""
        if fault is Fault.LOST:
            with pytest.raises(DeviceError) as refused:
                device.hold(rigs.sine(2.0))
            said = str(refused.value)
    stepped_stub.advance(0.05)
    assert stepped_stub.safe
    assert stepped_stub.get("peak_n") <= rigs.LIMITS.total_cap_n
    return fault, said


@pytest.mark.parametrize("stiffness", [0, 150, 1000])
@pytest.mark.parametrize("switches", [{"silently_n": 0.5}, {"silently_n": 1.0}, {"turned": 1}])
def test_a_force_that_is_changed_without_a_word_ends_the_trial(stepped_stub, rigs, switches, stiffness):
    """No answer says so; what the device says that it gives is another force than it was sent."""
    stepped_stub.set("stiffness", stiffness)
    fault, said = lost_words(stepped_stub, rigs, lambda stub: [stub.set(*each) for each in switches.items()])
    assert fault is Fault.LOST
    assert "It repeatedly reports another force than the one that it was sent" in said


@pytest.mark.parametrize(
    ("gain", "amplitude_n", "frequency_hz"), each_pair_once([0.0, 0.7, 1.3], [0.3, 0.5, 1.0, 1.9], [5, 25, 40, 45])
)
def test_a_force_that_is_scaled_without_a_word_ends_the_trial_although_it_is_weak(
    stepped_stub, rigs, gain, amplitude_n, frequency_hz
):
    """No single look tells 30 % of less than 2 N from what the report may be off by; many do."""
    stepped_stub.set("stiffness", 150)
    stepped_stub.set("told_noise", 0.03)
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(amplitude_n, frequency_hz))
        clock.sleep(0.25)
        stepped_stub.set("silent_gain", gain)
        for _ in range(60):
            device.keep_alive()
            clock.sleep(0.05)
        assert device.fault() is Fault.LOST
        assert "another force than the one that it was sent" in device.health().why
        assert not stepped_stub.applied_n.any()


HONEST = (
    {"stiffness": 150}, {"silent_gain": 0.9}, {"silent_gain": 1.1}, {"told_step": 0.1}, {"told_noise": 0.1},
    {"told_step": 0.2, "told_noise": 0.05}, {"weight": 2.0},
)  # fmt: skip
HELD = each_pair_once(HONEST, [0.1, 0.25, 1.0, 3.0], [5, 20, 25, 40, 50])


@pytest.mark.parametrize(("switches", "amplitude_n", "frequency_hz"), HELD, ids=str)
def test_a_device_that_gives_what_it_was_sent_is_not_suspected(stepped_stub, rigs, switches, frequency_hz, amplitude_n):
    """What it says may be a tick old, rounded and noisy, and one in thirty forces may be scaled."""
    for name, value in switches.items():
        stepped_stub.set(name, value)
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(amplitude_n, frequency_hz))
        for _ in range(100):
            device.keep_alive()
            clock.sleep(0.05)
        assert device.fault() is Fault.NONE
        device.release()


@pytest.mark.parametrize("told", [0.0, "error"])
def test_a_device_that_tells_no_force_is_not_judged_by_it(stepped_stub, rigs, told):
    if told == "error":
        stepped_stub.fail("dhdGetForce")
    stepped_stub.set("gain_told", 0.0)
    assert lost_words(stepped_stub, rigs, lambda stub: None) == (Fault.NONE, "")


@pytest.mark.parametrize("stiffness", [150, *slow(0, 1000)])
@pytest.mark.parametrize(("amplitude_n", "frequency_hz"), [(1.0, 5), (1.0, 20), (2.0, 25), (3.0, 40), (3.0, 50)])
def test_an_encoder_that_freezes_is_noticed_within_a_second_under_a_force_that_moves_any_hand(
    stepped_stub, rigs, amplitude_n, frequency_hz, stiffness
):
    stepped_stub.set("stiffness", stiffness)
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(amplitude_n, frequency_hz))
        clock.sleep(0.25)
        stepped_stub.set("frozen", 1)
        for _ in range(10):
            device.keep_alive()
            clock.sleep(0.1)
        assert device.fault() is Fault.STALE
        assert not stepped_stub.applied_n.any()
        device.release()


@pytest.mark.parametrize("frequency_hz", [5, 20, 50])
def test_an_encoder_that_freezes_under_a_weak_force_pulls_no_harder_than_it_did(stepped_stub, rigs, frequency_hz):
    """Dry friction holds a hand as still: it cannot be told."""
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        stepped_stub.set("frozen", 1)
        stepped_stub.move(0.02, 0.0, 0.0)
        device.hold(rigs.sine(0.2, frequency_hz))
        for _ in range(30):
            device.keep_alive()
            clock.sleep(0.1)
        assert device.fault() is Fault.NONE
        device.release()
    assert stepped_stub.get("peak_n") <= 0.2 + 1e-6


@pytest.mark.parametrize("kind", range(1, 8))
def test_a_position_that_is_no_number_lets_go_on_each_axis(stepped_stub, rigs, kind):
    """NaN, infinite, or beyond all measure."""
    fault, _ = lost_words(stepped_stub, rigs, lambda stub: stub.set("no_number", kind))
    assert fault is Fault.NOT_A_NUMBER


def test_a_position_that_is_reported_as_read_and_never_written_is_no_position(stepped_stub, rigs):
    fault, _ = lost_words(stepped_stub, rigs, lambda stub: stub.set("unwritten", 1))
    assert fault is Fault.NOT_A_NUMBER


@pytest.mark.parametrize(
    ("untold", "why"), [(1, "its power supply is off"), (2, "reports another force than the one that it was sent")]
)
def test_a_status_or_force_that_is_reported_as_read_and_never_written_ends_the_trial(stepped_stub, rigs, untold, why):
    """What an earlier call wrote there must not stand for it."""
    fault, said = lost_words(stepped_stub, rigs, lambda stub: stub.set("untold", untold))
    assert fault is Fault.LOST
    assert why in said


NO_CAUSE = 0.5
"""Of the stub's `off_by`: the force goes off, and the status has no cause for it."""


@pytest.mark.parametrize("off_by", [0, NO_CAUSE], ids=["says force on", "off without a cause"])
@pytest.mark.parametrize(
    ("switch", "why"),
    [("powered", "its power supply is off"), ("calibrated", "it does not know its place any more")],
)
def test_a_device_without_power_or_calibration_ends_the_force_although_it_says_force_on(
    stepped_stub, rigs, switch, why, off_by
):
    def disturb(stub) -> None:
        stub.set("off_by", off_by)
        stub.advance(0.001)  # it is off before it is looked at
        stub.set(switch, 0)

    fault, said = lost_words(stepped_stub, rigs, disturb)
    assert fault is Fault.LOST
    assert why in said


@pytest.mark.parametrize("code", [-1, -2, -2147483647])
@pytest.mark.parametrize("function", ["dhdGetPosition", "dhdSetForce", "dhdGetStatus", "dhdGetButtonMask"])
def test_a_single_error_of_a_call_of_the_loop_ends_the_trial_with_its_words(stepped_stub, rigs, function, code):
    stepped_stub.set("answer_of_errors", code)
    fault, said = lost_words(stepped_stub, rigs, lambda stub: stub.fail(function, 7, 1))
    assert fault is Fault.LOST
    assert f"{function}: timeout (error 7)" in said
    assert "Its force is off" in said and "`hapteq resume`" in said


@pytest.mark.real_time
@pytest.mark.parametrize("function", OPENING)
def test_an_error_of_any_call_while_it_is_opened_is_said_and_leaves_the_brakes_on(stub, rigs, function):
    assert function in SIGNATURES
    stub.fail(function, 7)
    with pytest.raises(DeviceError) as refused:
        open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=False)
    stub.fail(function, 7, 0)
    said = str(refused.value)
    assert "watchdog" in said if function in WATCHED else f"{function}: timeout (error 7)" in said
    assert refused.value.do_now
    time.sleep(0.05)
    assert stub.safe
    assert stub.get("peak_n") == 0


def held_and_closed(stub, rigs, disturb) -> float:
    """How long closing took, s, in the middle of a force."""
    stub.set("stretch_in_use", 100)
    device = open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=False)
    try:
        device.hold(rigs.push(1.0))
        for _ in range(8):
            time.sleep(0.02)
            device.keep_alive()
        disturb()
    finally:
        began_s = time.monotonic()
        device.close()
    return time.monotonic() - began_s


@pytest.mark.real_time
@pytest.mark.parametrize("function", ["dhdStop", "dhdClose", "dhdSetBrakes"])
def test_an_error_while_it_is_closed_leaves_no_force_and_one_that_matters_is_said(stub, rigs, capfd, function):
    held_and_closed(stub, rigs, lambda: stub.fail(function))
    said = capfd.readouterr().err
    assert not stub.applied_n.any()
    assert ("its brakes may be off" in said) == (function == "dhdStop")  # each of the others is made good by it
    if function == "dhdStop":
        assert "it got zero force" in said and "what was measured is saved" in said and "switch it off" in said
    stub.fail(function, 2, 0)
    time.sleep(0.1)
    assert not stub.applied_n.any()


@pytest.mark.real_time
@pytest.mark.parametrize("function", ["dhdStop", *slow("dhdSetBrakes")])
def test_a_call_that_hangs_while_it_is_closed_leaves_no_force_and_is_said(stub, rigs, capfd, function):
    took_s = held_and_closed(stub, rigs, lambda: stub.delay(function, 1.5))
    said = capfd.readouterr().err
    assert not stub.applied_n.any()
    assert took_s < 5.0
    assert "its brakes may be off" in said
    stub.delay("", 0.0)
    until_s = time.monotonic() + 10.0
    while not stub.safe and time.monotonic() < until_s:
        time.sleep(0.05)
    assert stub.safe
    assert np.isfinite(stub.get("peak_n")) and stub.get("peak_n") <= rigs.LIMITS.total_cap_n


@pytest.mark.real_time
def test_a_device_that_keeps_its_force_at_zero_is_braked_while_nothing_is_played(stub, rigs):
    """An emergency stop, whose zero is answered and not given: neither an error nor the watchdog would tell."""
    stub.set("stiffness", 150)
    stub.set("stretch_in_use", 1000)
    rig = stub.rig(rests=True)
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, RealClock())) as device:
        device.hold(rigs.push(1.0))
        for _ in range(8):
            time.sleep(0.02)
            device.keep_alive()
        stub.set("keeps_force", 1)
        device.stop()
        until_s = time.monotonic() + 10.0
        while not stub.safe and time.monotonic() < until_s:
            time.sleep(0.005)
        assert stub.safe
        assert 0.0 < stub.get("braked_s") - stub.get("zeroed_s") < 0.5
        with pytest.raises(DeviceError, match="another force than the one that it was sent"):
            rig.sense()
        with pytest.raises(DeviceError):
            device.hold(rigs.push(1.0))
        time.sleep(0.1)
        assert stub.safe


@pytest.mark.parametrize("devices", [16, 17, 1e6, 2e9])
def test_a_library_that_has_lost_count_of_its_devices_is_asked_for_few(stub, rigs, devices):
    stub.set("devices", devices)
    stub.set("type", 63)
    began_s = time.monotonic()
    with pytest.raises(DeviceError, match="Found instead: delta3") as refused:
        open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=False)
    assert time.monotonic() - began_s < 5.0
    assert len(str(refused.value)) < 1000
    counted = f"The library counts {devices:.0f} devices, of which the first 16 were looked at."
    assert (counted in str(refused.value)) == (devices > 16)
