"""Control ticks of a real device in compiled code: wait, sense, govern, write, and fill the telemetry ring.

The ticks do the same as those of `stepped_runner` and `realtime_drive` in Python, in the same order and to the last
bit. `run_due` runs ticks one after another without waiting, for tests and for systems whose clock compiled code does
not read; `attend` waits for each tick in real time, until the loop's thread is needed for other work. Both are called
by `compiled_ticks`. The code allocates nothing and does not hold Python's global interpreter lock, so that no tick
waits for another Python thread.
"""

from pathlib import Path
from typing import Any

from numba import njit, types

from equalizer.signals.signal import FloatArray
from study.devices.governor.cells import IDLE, LATE, LATEST_S, PHASE, READING_TIME_S
from study.devices.governor.compiling import compute_fingerprint, njit_inline
from study.devices.governor.govern import (
    MATRIX_TYPE,
    MISSED_TICKS_SIGNATURE,
    PUBLISH_SIGNATURE,
    TICK_SIGNATURE,
    VECTOR_TYPE,
)
from study.devices.native import read_clock_s, sleep_until
from study.devices.rig import READING_SIZE

(
    # Flags. RIG_GONE: the rig is no longer used. DECIDING: from before a force is decided until it was written;
    # WRITING: during the write. STAMPS: each reading gets a time stamp. THREAD_NEEDED: the thread has other work.
    RIG_GONE, DECIDING, WRITING, STAMPS, THREAD_NEEDED,
    # Real time: begin of the stimulus and of the last turn of the loop (s); number of the last tick, run or missed; due
    # time of the present tick (s); rate (Hz); gap between two turns that counts as a failure of the loop (s).
    STARTED_S, LAST_S, LAST_TICK, DUE_S, RATE_HZ, LONGEST_GAP_S,
    # Readings of this call so far, of which `readings` holds the newest; size of the array.
    READING_COUNT, LOOP_STATE_SIZE,
) = range(13)  # fmt: skip
"""Cells of `loop_state`. THREAD_NEEDED to LONGEST_GAP_S are shared with `realtime_drive`, the other flags with
`stepped_runner`."""

RUNNING, FINISHED, GAP = 0, -1, -2
"""Return codes; a code above zero is the driver's own error. RUNNING: more ticks may follow. FINISHED: that tick was
the last, no force acts any more, or the rig is gone. GAP: no tick was run, because the previous one was longer ago than
LONGEST_GAP_S."""

SPIN_S = 0.00015
"""Time (s) before a tick at which the sleep ends and polling of the clock begins, because a sleep ends late. Chosen: a
longer time occupies the processor for longer."""

TICK_TOLERANCE = 1e-6
"""Tolerance (ticks): a time that rounding puts just before a tick counts as that tick."""

READING_ROWS = 8
"""Number of readings in the ring of newest readings. A reading that another thread is copying is overwritten only
READING_ROWS - 1 ticks later."""

