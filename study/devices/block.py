"""The loop of a simulated device, compiled: whole blocks of ticks without Python.

The three parts of a tick come as function pointers, not as inlined code: so the loop is compiled once for every rig,
its compiled form can be kept on disk, and it never holds an outdated copy of a part.
"""

from typing import Any

from numba import njit, types
from numba.experimental.function_type import _get_wrapper_address

from study.devices.govern import ROWS, TICK_SIGNATURE, VECTOR, tick

_NOISE = types.uint64[::1]
_SENSE = types.FunctionType(types.void(VECTOR, VECTOR, _NOISE, VECTOR))
_TICK = types.FunctionType(TICK_SIGNATURE)
_ADVANCE = types.FunctionType(types.void(VECTOR, VECTOR, VECTOR))
_RIG = types.Tuple((VECTOR, VECTOR, _NOISE, VECTOR))  # type: ignore[no-untyped-call]
_GOVERNOR = types.Tuple((VECTOR, VECTOR, ROWS, ROWS, VECTOR))  # type: ignore[no-untyped-call]


class Part(types.WrapperAddressProtocol):
    """A compiled function as a function pointer that is looked up once.

    numba looks a plain one up anew at every call of the loop: 0.3 ms, as long as a hundred ticks take.
    """

    def __init__(self, function: Any, pointer_type: Any) -> None:
        self._numba_type_ = pointer_type
        self._signature = pointer_type.signature
        self._address = _get_wrapper_address(function, pointer_type.signature)  # type: ignore[no-untyped-call]

    def __wrapper_address__(self) -> int:
        return int(self._address)

    def signature(self) -> Any:
        return self._signature


def parts(sense: Any, advance: Any) -> tuple[Part, Part, Part]:
    """The three parts of a tick of one rig, in the order in which `run_block` takes them."""
    return Part(sense, _SENSE), Part(tick, _TICK), Part(advance, _ADVANCE)


@njit(types.void(_SENSE, _TICK, _ADVANCE, _RIG, _GOVERNOR, types.int64), cache=True, nogil=True, error_model="numpy")
def run_block(sense: Any, govern: Any, advance: Any, rig: Any, governor: Any, ticks: int) -> None:
    """At most `ticks` ticks, fewer if all is over before.

    rig = (state, parameters, noise) of the CompiledRig and room for a reading; governor = (state, settings, loop,
    buffer, force) of `study.devices.govern.tick`; sense, govern, advance: `parts`.
    """
    rig_state, parameters, noise, reading = rig
    state, settings, loop, buffer, force = governor
    for _ in range(ticks):
        sense(rig_state, parameters, noise, reading)
        over = govern(state, settings, loop, buffer, reading, force)
        advance(rig_state, parameters, force)
        if over:
            break
