"""Control ticks in real time: a thread runs them as they become due. Used by `study.devices.safe.SafeDevice`.

Theory of operation. Tick k is due at t_0 + k / rate. In each tick the loop senses (position, acceleration), computes
the force within its limits (`governor.govern`) and writes it, in this order: no force is written that was not computed
from this tick's reading. The due time is counted from the start, not from the last tick, so that delays do not add up.
The loop sleeps until `SPIN_S` before the due time, then polls the clock, because a sleep alone ends late.

A stimulus is a function of time. Late ticks of a simulated rig, whose time waits, are run afterwards; those of a real
device are counted as missed, and the waveform continues at the present time: it is never stretched.

The thread monitors its callers (the governor's watchdog), and they monitor the thread (`check`).

Ticks of a rig with compiled `sense` and `write` run in compiled code, if that can read the clock, while the thread has
no other work, so that the interpreter lock of another thread delays none; `run_due_ticks` runs ticks from Python.

Readings while nothing moves are taken by the same thread, so that only a single thread drives a rig and a stimulus that
begins meanwhile cannot collide with the reading. A driver that hangs delays a caller by at most `READING_TIMEOUT_S`.
"""

import contextlib
import math
import threading
from collections.abc import Callable

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.clock import Clock
from study.devices.device import Fault
from study.devices.drive.compiled_drive import (
    DUE_S,
    GAP,
    LAST_S,
    LAST_TICK,
    LONGEST_GAP_S,
    LOOP_STATE_SIZE,
    RATE_HZ,
    SPIN_S,
    STARTED_S,
    THREAD_NEEDED,
)
from study.devices.drive.real_time_class import request_real_time_class
from study.devices.drive.runner import Runner
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.drive.virtual_drive import count_due_ticks
from study.devices.governor.governor import Governor
from study.devices.governor.plausibility import LATE_S

READING_TIMEOUT_S = 0.1
"""Longest wait of a caller for a reading (s): a reading takes below 1 ms; a busy computer is late by some 10 ms."""


class _Request:
    """A request for a reading: deadline (s, by the drive's clock), and whether the reading was taken."""

    def __init__(self, deadline_s: float) -> None:
        self.deadline_s = deadline_s
        self.taken = threading.Event()


class ReadingRequests:
    """Requests for a reading while nothing moves, one at a time: callers that request one before it is taken share
    it."""

    def __init__(self, clock: Clock, wake: Callable[[], None], timeout_s: float = READING_TIMEOUT_S) -> None:
        """clock: of the drive; wake: makes the loop's thread check `is_pending`; timeout_s: a caller's longest wait."""
        self._clock = clock
        self._wake = wake
        self._timeout_s = timeout_s
        self._request_lock = threading.Lock()
        self._request: _Request | None = None

    def request_reading(self) -> bool:
        """Wait for a reading, at most for the timeout. Returns False where none was taken in time; at once for a
        request that is still pending after its deadline: a driver that hangs delays only the first caller."""
        with self._request_lock:
            request = self._request
            if request is None or request.taken.is_set():
                self._request = request = _Request(self._clock.now_s() + self._timeout_s)
        self._wake()
        return request.taken.wait(min(self._timeout_s, max(0.0, request.deadline_s - self._clock.now_s())))

    @property
    def is_pending(self) -> bool:
        """Whether a request waits for a reading."""
        return self._request is not None and not self._request.taken.is_set()

    def mark_taken(self) -> None:
        """Note that a reading was taken; called by the loop's thread after each."""
        if self._request is not None:
            self._request.taken.set()


SIMULATED_INTERVAL_S = 0.003
"""Interval (s) between two calls of `run_due_ticks` for a simulated rig, whose ticks may be late. Chosen."""

GRACE_S = 0.02
"""Time (s) allowed to a late loop to continue, because it is also late after a suspension of the process. Chosen."""

STOP_WAIT_S = 0.005
"""Longest wait of an emergency stop for the loop to write the zero force (s). Chosen: five ticks at 1 kHz."""

THREAD_TIMEOUT_S = 0.5
"""Longest wait for the loop's thread (s), so that a driver that hangs does not block the program. Chosen."""

LOCK_RETRY_S = 0.01
"""Interval (s) at which the begin of a stimulus repeats its request for the lock, which compiled ticks otherwise
keep."""


