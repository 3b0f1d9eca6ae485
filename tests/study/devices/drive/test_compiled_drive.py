"""Ticks in compiled code are those of the interpreter, to the last bit: in stepped time over the vendor's stub, and in
real time over a clock of the test."""

import contextlib
import ctypes
import threading
from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from study.devices.clock import VirtualClock
from study.devices.device import Fault
from study.devices.drive.compiled_drive import DUE_S, SENSE_SIGNATURE, SPIN_S, STARTED_S, THREAD_NEEDED, WRITE_SIGNATURE
from study.devices.drive.realtime_drive import RealtimeDrive
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.governor import cells
from study.devices.governor.governor import Governor
from study.devices.native import CLOCK, SLEEP, SYSTEM_SIZE, SharedLock, call_int, collect_system_calls, find_address
from study.devices.rig import READING_SIZE, CompiledIo
from study.devices.safe import SafeDevice
from study.errors import DeviceError

FAULTS = {
    "frozen": 1, "jump_m": 0.06, "no_number": 1, "unplugged": 1, "read_fails": 2, "write_fails": 2, "stale_every": 1,
    "scaled_from_n": 0.5, "off_by": 3, "stale_every ": 3, "jump_every": 7, "frozen_axis": 2, "noise": 0.3,
}  # fmt: skip


class Interpreted:
    """A rig without its compiled functions."""

    def __init__(self, rig) -> None:
        self.sense, self.write, self.buttons, self.close = rig.sense, rig.write, rig.buttons, rig.close
        self.info, self.drops_force_after_s = rig.info, rig.drops_force_after_s


def told(device, stub) -> tuple:
    """All that a tick may change, as bytes."""
    governor = device._governor
    arrays = (governor.state, governor.buffer, governor.force, governor.ring)
    return (*(each.tobytes() for each in arrays), stub.get("writes"), stub.get("peak_n"), stub.get("reads"))


def lived_through(rigs, stub, seed: int, interpreted: bool) -> list:
    """A device with random faults at random times: what it told after each block of ticks, and its caller heard."""
    random, clock, heard = np.random.default_rng(seed), VirtualClock(), []
    rig = stub.rig()
    assert rig.compiled_io is not None
    with contextlib.closing(SafeDevice(Interpreted(rig) if interpreted else rig, rigs.SETTINGS, clock)) as device:
        assert device._runner._compiled is None if interpreted else device._runner._compiled is not None
        device._governor.ring = np.zeros((600, cells.RING_WIDTH))
        for _ in range(2):
            try:
                device.hold(rigs.sine(float(random.uniform(0.5, 3.0)), periods_per_s=int(random.choice([5, 20, 25]))))
                for _ in range(int(random.integers(2, 7))):
                    clock.sleep(float(random.uniform(0.01, 0.2)))
                    heard += told(device, stub), device.look(), device.fault()
                    if random.random() < 0.4:
                        switch = str(random.choice(list(FAULTS)))
                        stub.set(switch.strip(), FAULTS[switch])
                    if random.random() < 0.3:
                        stub.move(*random.uniform(-0.03, 0.03, 3))
                    if random.random() < 0.7:
                        device.keep_alive()
                heard += told(device, stub), device.release().health
            except DeviceError as error:
                heard += [str(error), error.happened]
    return [repr(each) for each in heard]


@pytest.mark.parametrize("seed", range(30))
def test_over_the_stub_of_the_library_both_ways_are_the_same_to_the_last_bit(
    vendor, compiled_stub, tmp_path, rigs, seed
):
    lives = []
    for way in ("compiled", "interpreted"):
        with vendor.copied(compiled_stub, tmp_path / way) as stub:
            stub.set("wall_time", 0)
            lives.append(lived_through(rigs, stub, seed, way == "interpreted"))
    assert lives[0] == lives[1]
    assert len(set(lives[0])) > 4  # it moved