CALLS = types.int64[::1]
"""Type of the array of addresses of C functions: `study.devices.native.collect_system_calls`, followed by the driver's
own."""
SENSE_SIGNATURE = types.int64(CALLS, VECTOR_TYPE, MATRIX_TYPE, VECTOR_TYPE)
"""Signature of the compiled half `sense` of a rig, as in `study.devices.rig.CompiledIo`; that of `write` follows."""
WRITE_SIGNATURE = types.int64(CALLS, VECTOR_TYPE, VECTOR_TYPE)
SENSE_TYPE, WRITE_TYPE = types.FunctionType(SENSE_SIGNATURE), types.FunctionType(WRITE_SIGNATURE)
TICK_TYPE, PUBLISH_TYPE, RECORD_MISSED_TYPE = map(
    types.FunctionType, (TICK_SIGNATURE, PUBLISH_SIGNATURE, MISSED_TICKS_SIGNATURE)
)
"""numba types of pointers to the compiled functions: those of a rig above, those of `govern` here."""
_RIG_TYPE = types.Tuple((CALLS, VECTOR_TYPE, MATRIX_TYPE))  # type: ignore[no-untyped-call]
"""Types of the grouped arguments of `_run_tick`. _RIG_TYPE: the rig's calls, cells and samples; _GOVERNOR_TYPE: the
governor's arrays (`CompiledTicks`); _LOOP_STATE_TYPE: cells of the loop, last reading, ring of newest readings."""
_GOVERNOR_TYPE = types.Tuple(  # type: ignore[no-untyped-call]
    (VECTOR_TYPE, VECTOR_TYPE, MATRIX_TYPE, MATRIX_TYPE, VECTOR_TYPE, MATRIX_TYPE, VECTOR_TYPE)
)
_LOOP_STATE_TYPE = types.Tuple((VECTOR_TYPE, VECTOR_TYPE, MATRIX_TYPE))  # type: ignore[no-untyped-call]
_RUN_DUE_SIGNATURE = types.int64(
    SENSE_TYPE, WRITE_TYPE, TICK_TYPE, PUBLISH_TYPE, _RIG_TYPE, _GOVERNOR_TYPE, _LOOP_STATE_TYPE, types.int64
)
"""Signature of the entry point `run_due`; that of `attend` follows."""
_ATTEND_SIGNATURE = types.int64(
    SENSE_TYPE, WRITE_TYPE, TICK_TYPE, PUBLISH_TYPE, RECORD_MISSED_TYPE, _RIG_TYPE, _GOVERNOR_TYPE, _LOOP_STATE_TYPE
)


@njit_inline
def _run_tick(  # noqa: PLR0913 - compiled code takes function pointers one by one
    sense: Any, write: Any, govern: Any, publish: Any, rig: Any, governor: Any, loop_state: Any
) -> int:
    """Run a tick: sense, store the time of the reading, decide the force (`govern.tick`), write it, publish it to
    telemetry. Returns `RUNNING`, `FINISHED` where the force is off and stays off or the rig is gone, or the driver's
    error code. The cells DECIDING and WRITING show other threads whether a force is about to be written."""
    calls, cells, samples = rig
    # `_missed_reading`, the reading of a missed tick, is used in `_attend_tick` only.
    state, settings, loop, buffer, force, ring, _missed_reading = governor
    loop_cells, reading, readings = loop_state
    return_code = sense(calls, cells, samples, reading)
    if return_code != 0:
        return int(return_code)
    if loop_cells[RIG_GONE] != 0.0:
        return FINISHED
    if loop_cells[STAMPS] != 0.0:
        state[READING_TIME_S] = read_clock_s(calls)
    loop_cells[DECIDING] = 1.0
    is_finished = govern(state, settings, loop, buffer, reading, force)
    loop_cells[WRITING] = 1.0
    ring_row = int(loop_cells[READING_COUNT]) % READING_ROWS
    for i in range(READING_SIZE):
        readings[ring_row, i] = reading[i]
    return_code = write(calls, cells, force)
    loop_cells[WRITING] = 0.0
    if return_code != 0:
        return int(return_code)
    loop_cells[DECIDING] = 0.0
    publish(state, settings, ring, reading)
    if is_finished:
        return FINISHED
    loop_cells[READING_COUNT] += 1.0
    return RUNNING


@njit_inline
def _compute_due_s(loop_cells: FloatArray, tick: float) -> float:
    """Compute the time (s) at which a tick is due, counted from the start, so that delays do not accumulate."""
    return float(loop_cells[STARTED_S] + tick / loop_cells[RATE_HZ])


@njit_inline
def _wait_for_tick(calls: Any, loop_cells: FloatArray) -> float:
    """Sleep, then poll the clock, until the next tick is due. Returns the time (s)."""
    loop_cells[DUE_S] = _compute_due_s(loop_cells, loop_cells[LAST_TICK] + 1.0)
    sleep_until(calls, loop_cells[DUE_S] - SPIN_S)
    time_s = read_clock_s(calls)
    while time_s < loop_cells[DUE_S]:
        time_s = read_clock_s(calls)
    return float(time_s)


