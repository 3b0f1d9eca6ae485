"""Interface from Python to the compiled control loop (`compiled_drive`): calls it and returns its newest reading.

The loop's arguments are the compiled input and output functions of the rig (`CompiledIo`), the arrays of the governor,
and a ring of the newest readings, which other threads may read meanwhile. Called by `stepped_runner.SteppedRunner` for
rigs with compiled input and output.
"""

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.drive.compiled_drive import (
    PUBLISH_TYPE,
    READING_COUNT,
    READING_ROWS,
    RECORD_MISSED_TYPE,
    SENSE_TYPE,
    TICK_TYPE,
    WRITE_TYPE,
    attend,
    run_due,
)
from study.devices.drive.runner import FunctionPointer
from study.devices.governor import govern
from study.devices.governor.governor import Governor
from study.devices.native import SLEEP
from study.devices.rig import READING_SIZE, CompiledIo, Rig


def get_compiled_io(rig: Rig) -> CompiledIo | None:
    """Get the compiled functions `sense` and `write` of a rig from its attribute `compiled_io`; None where it has
    none."""
    compiled_io = getattr(rig, "compiled_io", None)
    return compiled_io if isinstance(compiled_io, CompiledIo) else None


GOVERNOR_POINTERS = FunctionPointer(govern.tick, TICK_TYPE), FunctionPointer(govern.publish, PUBLISH_TYPE)
"""Function pointers of the governor's parts of a tick, which are the same for every rig; looked up once."""
RECORD_MISSED_POINTER = FunctionPointer(govern.record_missed_ticks, RECORD_MISSED_TYPE)
"""Function pointer of the governor's function that records missed ticks."""


class CompiledTicks:
    """Control ticks of a rig by the compiled loop, and its newest reading. loop_state: shape (LOOP_STATE_SIZE,), the
    cells listed in `compiled_drive`, shared with the drive. `error`: function that makes the exception for a driver's
    error code, as in `CompiledIo`."""

    def __init__(self, compiled_io: CompiledIo, governor: Governor, loop_state: FloatArray) -> None:
        self._compiled_io = compiled_io
        self._governor = governor
        self._pointers = (
            FunctionPointer(compiled_io.sense, SENSE_TYPE),
            FunctionPointer(compiled_io.write, WRITE_TYPE),
            *GOVERNOR_POINTERS,
        )
        self._rig_arrays = compiled_io.calls, compiled_io.cells, compiled_io.samples
        self._readings: FloatArray = np.zeros((READING_ROWS, READING_SIZE))
        self._loop_arrays = loop_state, np.zeros(READING_SIZE), self._readings
        self._loop_state = loop_state
        self._is_running = False
        self.error = compiled_io.error
        self.run(0)  # the first call takes longer: now, not when a stimulus is due

    @property
    def can_attend(self) -> bool:
        """Whether `attend` may be called: compiled code can read the clock and sleep
        (`native.collect_system_calls`)."""
        return bool(self._compiled_io.calls[SLEEP] != 0)

    def run(self, ticks: int) -> int:
        """Run at most `ticks` ticks without waiting, fewer where the force stays off or a tick fails. Returns
        `RUNNING`, `FINISHED`, or the driver's error code, > 0, for `error`."""
        self._loop_state[READING_COUNT], self._is_running = 0.0, True
        try:
            return int(
                run_due(*self._pointers, self._rig_arrays, self._list_governor_arrays(), self._loop_arrays, ticks)
            )
        finally:
            self._is_running = False

    def attend(self) -> int:
        """Run ticks as they become due, until the force stays off, a tick fails, or the loop's thread is needed.
        Returns as `run`, or `GAP`. To be called only where `can_attend`."""
        self._loop_state[READING_COUNT], self._is_running = 0.0, True
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
            self._is_running = False

    def get_running_reading(self) -> FloatArray | None:
        """Get the newest reading, shape (READING_SIZE,), of a call of `run` or `attend` in progress; None without a
        call or before its first reading."""
        return self.get_last_reading() if self._is_running else None

    def get_last_reading(self) -> FloatArray | None:
        """Get the last reading, shape (READING_SIZE,), of the current or else the last call, without that of a tick
        after which the force stays off; None where that call has none. May be called from any thread: a row that was
        overwritten while it was copied is copied again."""
        while reading_count := int(self._loop_state[READING_COUNT]):
            reading: FloatArray = self._readings[(reading_count - 1) % READING_ROWS].copy()
            if self._loop_state[READING_COUNT] - reading_count < READING_ROWS - 1:
                return reading
        return None

    def _list_governor_arrays(self) -> tuple[FloatArray, ...]:
        """List the governor's arrays in the order of `compiled_drive._GOVERNOR_TYPE`. Not stored, because the governor
        replaces some of them for each stimulus."""
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
