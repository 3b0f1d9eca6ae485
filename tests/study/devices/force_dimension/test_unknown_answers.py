"""Answers that are not known, that contradict each other, or that stop coming: none of them counts as success."""

import contextlib

import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.force_dimension.findings import examine
from study.devices.opening import open_device
from study.devices.safe import SafeDevice
from study.errors import DeviceError
from tests.study.devices.force_dimension.test_another_stub import held_and_closed, lost_words


def test_brakes_that_are_on_while_it_says_force_on_end_the_trial(stepped_stub, rigs):
    fault, said = lost_words(stepped_stub, rigs, lambda stub: stub.set("brakes_told", 1))
    assert fault is Fault.LOST
    assert "its brakes are on" in said


@pytest.mark.real_time
def test_brakes_that_are_on_while_it_says_force_on_keep_it_from_being_opened(stub, rigs):
    stub.set("brakes_told", 1)
    with pytest.raises(DeviceError, match="stay off: its brakes are on"):
        open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=False)


@pytest.mark.parametrize("answer", [3, 7, 2147483647])
@pytest.mark.parametrize("function", ["dhdGetPosition", "dhdSetForce", "dhdGetStatus"])
def test_an_answer_that_is_not_known_is_no_success(stepped_stub, rigs, function, answer):
    """Whether the call did anything is not known: at 7, say, each force may be ignored."""
    stepped_stub.set("answer_of_errors", answer)
    fault, said = lost_words(stepped_stub, rigs, lambda stub: stub.fail(function, 0, 1))
    assert fault is Fault.LOST
    assert f"{function}: an answer that is neither success nor a known error" in said


def test_a_device_that_told_its_forces_and_cannot_any_more_ends_the_trial(stepped_stub, rigs):
    """What it then gives would not be compared with what it was sent."""
    fault, said = lost_words(stepped_stub, rigs, lambda stub: stub.fail("dhdGetForce", 7))
    assert fault is Fault.LOST
    assert "dhdGetForce: timeout (error 7)" in said


@pytest.mark.parametrize("times", [0, 1, 3])
def test_a_reported_force_that_is_no_number_hides_no_wrong_gain(stepped_stub, rigs, times):
    """A gain of 0.7 at 0.5 N is seen by the sums over many reports alone."""
    stepped_stub.set("stiffness", 150)
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(0.5, 25))
        clock.sleep(0.25)
        stepped_stub.set("told_nan", times)
        stepped_stub.set("silent_gain", 0.7)
        for _ in range(60):
            device.keep_alive()
            clock.sleep(0.05)
        assert device.fault() is Fault.LOST
        assert "another force than the one that it was sent" in device.health().why
        assert stepped_stub.get("told_nan") == 0


@pytest.mark.parametrize("bias_n", [0.5, -1.0])
def test_a_force_that_is_added_without_a_word_ends_the_trial(stepped_stub, rigs, bias_n):
    """It changes no gain. A zero does not take it away, the watchdog does: after the failure nothing is sent."""
    stepped_stub.set("stiffness", 150)
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(stepped_stub.rig(), rigs.SETTINGS, clock)) as device:
        device.hold(rigs.sine(2.0))
        clock.sleep(0.25)
        stepped_stub.set("silent_bias", bias_n)
        clock.sleep(0.25)
        assert device.fault() is Fault.LOST
        assert "another force than the one that it was sent" in device.health().why
        stepped_stub.advance(0.05)
        assert stepped_stub.safe


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("switches", "said"),
    [
        ({"told_bias": float("nan")}, "the library says nan m/s along z"),
        ({"told_bias": 5.0}, "the library says 5"),
        ({"told_speed": 1000, "weight": 2.0}, "by its positions the handle moves at -"),
        ({"told_speed": -1, "weight": 2.0}, "by its positions the handle moves at -"),
    ],
    ids=["no number", "offset", "mm/s", "other way"],
)
def test_a_velocity_that_is_not_that_of_the_positions_is_told_and_tells_no_drift(stub, switches, said):
    """As it would be in mm/s. Whether the handle sinks is told from its positions."""
    for name, value in switches.items():
        stub.set(name, value)
    findings = {finding.name: finding for finding in examine("omega3")}
    assert said in findings["Velocity"].value and findings["Velocity"].warning
    sinks = "weight" in switches
    assert findings["Gravity"].fine is not sinks
    assert ("sinks" in findings["Gravity"].value) is sinks


@pytest.mark.real_time
@pytest.mark.parametrize("refused", ["", "dhdSetBrakes"])
def test_a_stop_that_is_answered_and_not_done_is_said(stub, rigs, capfd, refused):
    def disturb() -> None:
        stub.set("stop_ignored", 1)
        stub.fail(refused)

    held_and_closed(stub, rigs, disturb)
    assert "its brakes may be off" in capfd.readouterr().err
    assert not stub.applied_n.any()