@njit_inline
def _must_return(governor: Any, loop_state: Any) -> bool:
    """Whether `attend` has to return: the thread is needed, the rig is gone, or no force acts any more."""
    loop_cells = loop_state[0]
    return bool(loop_cells[THREAD_NEEDED] != 0.0 or loop_cells[RIG_GONE] != 0.0 or governor[0][PHASE] == IDLE)


@njit_inline
def _attend_tick(  # noqa: PLR0913 - as above
    sense: Any, write: Any, govern: Any, publish: Any, record_missed: Any, rig: Any, governor: Any, loop_state: Any
) -> int:
    """Wait for the next tick, record the ticks that were missed meanwhile, run the due tick, and record how late it
    ended. Returns one of the return codes above."""
    calls, loop_cells, state = rig[0], loop_state[0], governor[0]
    begin_s = _wait_for_tick(calls, loop_cells)
    if loop_cells[RIG_GONE] != 0.0 or state[PHASE] == IDLE:
        return FINISHED
    gap_s, loop_cells[LAST_S] = begin_s - loop_cells[LAST_S], begin_s
    if gap_s > loop_cells[LONGEST_GAP_S]:
        return GAP
    # At least the awaited tick: long after the start of the clock, its rounding exceeds TICK_TOLERANCE.
    awaited_tick = int(loop_cells[LAST_TICK]) + 1
    due_tick = max(awaited_tick, int((begin_s - loop_cells[STARTED_S]) * loop_cells[RATE_HZ] + TICK_TOLERANCE))
    if due_tick > awaited_tick:
        record_missed(state, governor[3], governor[6], due_tick - awaited_tick)
    return_code = _run_tick(sense, write, govern, publish, rig, governor, loop_state)
    loop_cells[LAST_TICK] = due_tick
    if return_code <= RUNNING:
        end_s = read_clock_s(calls)
        state[LATE] += end_s > _compute_due_s(loop_cells, due_tick + 1.0)
        state[LATEST_S] = max(state[LATEST_S], end_s - loop_cells[DUE_S])
    return return_code


def _compile_entry_points(sources_fingerprint: int) -> tuple[Any, Any]:
    """Compile `run_due` and `attend`. sources_fingerprint: of the source files that the compiled code includes,
    captured so that a change invalidates numba's cache."""

    @njit(_RUN_DUE_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def run_due(  # noqa: PLR0913 - compiled code takes function pointers one by one
        sense: Any, write: Any, govern: Any, publish: Any, rig: Any, governor: Any, loop_state: Any, ticks: int
    ) -> int:
        """Run at most `ticks` ticks without waiting, fewer if the force is permanently off before, a tick fails or the
        rig is gone. Returns `RUNNING`, `FINISHED`, or the driver's error code."""
        _ = sources_fingerprint
        return_code = RUNNING
        for _tick_number in range(ticks):
            return_code = _run_tick(sense, write, govern, publish, rig, governor, loop_state)
            if return_code != RUNNING or loop_state[0][RIG_GONE] != 0.0:
                break
        return return_code

    @njit(_ATTEND_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def attend(  # noqa: PLR0913 - as above
        sense: Any, write: Any, govern: Any, publish: Any, record_missed: Any, rig: Any, governor: Any, loop_state: Any
    ) -> int:
        """Run ticks as they become due, until the force is permanently off, a tick fails or is too late, or the thread
        is needed for other work. Returns the return code of the last turn, `RUNNING` if there was none. To be called
        only where the address at `study.devices.native.SLEEP` is not 0. After an error code (above zero) the caller has
        to count the lateness of that tick."""
        _ = sources_fingerprint
        return_code = RUNNING
        while return_code == RUNNING and not _must_return(governor, loop_state):
            return_code = _attend_tick(sense, write, govern, publish, record_missed, rig, governor, loop_state)
        return return_code

    return run_due, attend


_DEVICES_FOLDER = Path(__file__).parents[1]
run_due, attend = _compile_entry_points(
    compute_fingerprint(_DEVICES_FOLDER / "governor", _DEVICES_FOLDER / "rig.py", _DEVICES_FOLDER / "native.py")
)
