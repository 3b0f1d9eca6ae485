"""Running ticks: sense, govern, write. The only two places where a force reaches a rig."""

import contextlib
from typing import Protocol

import numpy as np

from study.devices import govern
from study.devices.block import parts, run_block
from study.devices.device import Fault
from study.devices.governor import Governor
from study.devices.rig import READING_SIZE, CompiledRig, Rig


class Runner(Protocol):
    catches_up: bool
    """Whether ticks that are late can still be run: a simulated world waits, a real one does not."""
    failure: Exception | None
    """What took the rig away, if it is gone."""

    def run(self, ticks: int) -> None:
        """At most so many ticks, fewer if all is over before. Never raises for a failing rig: see `failure`."""
        ...

    def give_up(self, failure: Exception) -> None:
        """The rig, or the loop around it, is gone: force off. Never raises."""
        ...

    def disconnect(self) -> None:
        """Force off, for good. Never raises."""
        ...


class CompiledRunner:
    """A simulated rig, in compiled blocks. Its force is off as soon as no block runs."""

    catches_up = True

    def __init__(self, rig: CompiledRig, governor: Governor, block_ticks: int) -> None:
        self._parts = parts(rig.sense, rig.advance)
        self._arrays = (rig.state, rig.parameters, rig.noise, np.zeros(READING_SIZE))
        self._governor = governor
        self._block_ticks = block_ticks
        self.failure: Exception | None = None
        self._run_block(0)  # compiled now, not when a stimulus is due

    def run(self, ticks: int) -> None:
        try:
            for start in range(0, ticks, self._block_ticks):
                self._run_block(min(self._block_ticks, ticks - start))
                if not self._governor.moving:
                    break
        except Exception as error:  # noqa: BLE001 - whatever it is: the force goes off, and the next call says why
            self.give_up(error)

    def give_up(self, failure: Exception) -> None:
        self.failure = failure
        self._governor.abandon(Fault.LOST)

    def disconnect(self) -> None:
        self._governor.abandon(Fault.LOST)

    def _run_block(self, ticks: int) -> None:
        governor = self._governor
        arrays = (governor.state, governor.settings, governor.loop, governor.buffer, governor.force)
        run_block(*self._parts, self._arrays, arrays, ticks)


class SteppedRunner:
    """A rig that is driven from Python, tick by tick."""

    def __init__(self, rig: Rig, governor: Governor, catches_up: bool) -> None:
        self._rig = rig
        self._governor = governor
        self.catches_up = catches_up
        self.failure: Exception | None = None

    def run(self, ticks: int) -> None:
        try:
            for _ in range(ticks):
                if self._tick():
                    break
        except Exception as error:  # noqa: BLE001 - whatever a driver throws: the force goes off, the next call says why
            self.give_up(error)
        except BaseException:  # Ctrl-C in the middle of a tick
            self._silence(Fault.STALLED)
            raise

    def give_up(self, failure: Exception) -> None:
        self.failure = failure
        self._silence(Fault.LOST)

    def disconnect(self) -> None:
        self._silence(Fault.LOST)
        with contextlib.suppress(Exception):
            self._rig.close()

    def _tick(self) -> bool:
        governor = self._governor
        reading = np.array(self._rig.sense(), dtype=np.float64)
        if reading.shape != (READING_SIZE,):
            raise ValueError(f"a reading has the shape {reading.shape}; it must be ({READING_SIZE},)")
        over = govern.tick(governor.state, governor.settings, governor.loop, governor.buffer, reading, governor.force)
        self._rig.write(governor.force.copy())
        return bool(over)

    def _silence(self, fault: Fault) -> None:
        self._governor.abandon(fault)
        with contextlib.suppress(Exception):
            self._rig.write(np.zeros(3))
