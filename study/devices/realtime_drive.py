"""Ticks in real time: a thread runs them as they become due.

A stimulus is a function of time. Ticks that come late are caught up where the world waits (a simulated rig); where
it does not, they are counted as missed and the waveform goes on where the time is, never stretched.
"""

import threading
from collections.abc import Callable

from study.devices.clock import Clock
from study.devices.device import Fault
from study.devices.governor import Governor
from study.devices.runner import Runner
from study.devices.virtual_drive import ticks_by

LEISURELY_S = 0.003
"""Between two pumps of a simulated rig: nobody feels it, so it need not wake for each tick."""

JOIN_S = 2.0
"""A driver that hangs must not hang the program as well."""

SPIN_S = 0.00015
"""Sleep until so long before a real tick, then wait awake: a sleep ends late by more than that on its own."""


class RealtimeDrive:
    def __init__(self, runner: Runner, governor: Governor, clock: Clock, rate_hz: float, longest_gap_s: float) -> None:
        self._runner = runner
        self._governor = governor
        self._clock = clock
        self._rate_hz = rate_hz
        self._longest_gap_s = longest_gap_s
        self._started_s = self._last_s = 0.0
        self._run = 0
        self._lock = threading.Lock()
        self._awake = threading.Event()
        self._closing = False
        self._thread = threading.Thread(target=self._attend, name="haptic loop", daemon=True)
        self._thread.start()

    def start(self, begin: Callable[[], None]) -> None:
        """`begin` readies the governor, undisturbed by the thread; from now on its ticks fall due."""
        with self._lock:
            begin()
            self._started_s = self._last_s = self._clock.now_s()
            self._run = 0
            self._awake.set()

    def close(self) -> None:
        self._closing = True
        self._awake.set()
        self._thread.join(JOIN_S)

    def pump(self, now_s: float) -> None:
        """Run what is due. After a gap nobody watched (a stopped process, a suspended machine) let go at once."""
        with self._lock:
            if not self._governor.moving:
                self._awake.clear()
                if self._closing:
                    self._awake.set()
                return
            gap_s, self._last_s = now_s - self._last_s, now_s
            if gap_s > self._longest_gap_s:
                self._governor.abandon(Fault.STALLED)
                self._runner.run(1)
                return
            due = ticks_by(now_s - self._started_s, self._rate_hz)
            late = due - self._run - 1
            if late > 0 and not self._runner.catches_up:
                self._governor.miss(late)
                self._run += late
            self._runner.run(due - self._run)
            self._run = due

    def _attend(self) -> None:
        while True:
            self._awake.wait()
            if self._closing:
                return
            try:
                self._wait_for_tick()
                self.pump(self._clock.now_s())
            except Exception as error:  # noqa: BLE001 - a dead loop must not leave a force behind
                self._runner.give_up(error)

    def _wait_for_tick(self) -> None:
        if self._runner.catches_up:
            self._clock.sleep(LEISURELY_S)
            return
        due_s = self._started_s + (self._run + 1) / self._rate_hz
        self._clock.sleep(due_s - SPIN_S - self._clock.now_s())
        while self._clock.now_s() < due_s:
            pass
