"""Timing with zero force: what a loop that keeps up looks like, and one that does not."""

import contextlib
import itertools
import threading
import time
from dataclasses import replace

import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Fault
from study.devices.opening import open_device
from study.devices.safe import SafeDevice
from study.devices.telemetry import Ring
from study.errors import DeviceError
from study.session.views.participant_views import DeviceFinding
from study.workflows.checks import examine_setup
from study.workflows.checks.check_timing import check_computer, check_timing


class LateClock(VirtualClock):
    """Every sleep ends 1.5 ms late."""

    def sleep(self, seconds: float) -> None:
        super().sleep(max(seconds, 0.0) + 0.0015)


@pytest.fixture
def settings(rigs):
    return replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0)


def timed(device, clock, seconds: float = 1.0):
    with contextlib.closing(device):
        timing = check_timing(device, clock, seconds, lambda done: None)
    return timing, {finding.name: finding for finding in timing.findings}


def test_a_simulated_device_in_virtual_time_is_never_late(settings):
    clock, progress = VirtualClock(), []
    with contextlib.closing(open_device("simulated", settings, clock, seed=1)) as device:
        timing = check_timing(device, clock, 1.0, progress.append)
    assert timing.health.missed_ticks == 0
    assert timing.health.peak_command_n == 0.0
    assert timing.lateness.longest_ms == pytest.approx(0.0, abs=1e-6)
    assert timing.lateness.missed_fraction == 0.0
    assert all(finding.fine for finding in timing.findings)
    assert "a simulated device's loop catches up, so it misses none" in timing.findings[1].value
    assert progress[-1] == pytest.approx(1.0)


def test_the_timing_check_writes_zero_forces_alone(rigs, settings):
    rig, clock = rigs.compiled_rig(), VirtualClock()
    timed(SafeDevice(rig, settings, clock), clock)
    assert len(rigs.written(rig)) > 1000
    assert not rigs.written(rig).any()


def test_a_spring_that_pulled_meanwhile_is_reported(rigs):
    rig, clock = rigs.compiled_rig(), VirtualClock()
    rig.state[rigs.LEAN] = 0.01
    _, found = timed(SafeDevice(rig, rigs.SETTINGS, clock), clock)
    assert not found["Force"].fine


def test_a_late_computer_is_a_warning_with_a_simulated_device(settings):
    clock = LateClock()
    timing, found = timed(open_device("simulated", settings, clock, seed=1), clock)
    assert timing.lateness.p99_ms > 1.0
    assert timing.lateness.missed_fraction > 0.5
    assert (found["Lateness"].fine, found["Lateness"].warning) == (False, True)
    assert "too late for a real device" in found["Lateness"].value
    assert found["Lateness"].advice == "Close other programs, switch power saving off, and measure again."


def test_a_late_computer_is_a_fault_with_a_real_device(rigs, settings):
    clock = LateClock()
    _, found = timed(SafeDevice(rigs.ScriptedRig(), settings, clock), clock)
    assert found["Lateness"].wrong
    assert found["Lateness"].value.endswith("too late for this device (99 % must come within 1 ms)")
    assert found["Missed ticks"].value.endswith("%)")


@pytest.mark.real_time
def test_ticks_that_a_real_loop_missed_are_counted(rigs, settings):
    rig = rigs.HeldForceRig()
    rig.before_sensing = lambda: time.sleep(0.01)
    timing, found = timed(SafeDevice(rig, settings, RealClock()), RealClock(), 0.3)
    assert timing.health.missed_ticks > 100
    assert timing.health.latest_s > 0.009
    assert not found["Missed ticks"].fine
    assert found["Missed ticks"].advice == "Close other programs, switch power saving off, and measure again."


def test_a_device_that_is_lost_in_the_middle_is_reported(rigs, settings):
    def gone():
        raise OSError("usb")

    class UnpluggedLater(VirtualClock):
        def sleep(self, seconds: float) -> None:
            super().sleep(seconds)
            if self.now_s() > 0.5:
                rig.instead_of_sensing = gone

    rig, clock = rigs.ScriptedRig(), UnpluggedLater()
    timing, found = timed(SafeDevice(rig, settings, clock), clock)
    assert timing.health.fault is Fault.LOST
    assert clock.now_s() < 0.7
    assert (found["Loop"].value, found["Loop"].fine) == ("it let go: the device stopped answering: usb", False)
    assert found["Loop"].advice.startswith("Check the device's power and cable")


def test_a_device_that_was_lost_before_is_an_error(rigs, settings):
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(rigs.ScriptedRig(), settings, clock)) as device:
        device._runner.give_up(OSError("usb"))
        with pytest.raises(DeviceError, match="The device was lost"):
            check_timing(device, clock, 1.0, lambda done: None)


def test_an_interruption_lets_go(rigs, settings):
    def interrupt(done: float) -> None:
        raise KeyboardInterrupt

    rig, clock = rigs.compiled_rig(), VirtualClock()
    with contextlib.closing(SafeDevice(rig, settings, clock)) as device:
        with pytest.raises(KeyboardInterrupt):
            check_timing(device, clock, 1.0, interrupt)
        device.hold(rigs.sine())  # idle again


