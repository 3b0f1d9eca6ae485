"""Who counts as hanging in real time, and who does not: the drive with a clock that the test moves."""

import contextlib
import threading
import time
from collections.abc import Callable

import pytest

from study.devices.clock import RealClock
from study.devices.device import Fault
from study.devices.drive.realtime_drive import RealtimeDrive
from study.devices.drive.runner import CompiledRunner
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.governor.governor import Governor
from study.devices.governor.plausibility import LATE_S
from study.devices.safe import SafeDevice

pytestmark = pytest.mark.real_time


class MovedClock:
    """The haptic thread sleeps for ever; the test's own sleeps are what the test says."""

    virtual = False

    def __init__(self) -> None:
        self.seconds = 0.0
        self.ended = threading.Event()
        self.while_asleep: Callable[[], None] = lambda: None

    def now_s(self) -> float:
        return self.seconds if not self.ended.is_set() else float("inf")

    def sleep(self, seconds: float) -> None:
        if threading.current_thread() is threading.main_thread():
            self.while_asleep()
        else:
            self.ended.wait()

    def utc(self) -> str:
        return "2026-01-01T00:00:00+00:00"


class Bench:
    def __init__(self, rigs, rig) -> None:
        self.clock = MovedClock()
        self.rig = rig
        self.governor = Governor(rig.info, rigs.SETTINGS)
        compiled = hasattr(rig, "state")
        kind = CompiledRunner(rig, self.governor, 50) if compiled else SteppedRunner(rig, self.governor, False)
        self.runner = kind
        self.drive = RealtimeDrive(kind, self.governor, self.clock, rigs.RATE_HZ, rigs.LIMITS.watchdog_s)

    def hold(self, rigs) -> None:
        assert self.drive.start(lambda: self.governor.begin_hold(rigs.push()))
        for k in range(1, 101):
            self.pump(k * 0.001)

    def pump(self, seconds: float) -> None:
        self.clock.seconds = seconds
        self.governor.restart_watchdog()
        self.drive.run_due_ticks(seconds)


@pytest.fixture(params=["HeldForceRig", "compiled_rig"])
def bench(request, rigs):
    bench = Bench(rigs, getattr(rigs, request.param)())
    yield bench
    bench.clock.ended.set()
    bench.drive.close()
    bench.runner.disconnect()


def real(bench) -> bool:
    return not bench.runner.catches_up


def test_a_slightly_late_loop_is_not_stopped(bench, rigs):
    bench.hold(rigs)
    bench.clock.seconds += 0.9 * LATE_S
    bench.drive.check()
    assert bench.governor.fault is Fault.NONE


def test_a_hanging_loop_of_a_real_device_is_given_up(bench, rigs):
    bench.hold(rigs)
    bench.clock.seconds += 1.1 * LATE_S
    bench.drive.check()
    assert bench.governor.fault is (Fault.LOST if real(bench) else Fault.NONE)
    assert (bench.runner.failure is not None) == real(bench)


def test_a_suspended_process_is_not_reported_as_a_lost_device(bench, rigs):
    bench.hold(rigs)
    bench.clock.seconds += 0.5
    bench.clock.while_asleep = lambda: bench.pump(bench.clock.seconds)
    bench.drive.check()
    bench.drive.run_due_ticks(bench.clock.seconds)
    assert bench.runner.failure is None
    assert bench.governor.fault is Fault.STALLED


def test_a_gap_in_which_a_real_device_held_its_force_alone_ends_the_stimulus(bench, rigs):
    bench.hold(rigs)
    bench.pump(bench.clock.seconds + 1.5 * LATE_S)
    assert bench.governor.fault is (Fault.STALLED if real(bench) else Fault.NONE)
    if real(bench):
        assert not bench.rig.last_n.any()


def test_a_long_preparation_does_not_make_the_loop_late(bench, rigs):
    bench.clock.seconds = 5.0

    def begin() -> None:
        bench.governor.begin_hold(rigs.push())
        bench.drive.check()

    assert bench.drive.start(begin)
    assert bench.runner.failure is None


def test_while_nothing_moves_no_loop_is_late(bench):
    bench.clock.seconds = 1000.0
    bench.drive.check()
    assert bench.runner.failure is None


def test_a_loop_that_hangs_with_its_lock_is_given_up_at_the_next_start(bench, rigs):
    with bench.drive._lock:
        assert not bench.drive.start(lambda: bench.governor.begin_hold(rigs.push()))
    assert "its loop hangs" in str(bench.runner.failure)
    assert not bench.governor.moving


def test_the_loop_ends_with_a_zero_force(rigs):
    rig = rigs.HeldForceRig()
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, RealClock())) as device:
        device.hold(rigs.push())
        time.sleep(0.15)
        assert rig.last_n.any()
        device._drive.close()
        assert not rig.last_n.any()


only_real = pytest.mark.parametrize("bench", ["HeldForceRig"], indirect=True)


def slow_by(bench, seconds: float) -> None:
    """Its next reading takes so long."""

    def wait() -> None:
        bench.clock.seconds += seconds
        bench.rig.before_sensing = lambda: None

    bench.rig.before_sensing = wait


@only_real
@pytest.mark.parametrize(("takes_s", "late"), [(0.0009, 0), (0.0011, 1)])
def test_a_tick_whose_work_ends_after_the_next_was_due_is_late(bench, rigs, takes_s, late):
    bench.hold(rigs)
    slow_by(bench, takes_s)
    bench.pump(0.101)
    health = bench.governor.collect_health()
    assert (health.late_ticks, health.missed_ticks) == (late, 0)
    assert health.latest_s == pytest.approx(takes_s)


@only_real
def test_missed_ticks_report_the_delay_of_the_first(bench, rigs):
    bench.hold(rigs)
    bench.pump(0.1052)
    health = bench.governor.collect_health()
    assert (health.late_ticks, health.missed_ticks) == (0, 4)
    assert health.latest_s == pytest.approx(0.0042)


@only_real
def test_counters_restart_with_each_stimulus(bench, rigs):
    bench.hold(rigs)
    slow_by(bench, 0.002)
    bench.pump(0.101)
    assert bench.governor.collect_health().late_ticks == 1
    bench.governor.begin_hold(rigs.push())
    assert (bench.governor.collect_health().late_ticks, bench.governor.collect_health().latest_s) == (0, 0.0)