class ScriptedTime:
    """A clock for both ways: a wait ends late, and the work of a tick takes as long as the script says."""

    virtual = False

    def __init__(self, late_s: list[float], work_s: list[float]) -> None:
        self.time_s, self._late_s, self._work_s = 100.0, iter(late_s), iter(work_s)
        self.at_end = lambda: None
        address = ctypes.POINTER(ctypes.c_int64)
        self.now = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, address)(self._now)
        wait = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.c_int, address, ctypes.c_int64)
        self.wait = wait(lambda clock, flags, until, rest: self._wait_until(until[0] + 1e-9 * until[1]))
        self.work = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int)(self._work)

    def now_s(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        self._wait_until(self.time_s + seconds)

    def _now(self, _clock: int, into) -> int:
        into[0], into[1] = divmod(round(self.time_s * 1e9), 1_000_000_000)
        return 0

    def _wait_until(self, until_s: float) -> int:
        self.time_s = round(max(self.time_s, until_s + SPIN_S + 1e-6) + next(self._late_s, 0.0), 7)
        return 0

    def _work(self, _: int) -> int:
        took_s = next(self._work_s, None)
        if took_s is None:
            self.at_end()
        self.time_s = round(self.time_s + (took_s or 0.0), 7)
        return 0


FAILS_AT, READINGS, WORK = 0, 1, SYSTEM_SIZE


@njit(SENSE_SIGNATURE, nogil=True)
def tremble(calls, own, samples, reading):
    own[READINGS] += 1.0
    for i in range(READING_SIZE):
        reading[i] = 0.0
    for i in range(3):
        reading[i] = 1e-3 * np.sin(0.05 * own[READINGS])
    return 7 if own[READINGS] == own[FAILS_AT] else 0


@njit(WRITE_SIGNATURE, nogil=True)
def work(calls, own, force):
    call_int(calls[WORK], (np.int32(0),))
    return 0


class ScriptedRig:
    """The same from Python and compiled."""

    drops_force_after_s = 0.1

    def __init__(self, rigs, clock: ScriptedTime, fails_at: int) -> None:
        self.info = replace(rigs.INFO, simulated=False)
        self._calls = np.append(collect_system_calls(SharedLock()), find_address(clock.work))
        self._calls[CLOCK], self._calls[SLEEP] = find_address(clock.now), find_address(clock.wait)
        self._own, self._samples = np.array([float(fails_at), 0.0]), np.zeros((1, 1))
        self.compiled_io = CompiledIo(tremble, work, self._calls, self._own, self._samples, lambda code: OSError(code))

    def sense(self):
        reading = np.empty(READING_SIZE)
        if code := tremble(self._calls, self._own, self._samples, reading):
            raise self.compiled_io.error(code)
        return reading

    def write(self, force_n) -> None:
        work(self._calls, self._own, force_n)

    def buttons(self):
        return frozenset()

    def close(self) -> None:
        pass


@pytest.fixture
def played(rigs, monkeypatch):
    """What a drive told whose thread does nothing: the test takes its place."""
    ended = threading.Event()
    monkeypatch.setattr(RealtimeDrive, "_run_ticks", lambda self: ended.wait())

    def play(clock: ScriptedTime, fails_at: int, compiled: bool) -> tuple:
        rig = ScriptedRig(rigs, clock, fails_at)
        governor = Governor(rig.info, rigs.SETTINGS, np.zeros((3000, cells.RING_WIDTH)))
        runner = SteppedRunner(rig if compiled else Interpreted(rig), governor, False, clock.now_s, monotonic=True)
        drive = RealtimeDrive(runner, governor, clock, rigs.RATE_HZ, rigs.LIMITS.watchdog_s)
        assert drive.start(lambda: governor.begin_hold(rigs.sine(2.0, fade_s=0.01)))
        governor.settings[cells.WATCHDOG_TICKS] = governor.state[cells.LONGEST_HOLD] = np.inf
        clock.at_end = governor.request_stop
        drive._loop_state[THREAD_NEEDED] = 0.0
        calls = 0
        while governor.moving:
            calls += 1
            if not drive._attend_compiled():
                drive._wait_for_tick()
                drive.run_due_ticks(clock.now_s())
        assert (calls < 3) == compiled  # all of it in a call, or a tick each
        arrays = (governor.state, governor.buffer, governor.ring, governor.force, drive._loop_state[STARTED_S:DUE_S])
        return *(each.tobytes() for each in arrays), governor.collect_health(), repr(runner.failure), clock.time_s

    yield play
    ended.set()


def script(random, ticks: int) -> tuple[list[float], list[float]]:
    """Mostly in time; sometimes late by up to 20 ms, sometimes with work that lasts as long."""
    late = np.where(random.random(ticks) < 0.03, random.uniform(0, 0.02, ticks), random.uniform(0, 2e-4, ticks))
    work = np.where(random.random(ticks) < 0.03, random.uniform(0, 0.02, ticks), random.uniform(1e-5, 6e-4, ticks))
    return np.round(late, 7).tolist(), np.round(work, 7).tolist()


@pytest.mark.parametrize("seed", range(12))
def test_late_waits_and_long_work_are_counted_and_played_the_same_both_ways(played, seed):
    lives = []
    for compiled in (True, False):
        late_s, work_s = script(np.random.default_rng(seed), 800)
        if seed == 11:
            late_s[400] = 0.15  # longer than a loop may stand still
        lives.append(played(ScriptedTime(late_s, work_s), 500 if seed == 10 else 0, compiled))
    assert lives[0] == lives[1]
    health = lives[0][5]
    assert health.missed_ticks > 20 and health.late_ticks > 5 and health.latest_s > 0.005
    assert health.fault is {10: Fault.LOST, 11: Fault.STALLED}.get(seed, Fault.STOPPED)


class TimeOfAYear(ScriptedTime):
    """The computer has run for so long that its clock, as a float, has steps of 4 ns; each look at it takes a step."""

    def __init__(self, ticks: int) -> None:
        super().__init__([], [0.0] * ticks)
        self.time_s = 2.5e7 + 0.1234567

    def now_s(self) -> float:
        self.time_s += 2.0**-28
        return self.time_s

    def _now(self, clock: int, into) -> int:
        self.now_s()
        return super()._now(clock, into)

    def _wait_until(self, until_s: float) -> int:
        self.time_s = max(self.time_s, until_s + SPIN_S - 4e-8)
        return 0


def test_a_clock_that_has_run_for_a_year_makes_no_tick_late(played):
    health = played(TimeOfAYear(500), 0, compiled=True)[5]
    assert health.ticks > 500 and (health.late_ticks, health.missed_ticks) == (0, 0)


def test_the_comparison_tells_a_tick_that_is_a_microsecond_later(played):
    """The control: what is compared depends on the times."""
    late_s, work_s = script(np.random.default_rng(1), 300)
    first = played(ScriptedTime(late_s, work_s), 0, True)
    late_s[100] += 1e-6
    assert played(ScriptedTime(late_s, work_s), 0, True) != first
