"""Calls the compiled loop (`compiled_drive`) with its arguments, and reads its newest reading from other threads.

The arguments are the compiled halves of the rig, the arrays of the governor, and the ring of newest readings. Used by
`stepped_runner.SteppedRunner` for rigs with compiled input and output.
"""

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.drive.compiled_drive import (
    PUBLISH,
    READING_COUNT,
    READING_ROWS,
    RECORD_MISSED,
    SENSE,
    TICK,
    WRITE,
    attend,
    run_due,
)
from study.devices.drive.runner import FunctionPointer
from study.devices.governor import govern
from study.devices.governor.governor import Governor
from study.devices.native import SLEEP
from study.devices.rig import READING_SIZE, CompiledIo, Rig


def get_compiled_io(rig: Rig) -> CompiledIo | None:
    """The compiled `sense` and `write` of this rig, its attribute `halves`; None where it has none."""
    halves = getattr(rig, "halves", None)
    return halves if isinstance(halves, CompiledIo) else None


GOVERNOR_POINTERS = FunctionPointer(govern.tick, TICK), FunctionPointer(govern.publish, PUBLISH)
"""Function pointers of the parts of a tick that are the same for every rig; their addresses are looked up once."""
RECORD_MISSED_POINTER = FunctionPointer(govern.record_missed_ticks, RECORD_MISSED)
"""Function pointer of the part that records missed ticks."""


class CompiledTicks:
    """Runs the ticks of a rig by the compiled loop of `compiled_drive`, and gives its newest reading. loop_state: cells
    of `compiled_drive`, shared with the drive. The constructor compiles the loop."""

    def __init__(self, halves: CompiledIo, governor: Governor, loop_state: FloatArray) -> None:
        self._halves = halves
        self._governor = governor
        self._pointers = FunctionPointer(halves.sense, SENSE), FunctionPointer(halves.write, WRITE), *GOVERNOR_POINTERS
        self._rig_arrays = halves.calls, halves.cells, halves.samples
        self._readings: FloatArray = np.zeros((READING_ROWS, READING_SIZE))
        self._loop_arrays = loop_state, np.zeros(READING_SIZE), self._readings
        self._flags = loop_state
        self._running = False
        self.error = halves.error
        self.run(0)  # compile now, not when a stimulus is due

    @property
    def attends(self) -> bool:
        """Whether `attend` may be called: it needs the system's own clock and sleep (`native.collect_system_calls`)."""
        return bool(self._halves.calls[SLEEP] != 0)

    def run(self, ticks: int) -> int:
        """Run at most `ticks` ticks, one after another without waiting. Returns `RUNNING`, `FINISHED`, or the driver's
        error code, > 0."""
        self._flags[READING_COUNT], self._running = 0.0, True
        try:
            return int(
                run_due(*self._pointers, self._rig_arrays, self._list_governor_arrays(), self._loop_arrays, ticks)
            )
        finally:
            self._running = False

    def attend(self) -> int:
        """Run ticks as they become due, until the force is off for good, a tick fails, or the loop's thread is needed.
        Returns as `run`, or `GAP`. To be called only where `attends`."""
        self._flags[READING_COUNT], self._running = 0.0, True
        try:
            return int(
                attend(
                    *self._pointers,
                    RECORD_MISSED_POINTER,
                    self._rig_arrays,
                    self._list_governor_arrays(),
                    self._loop_arrays,
                )
            )
        finally:
            self._running = False

    def get_running_reading(self) -> FloatArray | None:
        """Newest reading, shape (READING_SIZE,), of a call of `run` or `attend` in progress; else None."""
        return self.get_last_reading() if self._running else None

    def get_last_reading(self) -> FloatArray | None:
        """Last reading, shape (READING_SIZE,), of the present or else the last call, without that of a tick after which
        the force stays off; None before the first. May be called from any thread: a row that was overwritten while it
        was copied is copied again."""
        while reading_count := int(self._flags[READING_COUNT]):
            reading: FloatArray = self._readings[(reading_count - 1) % READING_ROWS].copy()
            if self._flags[READING_COUNT] - reading_count < READING_ROWS - 1:
                return reading
        return None

    def _list_governor_arrays(self) -> tuple[FloatArray, ...]:
        """The governor's arrays, in the order of `compiled_drive._GOVERNOR`; some are replaced for each stimulus."""
        governor = self._governor
        return (
            governor.state,
            governor.settings,
            governor.loop,
            governor.buffer,
            governor.force,
            governor.ring,
            governor.missed_reading,
        )
