"""Runner of a device that is driven tick by tick (`Rig`), with timeouts for a driver that hangs or fails. Made by
`study.devices.safe`; called by the drives (`realtime_drive`, `virtual_drive`).

Ticks of rigs with compiled input and output run in compiled code (`compiled_drive`) where it can read the clock, others
from Python, with equal results.

A call into a driver cannot be interrupted. A caller that stops waiting for it therefore marks the rig as gone
(RIG_GONE) and lets a separate thread write zero force. When the call of the loop returns later, the loop writes zero
once more, so that a late write leaves no force on the device.
"""

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.device import Fault
from study.devices.drive.compiled_drive import DECIDING, FINISHED, LOOP_STATE_SIZE, RIG_GONE, STAMPS, WRITING
from study.devices.drive.compiled_ticks import CompiledTicks, get_compiled_io
from study.devices.drive.last_reading import LastReading
from study.devices.governor import cells, govern
from study.devices.governor.governor import Governor
from study.devices.rig import READING_SIZE, Rig


class StandbyThread:
    """A thread that runs an action on request. It is started in advance, because no thread can be started while the
    interpreter shuts down."""

    def __init__(self, action: Callable[[], bool | None], name: str) -> None:
        self._action = action
        self._requests: SimpleQueue[SimpleQueue[bool] | None] = SimpleQueue()
        threading.Thread(target=self._run_thread, name=name, daemon=True).start()

    def run(self, timeout_s: float) -> bool:
        """Run the action. Returns whether it ended within timeout_s (s), without an exception and with another result
        than False. The action continues after the timeout, and if the caller is interrupted."""
        result_queue: SimpleQueue[bool] = SimpleQueue()
        self._requests.put(result_queue)
        try:
            return result_queue.get(timeout=timeout_s)
        except Empty:
            return False

    def end(self) -> None:
        """End the thread after the queued requests."""
        self._requests.put(None)

    def _run_thread(self) -> None:
        """Run the action for each request, until `end`; the function of the thread."""
        while (result_queue := self._requests.get()) is not None:
            try:
                result_queue.put(self._action() is not False)
            except BaseException:  # noqa: BLE001 - reported to the caller; the thread must survive for the next request
                result_queue.put(False)


ZERO_TIMEOUT_S = 0.1
"""Longest wait for a zero force to be written (s). Chosen far above the duration of a normal write."""

DEVICE_CLOSE_TIMEOUT_S = 1.0
"""Longest wait for the driver to close its device (s). Chosen: ends an orderly close soon if the driver hangs."""