@pytest.mark.parametrize(("clock", "verdicts"), [(VirtualClock(), ["ok", "ok"]), (LateClock(), ["warn", "ok"])])
def test_before_a_sitting_the_computer_is_measured_for_a_second_without_the_device(clock, verdicts):
    found = check_computer(clock, 1000.0, simulated=True, load_per_processor=0.5)
    assert [finding.name for finding in found] == ["Lateness", "Load"]
    assert [finding.verdict for finding in found] == verdicts
    assert 1.0 <= clock.now_s() < 3.0


@pytest.mark.real_time
@pytest.mark.parametrize("real", [True, False])
def test_what_is_asked_of_the_device_meanwhile_is_asked_by_the_caller(rigs, settings, real):
    rig = rigs.HeldForceRig() if real else rigs.compiled_rig()
    attended: list[threading.Thread] = []
    with contextlib.closing(SafeDevice(rig, settings, RealClock(), Ring())) as device:
        timing = check_timing(device, RealClock(), 0.2, lambda done: attended.append(threading.current_thread()))
    assert set(attended) == {threading.current_thread()}
    assert ("Late ticks" in {finding.name for finding in timing.findings}) == real


@pytest.mark.real_time
def test_the_lateness_of_a_real_device_is_that_of_its_own_loop(rigs, settings):
    """Every fourth reading lasts 3 ms; the program that asks is on time."""
    rig = rigs.HeldForceRig()
    rig.before_sensing = lambda: time.sleep(0.003 if rig.sense_calls % 4 == 0 else 0.0)
    with contextlib.closing(SafeDevice(rig, settings, RealClock(), Ring())) as device:
        timing = check_timing(device, RealClock(), 0.5, lambda done: None)
    assert timing.lateness.too_late and timing.lateness.missed_fraction > 0.1
    assert timing.lateness.longest_ms > 2.5
    assert 1000 * timing.health.latest_s > timing.lateness.longest_ms - 1.0


@pytest.mark.real_time
def test_a_reading_after_missed_ticks_is_as_late_as_the_first_of_them_says(rigs, settings):
    """Every fiftieth force takes 12 ms: lateness and late ticks tell the same."""
    rig, writes = rigs.HeldForceRig(), itertools.count()
    rig.before_writing = lambda force_n: time.sleep(0.012 if next(writes) % 50 == 49 else 0.0)
    with contextlib.closing(SafeDevice(rig, settings, RealClock(), Ring())) as device:
        timing = check_timing(device, RealClock(), 0.5, lambda done: None)
    assert timing.health.missed_ticks > 20
    assert timing.lateness.longest_ms > 10.5
    assert timing.lateness.missed_fraction > 0.01


@pytest.mark.parametrize(("load", "fine"), [(1.3, True), (0.3, False), (None, False)])
def test_more_late_ticks_are_fine_on_a_computer_that_was_measured_to_be_busy(rigs, settings, monkeypatch, load, fine):
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(rigs.ScriptedRig(), settings, clock)) as device:
        release = device.release

        def late():
            played = release()
            return replace(played, health=replace(played.health, late_ticks=played.health.ticks // 200, missed_ticks=0))

        monkeypatch.setattr(device, "release", late)
        timing = check_timing(device, clock, 1.0, lambda done: None, load)
    (found,) = (finding for finding in timing.findings if finding.name == "Late ticks")
    assert found.fine is fine


def test_doctor_judges_late_ticks_by_the_load_that_it_shows(rigs, settings, monkeypatch):
    asked = []

    def timing(device, clock, seconds, on_progress, load):
        asked.append(load)
        raise DeviceError("Enough", "It was asked.", "Go on.")

    monkeypatch.setattr(examine_setup, "get_load_per_processor", lambda: 1.3)
    monkeypatch.setattr(examine_setup, "check_timing", timing)
    clock = VirtualClock()
    with contextlib.closing(SafeDevice(rigs.ScriptedRig(), settings, clock)) as device, pytest.raises(DeviceError):
        examine_setup._measure_timing(device, clock, 0.1, lambda done: None)
    assert asked == [1.3]


@pytest.mark.real_time
def test_an_interruption_while_a_real_loop_is_timed_lets_go_at_once(rigs, settings):
    def interrupt(done: float) -> None:
        raise KeyboardInterrupt

    started_s = time.monotonic()
    with contextlib.closing(SafeDevice(rigs.HeldForceRig(), settings, RealClock())) as device:
        with pytest.raises(KeyboardInterrupt):
            check_timing(device, RealClock(), 60.0, interrupt)
        assert time.monotonic() - started_s < 30.0
        assert device.health().peak_command_n == 0.0


def test_before_a_sitting_on_a_real_device_it_is_said_whether_its_loop_may_go_first(monkeypatch):
    refused = DeviceFinding("Priority", "other programs may delay the loop", fine=False, advice="ask", warning=True)
    monkeypatch.setattr("study.workflows.checks.check_timing.check_loop_priority", lambda: refused)
    assert refused in check_computer(VirtualClock(), 1000.0, False, 0.1)
    assert refused not in check_computer(VirtualClock(), 1000.0, True, 0.1)
