"""The loop of a simulated device, compiled: whole blocks of ticks without Python.

The three parts of a tick come as function pointers, not as inlined code: so the loop is compiled once for every rig,
its compiled form can be kept on disk, and it never holds an outdated copy of a part.
"""

from typing import Any

from numba import njit, types

from study.devices.govern import ROWS, TICK_SIGNATURE, VECTOR

_NOISE = types.uint64[::1]
_SENSE = types.FunctionType(types.void(VECTOR, VECTOR, _NOISE, VECTOR))
_TICK = types.FunctionType(TICK_SIGNATURE)
_ADVANCE = types.FunctionType(types.void(VECTOR, VECTOR, VECTOR))
_RIG = types.Tuple((VECTOR, VECTOR, _NOISE, VECTOR))  # type: ignore[no-untyped-call]
_GOVERNOR = types.Tuple((VECTOR, VECTOR, ROWS, ROWS, VECTOR))  # type: ignore[no-untyped-call]


@njit(types.void(_SENSE, _TICK, _ADVANCE, _RIG, _GOVERNOR, types.int64), cache=True, nogil=True, error_model="numpy")
def run_block(sense: Any, tick: Any, advance: Any, rig: Any, governor: Any, ticks: int) -> None:
    """At most `ticks` ticks, fewer if all is over before.

    rig = (state, parameters, noise) of the CompiledRig and room for a reading; governor = (state, settings, loop,
    buffer, force) of `study.devices.govern.tick`.
    """
    rig_state, parameters, noise, reading = rig
    state, settings, loop, buffer, force = governor
    for _ in range(ticks):
        sense(rig_state, parameters, noise, reading)
        over = tick(state, settings, loop, buffer, reading, force)
        advance(rig_state, parameters, force)
        if over:
            break