class SteppedRunner:
    """Implements `drive.runner.Runner` for a `Rig`. loop_state: cells of the loop (`compiled_drive`). now_s: clock for
    the time stamps of readings, in real time; without it, readings are a tick apart. monotonic: whether that is the
    system's monotonic clock, which compiled code can read. catches_up: as in `Runner`."""

    def __init__(
        self,
        rig: Rig,
        governor: Governor,
        catches_up: bool,
        now_s: Callable[[], float] | None = None,
        monotonic: bool = False,
    ) -> None:
        self._rig = rig
        self._governor = governor
        self._now_s = now_s
        self.catches_up = catches_up
        self.failure: BaseException | None = None
        self.force_off = self.disconnected = True
        self._last_reading: LastReading | None = None
        self.loop_state: FloatArray = np.zeros(LOOP_STATE_SIZE)
        compiled_io = get_compiled_io(rig) if now_s is None or monotonic else None
        self._compiled = CompiledTicks(compiled_io, governor, self.loop_state) if compiled_io is not None else None
        self.loop_state[STAMPS] = now_s is not None
        self._close_requested = self._disconnect_finished = False
        self._drops_force_after_s, self._decided_s = rig.drops_force_after_s, -math.inf
        """As the rig reports it, and time (s) at which the last force of ticks from Python was decided."""
        self._zero_writer = StandbyThread(lambda: rig.write(np.zeros(3)), "force off")
        self._device_closer = StandbyThread(rig.close, "disconnect")

    @property
    def moving(self) -> bool:
        """Whether a force acts or is about to act: also between its decision and the end of its write."""
        return self._governor.moving or bool(self.loop_state[DECIDING])

    @property
    def last_reading(self) -> LastReading | None:
        """The newest reading, also of a compiled call in progress; None when the rig is gone."""
        if self._is_rig_gone:
            return None
        reading = self._compiled.get_running_reading() if self._compiled is not None else None
        return self._last_reading if reading is None else LastReading(reading, self._rig.buttons())

    @property
    def can_attend(self) -> bool:
        """Whether `attend` may be called: ticks are compiled, and compiled code can read the clock."""
        return self._compiled is not None and self._compiled.can_attend

    def prepare(self) -> None:
        """Nothing to do for a real device."""

    @property
    def _is_rig_gone(self) -> bool:
        """Whether the rig can no longer be used."""
        return bool(self.loop_state[RIG_GONE])

    def read_sensors(self) -> None:
        """Read the sensors once while nothing moves. Never raises for a driver that fails."""
        if self._is_rig_gone:
            return
        try:
            self._last_reading = LastReading(self._take_reading(), self._rig.buttons())
        except Exception:  # noqa: BLE001 - no reading; the next tick reports the error
            self._last_reading = None

    def run(self, ticks: int) -> None:
        """Run at most this many ticks, in compiled code where that is possible (see the module), else from Python;
        fewer if the stimulus ends within them. Never raises for a failing rig."""
        if self._is_rig_gone:
            self._governor.abandon(Fault.LOST)
            return
        with self._handle_failures():
            if self._compiled is not None:
                self._finish_compiled_ticks(self._compiled.run(ticks))
                return
            for _ in range(ticks):
                if self._run_tick() or self._is_rig_gone:
                    break

    def attend(self) -> int:
        """Run ticks in real time by `compiled_drive.attend`, and return its code; FINISHED where the rig was gone
        before. To be called only where `can_attend`. Never raises for a failing rig, which `failure` reports."""
        assert self._compiled is not None
        code = FINISHED
        if self._is_rig_gone:
            self._governor.abandon(Fault.LOST)
            return code
        with self._handle_failures():
            code = self._compiled.attend()
            self._finish_compiled_ticks(code)
        return code

    @contextlib.contextmanager
    def _handle_failures(self) -> Iterator[None]:
        """Context for ticks: if they fail or are interrupted, switch the force off; if the rig is gone, write zero
        again. Exceptions of the driver end here; others, such as KeyboardInterrupt, are raised again."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - any error of a driver: force off; the next call reports it
            self.give_up(error)
        except BaseException:  # Ctrl-C in the middle of a tick
            self._stop_with_zero_force(Fault.STALLED)
            raise
        finally:
            if self._is_rig_gone:
                self._repeat_zero_force()

    def _finish_compiled_ticks(self, code: int) -> None:
        """Store the last reading of compiled ticks for `last_reading`; raise the rig's error for a code above zero."""
        assert self._compiled is not None
        if (reading := self._compiled.get_last_reading()) is not None:
            self._last_reading = LastReading(reading, self._rig.buttons())
        if code > 0:
            raise self._compiled.error(code)

    def give_up(self, failure: BaseException) -> None:
        """Force off permanently, because of this failure; the first failure is kept."""
        self.failure = self.failure or failure
        self.loop_state[RIG_GONE] = 1.0
        self._stop_with_zero_force(Fault.LOST)

    def drop(self, fault: Fault) -> None:
        """Force off at once with this fault; the rig stays usable if it takes the zero force."""
        self._stop_with_zero_force(fault)

    def cut(self) -> None:
        """Emergency stop: a separate thread writes zero force even if a call of the driver hangs; the rig is marked as
        gone."""
        self.loop_state[RIG_GONE] = 1.0
        self._stop_with_zero_force(Fault.STOPPED)

    def disconnect(self) -> None:
        """Write zero force, then call the driver's `close`, each in a separate thread and with a timeout
        (`ZERO_TIMEOUT_S`, `DEVICE_CLOSE_TIMEOUT_S`)."""
        if self._disconnect_finished:
            return
        self.loop_state[RIG_GONE] = 1.0
        try:
            self._stop_with_zero_force(Fault.LOST if self.moving else Fault.NONE)
        finally:
            self._close_requested = True
            self.disconnected = self._device_closer.run(DEVICE_CLOSE_TIMEOUT_S)
        self._disconnect_finished = True
        self._zero_writer.end()
        self._device_closer.end()

    def _run_tick(self) -> bool:
        """Run a tick from Python, in the order of `compiled_drive._run_tick`. A stimulus whose force the hardware has
        dropped since the last tick, which was too long ago, ends. Returns whether the force is off and stays off, or
        the rig is gone."""
        governor = self._governor
        reading = self._take_reading()
        if self._is_rig_gone:
            return True
        if self._now_s is not None:
            governor.state[cells.READING_TIME_S] = now_s = self._now_s()
            pause_s, self._decided_s = now_s - self._decided_s, now_s
            has_force = governor.state[cells.FORCE : cells.FORCE + 3].any()
            if has_force and pause_s > self._drops_force_after_s > 0:  # the hardware has dropped it meanwhile
                self.drop(Fault.STALLED)
                return True
        self.loop_state[DECIDING] = 1.0
        is_finished = govern.tick(
            governor.state, governor.settings, governor.loop, governor.buffer, reading, governor.force
        )
        self.loop_state[WRITING] = 1.0
        try:
            self._rig.write(governor.force.copy())
        finally:
            self.loop_state[WRITING] = 0.0
        self.loop_state[DECIDING] = 0.0
        govern.publish(governor.state, governor.settings, governor.ring, reading)
        if not is_finished:
            self._last_reading = LastReading(reading, self._rig.buttons())
        return bool(is_finished)

    def _take_reading(self) -> FloatArray:
        """Reading (READING_SIZE,) of the rig. Raises ValueError for another shape, and what the driver raises."""
        reading = np.array(self._rig.sense(), dtype=np.float64)
        if reading.shape != (READING_SIZE,):
            raise ValueError(f"a reading has the shape {reading.shape}; it must be ({READING_SIZE},)")
        return reading

    def _stop_with_zero_force(self, fault: Fault) -> None:
        """Write zero force, then stop the governor with this fault: the end is reported only when no force acts. Where
        zero force could not be written in time, the rig is marked as gone and the fault is FORCE_LEFT."""
        is_zero_written = False
        try:
            is_zero_written = self._write_last_zero()
        finally:
            self.force_off = is_zero_written
            if not is_zero_written:
                self.loop_state[RIG_GONE] = 1.0
                self.failure = self.failure or TimeoutError("it took no zero force")
            self._governor.abandon(fault if is_zero_written else Fault.FORCE_LEFT)
            self.loop_state[DECIDING] = 0.0

    def _write_last_zero(self) -> bool:
        """Write zero force, and once more after a write of the loop that was in progress, which may take effect after
        the first. Returns whether that ended within `ZERO_TIMEOUT_S`."""
        deadline_s = time.monotonic() + ZERO_TIMEOUT_S
        is_written = self._zero_writer.run(ZERO_TIMEOUT_S)
        if not (is_written and self.loop_state[WRITING]):
            return is_written
        while self.loop_state[WRITING]:
            if time.monotonic() > deadline_s:
                return False
            time.sleep(ZERO_TIMEOUT_S / 100)
        return self._zero_writer.run(max(0.0, deadline_s - time.monotonic()))

    def _repeat_zero_force(self) -> None:
        """Write zero force again, and close the rig if that was requested: the caller stopped waiting while this thread
        was in the driver, which may have written a force since. Fault FORCE_LEFT where that fails."""
        self.force_off = False
        try:
            self._rig.write(np.zeros(3))
            self.force_off = True
        except Exception:  # noqa: BLE001 - the rig is gone already; only its force matters
            self._governor.abandon(Fault.FORCE_LEFT)
        if self._close_requested:
            with contextlib.suppress(Exception):
                self._rig.close()
