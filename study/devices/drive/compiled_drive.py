"""Ticks of a real device without the interpreter: wait, sense, govern, write, and fill the telemetry ring.

The same as `stepped_runner` and `realtime_drive` do from Python, in the same order and to the last bit. `run_due` runs
ticks one after another, for time that a test passes and for systems whose clock is not read here; `attend` waits for
each in real time until anything is asked that needs the interpreter. Nothing is allocated, and no interpreter lock is
wanted, so that no other thread of the program can delay a tick.
"""

from pathlib import Path
from typing import Any

from numba import njit, types

from equalizer.signals.signal import FloatArray
from study.devices.governor.cells import LATE, LATEST_S, PHASE, STAMP_S, STILL
from study.devices.governor.compiling import fingerprint, part
from study.devices.governor.govern import MISS_SIGNATURE, PUBLISH_SIGNATURE, ROWS, TICK_SIGNATURE, VECTOR
from study.devices.native import now_s, sleep_until
from study.devices.rig import READING_SIZE

(
    # Flags. GONE: the rig is given up. DECIDING: from the decision of a force until it was written; WRITING: while it
    # is. STAMPS: each reading is stamped by the clock. WANTED: something needs the loop's thread.
    GONE, DECIDING, WRITING, STAMPS, WANTED,
    # Of real time: when the stimulus began and when the loop turned last, s; ticks run; when the last one was due, s.
    STARTED_S, LAST_S, RUN, DUE_S, RATE_HZ, LONGEST_GAP_S,
    # Readings so far of this call, as they stand in `seen`.
    SEEN, LOOP_STATE_SIZE,
) = range(13)  # fmt: skip
"""Cells of `loop_state`. STARTED_S to LONGEST_GAP_S belong to `realtime_drive`."""

GOES_ON, OVER, GAP = 0, -1, -2
"""What a call answers, or the rig's own code above zero. OVER: that tick was the last, or the rig is gone. GAP: none
was run, since the one before was too long ago."""

SPIN_S = 0.00015
"""Sleep until so long before a real tick, then wait awake: a sleep ends late by more than that on its own."""

HAIR = 1e-6
"""Tolerance in ticks: a sum of rounded times just short of a tick counts as that tick."""

SEEN_ROWS = 8
"""The newest readings; one that is copied meanwhile stays whole for so many ticks less one."""

CALLS = types.int64[::1]
"""Addresses of C functions: `study.devices.native.system_calls`, followed by the driver's own."""
SENSE_SIGNATURE = types.int64(CALLS, VECTOR, ROWS, VECTOR)
"""Signatures of the compiled halves of a rig, in the order of arguments of `study.devices.rig.CompiledIo`: `sense` and
`write`."""
WRITE_SIGNATURE = types.int64(CALLS, VECTOR, VECTOR)
SENSE, WRITE = types.FunctionType(SENSE_SIGNATURE), types.FunctionType(WRITE_SIGNATURE)
TICK, PUBLISH, MISS = map(types.FunctionType, (TICK_SIGNATURE, PUBLISH_SIGNATURE, MISS_SIGNATURE))
_RIG = types.Tuple((CALLS, VECTOR, ROWS))  # type: ignore[no-untyped-call]
"""Grouped arguments of `_tick`: the rig's calls, cells and samples; the governor's arrays (`CompiledTicks`); flags,
last reading and the newest readings."""
_GOVERNOR = types.Tuple((VECTOR, VECTOR, ROWS, ROWS, VECTOR, ROWS, VECTOR))  # type: ignore[no-untyped-call]
_COURSE = types.Tuple((VECTOR, VECTOR, ROWS))  # type: ignore[no-untyped-call]
_RUN_DUE = types.int64(SENSE, WRITE, TICK, PUBLISH, _RIG, _GOVERNOR, _COURSE, types.int64)
"""Signatures of the two entry points."""
_ATTEND = types.int64(SENSE, WRITE, TICK, PUBLISH, MISS, _RIG, _GOVERNOR, _COURSE)