class RealtimeDrive:
    """Drive of a device in real time. rate_hz: rate of the ticks. longest_gap_s: longest interruption (s) after which
    the loop resumes; for a real rig at most `LATE_S`. in_realtime_class: run the loop in the real-time scheduling class
    where the system allows it, for a real device."""

    def __init__(
        self,
        runner: Runner,
        governor: Governor,
        clock: Clock,
        rate_hz: float,
        longest_gap_s: float,
        in_realtime_class: bool = False,
    ) -> None:
        self._in_realtime_class = in_realtime_class
        self._runner = runner
        self._governor = governor
        self._clock = clock
        self._compiled_runner = runner if isinstance(runner, SteppedRunner) and runner.can_attend else None
        self._loop_state: FloatArray = (
            runner.loop_state if isinstance(runner, SteppedRunner) else np.zeros(LOOP_STATE_SIZE)
        )
        self._loop_state[RATE_HZ] = rate_hz
        self._loop_state[LONGEST_GAP_S] = longest_gap_s if runner.catches_up else min(longest_gap_s, LATE_S)
        self._lock = threading.Lock()
        self._wake_event = threading.Event()
        self._reading_requests = ReadingRequests(clock, wake=self._wake)
        self._closing = False
        self._thread = threading.Thread(target=self._run_ticks, name="haptic loop", daemon=True)
        self._thread.start()

    def start(self, begin_stimulus: Callable[[], None]) -> bool:
        """Call `begin_stimulus`, which prepares the governor, while no tick runs; from then on ticks fall due. Returns
        False, without calling it, where a stimulus is in progress, or the drive has failed or is closing. A loop whose
        thread ended or keeps the lock counts as failed."""
        if not (self._thread.is_alive() and self._take_lock()):
            if not self._closing:  # a closing drive's thread may have ended, which is no failure
                self._runner.give_up(TimeoutError("its loop hangs"))
            return False
        try:
            if self._runner.moving or self._closing or self._runner.failure is not None:
                return False
            self._loop_state[LAST_S] = math.inf  # the time that `begin_stimulus` takes is no late tick
            begin_stimulus()
            self._loop_state[STARTED_S] = self._loop_state[LAST_S] = now_s = self._clock.now_s()
            self._governor.set_begin_time(now_s)
            self._loop_state[LAST_TICK] = 0.0
            self._wake_event.set()
            return True
        finally:
            self._lock.release()

    def _take_lock(self) -> bool:
        """Take the lock from the loop's thread, within `THREAD_TIMEOUT_S`. Returns whether it was taken."""
        for _ in range(round(THREAD_TIMEOUT_S / LOCK_RETRY_S)):
            self._loop_state[THREAD_NEEDED] = 1.0
            if self._lock.acquire(timeout=LOCK_RETRY_S):
                # Reset where no reading is requested: the first tick is compiled too.
                self._loop_state[THREAD_NEEDED] = float(self._reading_requests.is_pending)
                return True
        return False

    def check(self) -> None:
        """Stop and abandon a loop that hangs while a stimulus is played: its thread ended or, for a real rig, it runs
        no tick for `LATE_S`, both also after `GRACE_S`. Fast enough for every call of a device."""
        if self._runner.moving and self._is_late():
            self._clock.sleep(GRACE_S)
            if self._is_late():
                self._runner.give_up(TimeoutError("its loop gave no sign of life"))

    def refresh(self) -> bool:
        """Update the last reading. Returns whether it is current. Waits for the loop's thread while nothing moves."""
        if self._runner.moving:
            return True
        return self._thread.is_alive() and not self._closing and self._reading_requests.request_reading()

    def stop(self) -> None:
        """After a stop was requested: wait until the loop has executed it, else stop without the loop."""
        deadline_s = self._clock.now_s() + STOP_WAIT_S
        while self._runner.moving and self._clock.now_s() < deadline_s:
            self._clock.sleep(STOP_WAIT_S / 10)
        if self._runner.moving:
            self._runner.cut()

    def close(self) -> None:
        """End the loop's thread. Waits for at most `THREAD_TIMEOUT_S`; a thread that hangs in a driver is abandoned."""
        self._closing = True
        self._wake()
        self._thread.join(THREAD_TIMEOUT_S)

    def _wake(self) -> None:
        """Make the loop's thread leave compiled code or its wait, and check what is to be done."""
        self._loop_state[THREAD_NEEDED] = 1.0
        self._wake_event.set()

    def run_due_ticks(self, now_s: float) -> None:
        """Run the ticks that are due at now_s; while nothing moves, take a requested reading instead. After a gap
        without control longer than LONGEST_GAP_S (a suspended process; not a suspended computer, whose clock stands
        still), drop the force at once."""
        with self._lock:
            if not self._governor.moving:
                self._wake_event.clear()
                if self._closing:
                    self._wake_event.set()
                elif self._reading_requests.is_pending:
                    self._runner.read_sensors()
                    self._reading_requests.mark_taken()
                return
            loop_state, completed_ticks = self._loop_state, int(self._loop_state[LAST_TICK])
            gap_s, loop_state[LAST_S] = now_s - loop_state[LAST_S], now_s
            if gap_s > loop_state[LONGEST_GAP_S]:
                self._runner.drop(Fault.STALLED)
                return
            turn_due_s = self._compute_due_time_s(completed_ticks + 1)
            due_ticks = count_due_ticks(now_s - loop_state[STARTED_S], loop_state[RATE_HZ])
            late_ticks = due_ticks - completed_ticks - 1
            if late_ticks > 0 and not self._runner.catches_up:
                self._governor.record_missed_ticks(late_ticks)
                completed_ticks += late_ticks
            self._runner.run(due_ticks - completed_ticks)
            loop_state[LAST_TICK] = due_ticks
            if not self._runner.catches_up:
                self._count_lateness(due_ticks, turn_due_s)
            if self._reading_requests.is_pending:  # requested directly before this stimulus began
                self._reading_requests.mark_taken()

    def _compute_due_time_s(self, tick: int) -> float:
        """Compute the due time of a tick, by the drive's clock (s)."""
        return float(self._loop_state[STARTED_S] + tick / self._loop_state[RATE_HZ])

    def _count_lateness(self, tick: int, turn_due_s: float) -> None:
        """Record whether a tick ended after the next was due, and the time since the first tick of its turn was due."""
        done_s = self._clock.now_s()
        self._governor.count_lateness(done_s > self._compute_due_time_s(tick + 1), done_s - turn_due_s)

    def _is_late(self) -> bool:
        """Whether the loop's thread has ended or, for a real rig, has run no tick for `LATE_S`."""
        if not self._thread.is_alive():
            return True
        return not self._runner.catches_up and bool(self._clock.now_s() - self._loop_state[LAST_S] > LATE_S)

    def _run_ticks(self) -> None:
        """Main function of the thread."""
        with request_real_time_class() if self._in_realtime_class else contextlib.nullcontext():
            self._attend_until_closed()

    def _attend_until_closed(self) -> None:
        """Loop of the thread: run ticks during a stimulus, else wait for work; at the end, switch the force off."""
        while not self._closing:
            try:
                self._wake_event.wait()
                if self._governor.moving:
                    if self._attend_compiled():
                        continue
                    self._wait_for_tick()
                self.run_due_ticks(self._clock.now_s())
            except BaseException as error:  # noqa: BLE001 - a dead loop must not leave a force behind
                self._runner.give_up(error)
                return
        if self._runner.moving:
            self._governor.request_stop()
            self._runner.run(1)

    def _attend_compiled(self) -> bool:
        """Run ticks in compiled code. Returns False where the rig has none or the thread is needed: `run_due_ticks`
        then runs a tick from Python, before which other threads can take the lock."""
        thread_needed, self._loop_state[THREAD_NEEDED] = self._loop_state[THREAD_NEEDED] != 0.0, 0.0
        if self._compiled_runner is None or thread_needed:
            return False
        with self._lock:
            return_code = self._compiled_runner.attend()
            if return_code == GAP:
                self._runner.drop(Fault.STALLED)
            elif return_code > 0:  # the zero force was written in `attend`
                self._count_lateness(int(self._loop_state[LAST_TICK]), float(self._loop_state[DUE_S]))
        return True

    def _wait_for_tick(self) -> None:
        """Wait until the next tick is due; for a simulated rig for `SIMULATED_INTERVAL_S`."""
        if self._runner.catches_up:
            self._clock.sleep(SIMULATED_INTERVAL_S)
            return
        due_s = self._compute_due_time_s(int(self._loop_state[LAST_TICK]) + 1)
        self._clock.sleep(due_s - SPIN_S - self._clock.now_s())
        while self._clock.now_s() < due_s:
            pass
