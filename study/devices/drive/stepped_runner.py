"""Ticks of a rig that is driven from Python, and what is done when its driver hangs or fails.

A call into a driver cannot be broken off. So the side that gives up first marks the rig as `gone` and has a thread of
its own write zero; and the loop, whenever its call returns, writes zero once more: a late write leaves no force.
"""

import contextlib
import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.device import Fault
from study.devices.drive.seen import Seen
from study.devices.governor import cells, govern
from study.devices.governor.governor import Governor
from study.devices.rig import READING_SIZE, Rig


class Standby:
    """Started beforehand: no thread can be started any more while the interpreter ends."""

    def __init__(self, action: Callable[[], None], name: str) -> None:
        self._action = action
        self._asked: SimpleQueue[SimpleQueue[bool] | None] = SimpleQueue()
        threading.Thread(target=self._work, name=name, daemon=True).start()

    def run(self, patience_s: float) -> bool:
        """Whether it was done within patience_s, without an error. It goes on even if the caller is interrupted."""
        answer: SimpleQueue[bool] = SimpleQueue()
        self._asked.put(answer)
        try:
            return answer.get(timeout=patience_s)
        except Empty:
            return False

    def end(self) -> None:
        """After what was asked for so far."""
        self._asked.put(None)

    def _work(self) -> None:
        while (answer := self._asked.get()) is not None:
            try:
                self._action()
                answer.put(True)
            except BaseException:  # noqa: BLE001 - the answer says so, and the next one who asks needs this thread
                answer.put(False)


ZERO_PATIENCE_S = 0.1
"""For a zero force to be written: a hundred times what a driver takes."""

CLOSE_PATIENCE_S = 1.0


class SteppedRunner:
    """now_s: the clock by which readings are stamped, where time passes by itself. Without it, each is a tick apart."""

    def __init__(
        self, rig: Rig, governor: Governor, catches_up: bool, now_s: Callable[[], float] | None = None
    ) -> None:
        self._rig = rig
        self._governor = governor
        self._now_s = now_s
        self.catches_up = catches_up
        self.failure: BaseException | None = None
        self.force_off = True
        self._seen: Seen | None = None
        self._gone = threading.Event()
        self._closed = self._ended = False
        self._deciding = self._writing = False
        self._zero = Standby(lambda: rig.write(np.zeros(3)), "force off")
        self._disconnect = Standby(rig.close, "disconnect")

    @property
    def moving(self) -> bool:
        return self._governor.moving or self._deciding

    @property
    def seen(self) -> Seen | None:
        return None if self._gone.is_set() else self._seen

    def prepare(self) -> None:
        """What moves by itself needs no telling."""

    def glance(self) -> None:
        if self._gone.is_set():
            return
        try:
            self._seen = Seen(self._read(), self._rig.buttons())
        except Exception:  # noqa: BLE001 - a look hears that there is no reading; the next tick says why
            self._seen = None

    def run(self, ticks: int) -> None:
        if self._gone.is_set():
            self._governor.abandon(Fault.LOST)
            return
        try:
            for _ in range(ticks):
                if self._tick() or self._gone.is_set():
                    break
        except Exception as error:  # noqa: BLE001 - any error of a driver: the force goes off, the next call says why
            self.give_up(error)
        except BaseException:  # Ctrl-C in the middle of a tick
            self._silence(Fault.STALLED)
            raise
        finally:
            if self._gone.is_set():
                self._once_more()

    def give_up(self, failure: BaseException) -> None:
        self.failure = self.failure or failure
        self._gone.set()
        self._silence(Fault.LOST)

    def drop(self, fault: Fault) -> None:
        self._silence(fault)

    def cut(self) -> None:
        self._gone.set()
        self._silence(Fault.STOPPED)

    def disconnect(self) -> None:
        if self._ended:
            return
        self._gone.set()
        try:
            self._silence(Fault.LOST if self.moving else Fault.NONE)
        finally:
            self._closed = True
            self._disconnect.run(CLOSE_PATIENCE_S)
        self._ended = True
        self._zero.end()
        self._disconnect.end()

    def _tick(self) -> bool:
        governor = self._governor
        reading = self._read()
        if self._gone.is_set():
            return True
        if self._now_s is not None:
            governor.state[cells.STAMP_S] = self._now_s()
        self._deciding = True
        over = govern.tick(governor.state, governor.settings, governor.loop, governor.buffer, reading, governor.force)
        self._writing = True
        try:
            self._rig.write(governor.force.copy())
        finally:
            self._writing = False
        self._deciding = False
        govern.publish(governor.state, governor.settings, governor.ring, reading)
        if not over:
            self._seen = Seen(reading, self._rig.buttons())
        return bool(over)

    def _read(self) -> FloatArray:
        reading = np.array(self._rig.sense(), dtype=np.float64)
        if reading.shape != (READING_SIZE,):
            raise ValueError(f"a reading has the shape {reading.shape}; it must be ({READING_SIZE},)")
        return reading

    def _silence(self, fault: Fault) -> None:
        """Zero force first, then the governor is still: it must not be said that all is over before it is."""
        written = False
        try:
            written = self._zero.run(ZERO_PATIENCE_S) and not self._writing  # what still hangs may come after the zero
        finally:
            self.force_off = written
            if not written:
                self._gone.set()
                self.failure = self.failure or TimeoutError("it took no zero force")
            self._governor.abandon(fault if written else Fault.FORCE_LEFT)
            self._deciding = False

    def _once_more(self) -> None:
        """The caller gave up while this thread was in the driver: what it wrote is taken back."""
        self.force_off = False
        try:
            self._rig.write(np.zeros(3))
            self.force_off = True
        except Exception:  # noqa: BLE001 - it is known to be gone; what matters is whether its force is
            self._governor.abandon(Fault.FORCE_LEFT)
        if self._closed:
            with contextlib.suppress(Exception):
                self._rig.close()