@part
def _tick(  # noqa: PLR0913 - compiled code takes function pointers one by one
    sense: Any, write: Any, govern: Any, publish: Any, rig: Any, governor: Any, loop_state: Any
) -> int:
    """A tick: sense, note its time, decide the force (`govern.tick`), write it, publish it to telemetry.

    Returns `GOES_ON`, `OVER` where the force is off for good, or the driver's code of an error. The flags `DECIDING`
    and `WRITING` show the watching thread where a tick hangs.
    """
    calls, cells, samples = rig
    state, settings, loop, buffer, force, ring, _nothing = governor
    flags, reading, seen = loop_state
    code = sense(calls, cells, samples, reading)
    if code != 0:
        return int(code)
    if flags[GONE] != 0.0:
        return OVER
    if flags[STAMPS] != 0.0:
        state[STAMP_S] = now_s(calls)
    flags[DECIDING] = 1.0
    over = govern(state, settings, loop, buffer, reading, force)
    flags[WRITING] = 1.0
    row = int(flags[SEEN]) % SEEN_ROWS
    for i in range(READING_SIZE):
        seen[row, i] = reading[i]
    code = write(calls, cells, force)
    flags[WRITING] = 0.0
    if code != 0:
        return int(code)
    flags[DECIDING] = 0.0
    publish(state, settings, ring, reading)
    if over:
        return OVER
    flags[SEEN] += 1.0
    return GOES_ON


@part
def _due_s(flags: FloatArray, tick: float) -> float:
    return float(flags[STARTED_S] + tick / flags[RATE_HZ])


@part
def _wait_for_tick(calls: Any, flags: FloatArray) -> float:
    """When it is now, s."""
    flags[DUE_S] = _due_s(flags, flags[RUN] + 1.0)
    sleep_until(calls, flags[DUE_S] - SPIN_S)
    now = now_s(calls)
    while now < flags[DUE_S]:
        now = now_s(calls)
    return float(now)


@part
def _is_called_away(governor: Any, loop_state: Any) -> bool:
    flags = loop_state[0]
    return bool(flags[WANTED] != 0.0 or flags[GONE] != 0.0 or governor[0][PHASE] == STILL)


@part
def _attend_tick(  # noqa: PLR0913 - as above
    sense: Any, write: Any, govern: Any, publish: Any, miss: Any, rig: Any, governor: Any, loop_state: Any
) -> int:
    calls, flags, state, code = rig[0], loop_state[0], governor[0], GOES_ON
    now = _wait_for_tick(calls, flags)
    if flags[GONE] != 0.0 or state[PHASE] == STILL:
        return OVER
    gap_s, flags[LAST_S] = now - flags[LAST_S], now
    if gap_s > flags[LONGEST_GAP_S]:
        return GAP
    due = int((now - flags[STARTED_S]) * flags[RATE_HZ] + HAIR)
    late = due - int(flags[RUN]) - 1
    if late > 0:
        miss(state, governor[3], governor[6], late)
    if late >= 0:
        code = _tick(sense, write, govern, publish, rig, governor, loop_state)
    flags[RUN] = due
    if code <= GOES_ON:
        done = now_s(calls)
        state[LATE] += done > _due_s(flags, due + 1.0)
        state[LATEST_S] = max(state[LATEST_S], done - flags[DUE_S])
    return code


def _entry_points(sources: int) -> tuple[Any, Any]:
    @njit(_RUN_DUE, cache=True, nogil=True, error_model="numpy")
    def run_due(  # noqa: PLR0913 - compiled code takes function pointers one by one
        sense: Any, write: Any, govern: Any, publish: Any, rig: Any, governor: Any, loop_state: Any, ticks: int
    ) -> int:
        """Run at most `ticks` ticks that are due, fewer if all is over before. Returns `GOES_ON`, `OVER`,
        or the rig's own code."""
        _ = sources
        code = GOES_ON
        for _k in range(ticks):
            code = _tick(sense, write, govern, publish, rig, governor, loop_state)
            if code != GOES_ON or loop_state[0][GONE] != 0.0:
                break
        return code

    @njit(_ATTEND, cache=True, nogil=True, error_model="numpy")
    def attend(  # noqa: PLR0913 - as above
        sense: Any, write: Any, govern: Any, publish: Any, miss: Any, rig: Any, governor: Any, loop_state: Any
    ) -> int:
        """Ticks as they become due, until all is over, one fails, or the thread is wanted. Only where
        `study.devices.native.SLEEP` is there.

        After a code above zero the lateness of that tick is not counted yet.
        """
        _ = sources
        code = GOES_ON
        while code == GOES_ON and not _is_called_away(governor, loop_state):
            code = _attend_tick(sense, write, govern, publish, miss, rig, governor, loop_state)
        return code

    return run_due, attend


_DEVICES = Path(__file__).parents[1]
run_due, attend = _entry_points(fingerprint(_DEVICES / "governor", _DEVICES / "rig.py", _DEVICES / "native.py"))
