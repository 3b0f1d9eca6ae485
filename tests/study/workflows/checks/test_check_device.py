"""The check of an idle device: what is sound, and each way in which it is not."""

import contextlib
import math
from dataclasses import replace

import numpy as np
import pytest

from protocols.definition.apparatus import SafetySettings
from study.devices.clock import VirtualClock
from study.devices.opening import open_device
from study.devices.rig import READING_SIZE
from study.devices.safe import SafeDevice
from study.workflows.checks.check_device import READING_COUNT, check_device


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def rig(rigs):
    """A real rig at rest, with an accelerometer's noise."""
    rig = rigs.ScriptedRig()
    rig.instead_of_sensing = noisy(0.05)
    return rig


def noisy(rms_mps2: float, away_m: float = 0.0):
    rng = np.random.default_rng(1)

    def sense():
        reading = np.zeros(READING_SIZE)
        reading[0] = away_m
        reading[3:6] = rng.normal(scale=rms_mps2, size=3)
        return reading

    return sense


def changed(sense, place: int, value: float, every: int = 1):
    count = iter(range(10_000))

    def other():
        reading = sense()
        if next(count) % every == 0:
            reading[place] = value
        return reading

    return other


def findings(rig, rigs, clock, total_cap_n=None):
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        report = check_device(device, clock, (0.0, 0.0, 0.0), total_cap_n)
    return {finding.name: finding for finding in report.findings}


def test_the_simulated_device_is_fine_and_is_said_to_be_simulated(rigs, clock):
    with contextlib.closing(open_device("simulated", rigs.SETTINGS, clock, seed=1)) as device:
        report = check_device(device, clock, (0.0, 0.0, 0.0), 4.5)
    assert report.fine
    assert report.simulated
    assert [finding.name for finding in report.findings] == [
        "Device", "Answers", "Handle", "Accelerometer", "Rate", "Largest force",
    ]  # fmt: skip
    values = {finding.name: finding.value for finding in report.findings}
    assert values["Device"] == "simulated omega.3 (simulated: no handle moves)"
    assert values["Handle"] == "0.0 mm from its place"
    assert values["Accelerometer"] == "0.10 m/s² rms at rest"
    assert values["Largest force"] == "12 N; at most 4.5 N will be commanded"
    assert all(finding.advice == "" for finding in report.findings)


def test_a_real_device_at_rest_is_fine_after_half_a_second_and_gets_no_force(rig, rigs, clock):
    found = findings(rig, rigs, clock)
    assert all(finding.fine for finding in found.values())
    assert found["Device"].value == "mass (a real device)"
    assert clock.now_s() == pytest.approx(0.5)
    assert not rigs.written(rig.mass).any()  # one zero, from closing


def test_a_device_that_does_not_answer_is_told_so_and_nothing_is_said_of_its_sensors(rig, rigs, clock):
    def gone():
        raise OSError("usb")

    rig.instead_of_sensing = gone
    found = findings(rig, rigs, clock)
    assert (found["Answers"].value, found["Answers"].fine) == (f"0 of {READING_COUNT} times", False)
    assert found["Answers"].advice == "Check its power and its cable, then open it again."
    assert {"Handle", "Accelerometer"}.isdisjoint(found)


def test_an_answer_that_is_late_now_and_then_is_fine(rig, rigs, clock):
    sense, count = rig.instead_of_sensing, iter(range(1000))

    def late():
        if next(count) % 25 == 0:
            raise OSError("late")
        return sense()

    rig.instead_of_sensing = late
    assert findings(rig, rigs, clock)["Answers"].fine


def test_a_handle_far_from_its_place_is_to_be_brought_back(rig, rigs, clock):
    rig.instead_of_sensing = noisy(0.05, away_m=0.031)
    handle = findings(rig, rigs, clock)["Handle"]
    assert (handle.value, handle.fine) == ("31.0 mm from its place", False)
    assert handle.advice == "Bring the handle to within 20 mm of its place."


def test_the_place_is_where_trials_start(rig, rigs, clock):
    rig.instead_of_sensing = noisy(0.05, away_m=0.031)
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        assert check_device(device, clock, (0.030, 0.0, 0.0)).fine


def test_a_position_that_is_no_number_is_found(rig, rigs, clock):
    rig.instead_of_sensing = changed(noisy(0.05), 1, math.nan)
    handle = findings(rig, rigs, clock)["Handle"]
    assert (handle.value, handle.fine) == ("its position is no number", False)
    assert handle.advice == "Switch the device off and on, and calibrate it as its manual says."


@pytest.mark.parametrize(
    ("sense", "value", "advice"),
    [
        (changed(noisy(0.05), 4, math.nan), "its reading is no number", "Check the sensor's cable and its power."),
        (changed(noisy(0.05), 9, 1.0, every=10), "at its limit in 5 of 50 readings", "Lay the handle at rest"),
        (changed(noisy(0.05), 5, 0.3), "always exactly the same along z", "The sensor is dead, or not plugged in"),
        (noisy(0.0), "always exactly the same along x and y and z", "The sensor is dead"),
        (noisy(1.0), "m/s² rms at rest, more than 1", "Let go of the handle and check again"),
    ],
    ids=["no number", "clipped", "one channel dead", "dead", "wild"],
)
def test_an_accelerometer_that_cannot_be_trusted_is_found(rig, rigs, clock, sense, value, advice):
    rig.instead_of_sensing = sense
    sensor = findings(rig, rigs, clock)["Accelerometer"]
    assert not sensor.fine
    assert value in sensor.value
    assert advice in sensor.advice


def test_where_no_accelerometer_is_configured_that_is_said(rigs, clock):
    class UnsensedRig(rigs.ScriptedRig):
        @property
        def info(self):
            return replace(super().info, has_sensor=False)

    rig = UnsensedRig()
    rig.instead_of_sensing = changed(noisy(0.05), 4, math.nan)
    sensor = findings(rig, rigs, clock)["Accelerometer"]
    assert (sensor.value, sensor.fine, sensor.warning) == ("none is configured", False, True)
    assert sensor.advice.startswith("Trials run all the same; what the device delivers remains unknown.")


def test_a_rate_other_than_a_kilohertz_is_found(rigs, clock):
    class SlowRig(rigs.ScriptedRig):
        @property
        def info(self):
            return replace(rigs.INFO, simulated=False, sample_rate_hz=500.0)

    rate = findings(SlowRig(), rigs, clock)["Rate"]
    assert (rate.value, rate.fine) == ("500 Hz", False)
    assert rate.advice == "Stimuli are made for 1000 Hz: set the device's loop to that."


def test_a_device_that_is_too_weak_is_found(rig, rigs, clock):
    force = findings(rig, rigs, clock, total_cap_n=12.5)["Largest force"]
    assert (force.value, force.fine) == ("12 N; at most 12.5 N will be commanded", False)
    assert force.advice == "Lower total_cap_n in the protocol's [safety] section, or take a stronger device."
    assert findings(rig, rigs, clock)["Largest force"].value == "12 N"


def test_what_a_hand_may_feel_is_reported_before_a_sitting(rig, rigs, clock):
    safety = SafetySettings(stimulus_cap_n=2.5, total_cap_n=4.0)
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        report = check_device(device, clock, (0.0, 0.0, 0.0), 4.0, safety)
    value = {finding.name: finding.value for finding in report.findings}["Force on a hand"]
    assert value == "stimulus at most 2.5 N, spring and damper 1.5 N, all together 4 N"
