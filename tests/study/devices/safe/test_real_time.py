"""Real time, and real time with a clock that a test moves."""

import threading
import time

import numpy as np
import pytest

from study.devices.clock import RealClock
from study.devices.device import Fault
from study.devices.drive.realtime_drive import RealtimeDrive
from study.devices.drive.runner import CompiledRunner
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.governor.governor import Governor
from study.devices.safe import SafeDevice
from study.errors import DeviceError


@pytest.mark.real_time
def test_a_caller_that_stalls_loses_the_force_in_real_time(rigs, rig):
    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    device.hold(rigs.sine(3.0, fade_s=0.05))
    time.sleep(0.15)
    assert np.linalg.norm(rigs.written(rig), axis=1).max() > 1.0
    time.sleep(rigs.LIMITS.watchdog_s + rigs.LIMITS.release_s + 0.25)
    assert device.fault() is Fault.STALLED
    assert not rigs.written(rig)[-1].any()
    assert rigs.violations(rigs.written(rig), rigs.LIMITS) == []
    assert device.release().health.fault is Fault.STALLED
    device.close()


@pytest.mark.real_time
def test_a_stepped_rig_is_played_in_real_time_and_stopped_from_another_thread(rigs):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    device.hold(rigs.sine(2.0, fade_s=0.05))
    time.sleep(0.2)
    stopper = threading.Thread(target=device.stop)
    stopper.start()
    stopper.join()
    played = device.release()
    device.close()
    assert played.health.fault is Fault.STOPPED
    assert played.health.ticks > 100
    assert not rigs.written(rig.mass)[-1].any()
    assert rigs.violations(rigs.written(rig.mass), rigs.LIMITS) == []


class ParkedClock:
    """Real time that stands still for the haptic thread, so that a test alone pumps."""

    virtual = False

    def __init__(self) -> None:
        self.open = threading.Event()

    def now_s(self) -> float:
        return float("inf") if self.open.is_set() else 0.0

    def sleep(self, seconds: float) -> None:
        self.open.wait()

    def utc(self) -> str:
        return "2026-01-01T00:00:00+00:00"


@pytest.fixture
def hand_pumped(rigs):
    """The parts of a device in real time: rig, governor, and a drive that this test pumps."""
    drives = []

    def build(rig) -> tuple[Governor, RealtimeDrive]:
        clock = ParkedClock()
        governor = Governor(rig.info, rigs.SETTINGS)
        compiled = hasattr(rig, "state")
        runner = CompiledRunner(rig, governor, 50) if compiled else SteppedRunner(rig, governor, catches_up=False)
        drive = RealtimeDrive(runner, governor, clock, rigs.RATE_HZ, rigs.LIMITS.watchdog_s)
        drives.append((drive, clock))
        return governor, drive

    yield build
    for drive, clock in drives:
        clock.open.set()
        drive.close()


def test_a_process_that_stood_still_too_long_finds_its_force_off(rigs, hand_pumped):
    for rig in (rigs.compiled_rig(), rigs.ScriptedRig()):
        governor, drive = hand_pumped(rig)
        drive.start(lambda governor=governor: governor.begin_hold(rigs.sine(3.0)))
        for k in range(1, 201):
            drive.run_due_ticks(k * 0.001)
        governor.restart_watchdog()
        drive.run_due_ticks(0.2 + rigs.LIMITS.watchdog_s + 0.01)
        assert governor.fault is Fault.STALLED
        assert not rigs.written(rig if hasattr(rig, "state") else rig.mass)[200:].any()


def test_a_simulated_world_catches_up_and_misses_nothing(rigs, rig, hand_pumped):
    governor, drive = hand_pumped(rig)
    drive.start(lambda: governor.begin_hold(rigs.sine(2.0)))
    for now_s in (0.003, 0.0301, 0.2, 0.2504):
        drive.run_due_ticks(now_s)
    assert governor.collect_health().missed_ticks == 0
    assert len(rigs.written(rig)) == 250


def test_a_real_world_misses_late_ticks_and_the_waveform_is_not_stretched(rigs, hand_pumped):
    rig = rigs.ScriptedRig()
    governor, drive = hand_pumped(rig)
    drive.start(lambda: governor.begin_hold(rigs.sine(2.0, fade_s=0.0)))
    for k in (*range(1, 50), *range(60, 101)):
        drive.run_due_ticks(k * 0.001)
    assert governor.collect_health().missed_ticks == 10
    assert len(rigs.written(rig.mass)) == 90
    excitation = governor.copy_rows()[:, 3:6]
    assert len(excitation) == 100
    assert np.allclose(excitation[60:], rigs.sine(2.0).loop.samples[60:100])


@pytest.mark.real_time
def test_an_error_in_the_loop_itself_turns_the_force_off(rigs):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, BrokenClock())
    device.hold(rigs.sine(2.0))
    deadline = time.monotonic() + 2.0
    while device.fault() is Fault.NONE and time.monotonic() < deadline:
        device.keep_alive()
        time.sleep(0.01)
    assert device.fault() is Fault.LOST
    with pytest.raises(DeviceError, match="clock failed"):
        device._require_connected()
    device.close()


class BrokenClock(RealClock):
    """Fails in the haptic thread, once it has played for a while."""

    def now_s(self) -> float:
        if threading.current_thread().name == "haptic loop" and time.monotonic() > self.until_s:
            raise OSError("clock failed")
        return time.monotonic()

    def __init__(self) -> None:
        self.until_s = time.monotonic() + 0.2


def test_a_drive_in_real_time_never_gets_a_runner_that_catches_up(rigs):
    class OtherClock(RealClock):
        virtual = True

    device = SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, OtherClock())
    assert not device._runner.catches_up
    device.close()
