"""Runs ticks: sense, govern, write. Compiled rigs get their forces here, others in `stepped_runner`.

A simulated device runs whole blocks of ticks without Python. The three parts of a tick come as function pointers, not
as inlined code: the loop is compiled once for every rig, its compiled form can be kept on disk, and it never holds an
outdated copy of a part.
"""

from typing import Any, Protocol

import numpy as np
from numba import njit, types
from numba.experimental.function_type import _get_wrapper_address

from study.devices.device import Fault
from study.devices.drive.last_reading import LastReading
from study.devices.governor import cells
from study.devices.governor.govern import PUBLISH_SIGNATURE, ROWS, TICK_SIGNATURE, VECTOR, publish, tick
from study.devices.governor.governor import Governor
from study.devices.rig import READING_SIZE, CompiledRig

_NOISE = types.uint64[::1]
"""State of a sensor's random numbers, `CompiledRig.noise`."""
_SENSE = types.FunctionType(types.void(VECTOR, VECTOR, _NOISE, VECTOR))
"""Types of the function pointers to the parts of a tick."""
_TICK = types.FunctionType(TICK_SIGNATURE)
_PUBLISH = types.FunctionType(PUBLISH_SIGNATURE)
_ADVANCE = types.FunctionType(types.void(VECTOR, VECTOR, VECTOR))
_RIG = types.Tuple((VECTOR, VECTOR, _NOISE, VECTOR))  # type: ignore[no-untyped-call]
"""Grouped arguments of `run_block`."""
_GOVERNOR = types.Tuple((VECTOR, VECTOR, ROWS, ROWS, VECTOR, ROWS))  # type: ignore[no-untyped-call]


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
        """numba's signature of the function. Part of numba's protocol of such pointers."""
        return self._signature


def parts(sense: Any, advance: Any) -> tuple[Part, Part, Part]:
    """The three parts of a tick of one rig, as the three first arguments of `run_block`."""
    return Part(sense, _SENSE), Part(tick, _TICK), Part(advance, _ADVANCE)


PUBLISHED = Part(publish, _PUBLISH)
"""The part that writes a tick into the telemetry ring, the same for every rig."""
_BLOCK = types.void(_SENSE, _TICK, _ADVANCE, _PUBLISH, _RIG, _GOVERNOR, types.int64)
"""Signature of `run_block`."""


@njit(_BLOCK, cache=True, nogil=True, error_model="numpy")
def run_block(  # noqa: PLR0913 - compiled code takes function pointers one by one
    sense: Any, govern: Any, advance: Any, publish: Any, rig: Any, governor: Any, ticks: int
) -> None:
    """Run at most `ticks` ticks, fewer if all is over before. rig = (state, parameters, noise) of the CompiledRig and
    room for a reading; governor = (state, settings, loop, buffer, force) of `study.devices.governor.govern.tick`, and
    the telemetry ring; sense, govern, advance: `parts`; publish: `PUBLISHED`."""
    rig_state, parameters, noise, reading = rig
    state, settings, loop, buffer, force, ring = governor
    for _ in range(ticks):
        sense(rig_state, parameters, noise, reading)
        over = govern(state, settings, loop, buffer, reading, force)
        advance(rig_state, parameters, force)
        if ring.shape[0] > 1:  # a call for nothing would cost half as much as all the rest of a simple rig
            publish(state, settings, ring, reading)
        if over:
            break


class Runner(Protocol):
    """Interface of a runner: runs the ticks of a rig, and ends its force when the rig fails."""

    catches_up: bool
    """Whether ticks that are late can still be run: a simulated world waits, a real one does not."""
    failure: BaseException | None
    """What took the rig away, if it is gone."""
    force_off: bool
    """False if the last zero force may not have reached the rig."""
    disconnected: bool
    """False if the rig was closed and did not take it, or not in time."""

    @property
    def moving(self) -> bool:
        """Whether the governor still moves the device, or the rig has not had its last zero."""
        ...

    @property
    def seen(self) -> LastReading | None:
        """The last reading, by a tick or a glance. None before that, and where the rig is gone. From any thread."""
        ...

    def prepare(self) -> None:
        """Between the governor's beginning and the first tick."""
        ...

    def glance(self) -> None:
        """Read once while nothing moves, and write nothing. Never raises. Only in the thread that runs the ticks."""
        ...

    def run(self, ticks: int) -> None:
        """Run at most this many ticks, fewer if all is over before. Never raises for a failing rig: see `failure`."""
        ...

    def drop(self, fault: Fault) -> None:
        """Force off at once; the rig stays. Only where no tick is under way."""
        ...

    def give_up(self, failure: BaseException) -> None:
        """The rig, or the loop around it, is gone: force off, for good. Never raises. From any thread."""
        ...

    def cut(self) -> None:
        """Emergency stop, past a loop that does not hear it: force off, for good. Never raises. From any thread."""
        ...

    def disconnect(self) -> None:
        """Force off, for good. Never raises. May be called twice."""
        ...


class CompiledRunner:
    """A simulated rig, in compiled blocks. Its force is off as soon as no block runs."""

    catches_up = True
    force_off = disconnected = True

    def __init__(self, rig: CompiledRig, governor: Governor, block_ticks: int) -> None:
        self._parts = parts(rig.sense, rig.advance)
        self._rig = rig
        self._arrays = (rig.state, rig.parameters, rig.noise, np.zeros(READING_SIZE))
        # Of its own: how often it is looked at must not change what is recorded.
        self._glance_noise = ~rig.noise
        self._seen: LastReading | None = None
        self._governor = governor
        self._block_ticks = block_ticks
        self.failure: BaseException | None = None
        self._run_block(0)  # compiled now, not when a stimulus is due

    @property
    def moving(self) -> bool:
        return self._governor.moving

    @property
    def seen(self) -> LastReading | None:
        return self._seen if self.failure is None else None

    def prepare(self) -> None:
        """Tells the rig what will be played (`CompiledRig.prepare`)."""
        state = self._governor.state
        repeats, wait = bool(np.isinf(state[cells.LENGTH])), int(state[cells.LEAD] - state[cells.TICK])
        self._rig.prepare(self._governor.steady, repeats, wait)

    def glance(self) -> None:
        """Reads with random numbers of its own: how often it is called changes no recording."""
        rig, reading = self._rig, np.zeros(READING_SIZE)
        try:
            rig.sense(rig.state, rig.parameters, self._glance_noise, reading)
            self._seen = LastReading(reading, rig.buttons())
        except Exception:  # noqa: BLE001 - a look finds no reading
            self._seen = None

    def run(self, ticks: int) -> None:
        """Run ticks in blocks of `block_ticks`; after each, the reading is kept for `seen`."""
        try:
            for start in range(0, ticks, self._block_ticks):
                self._run_block(min(self._block_ticks, ticks - start))
                self._seen = LastReading(self._arrays[-1].copy(), self._rig.buttons())
                if not self._governor.moving:
                    break
        except Exception as error:  # noqa: BLE001 - any error: the force goes off, and the next call says why
            self.give_up(error)

    def drop(self, fault: Fault) -> None:
        """End with this fault; one more tick is run, in which the rig is given zero force."""
        self._governor.abandon(fault)
        self._run_block(1)

    def give_up(self, failure: BaseException) -> None:
        self.failure = self.failure or failure
        self._governor.abandon(Fault.LOST)

    def cut(self) -> None:
        """Nothing to do: no block is long, and the stop is taken at each tick of it."""

    def disconnect(self) -> None:
        if self._governor.moving:
            self._governor.abandon(Fault.LOST)

    def _run_block(self, ticks: int) -> None:
        governor = self._governor
        arrays = (governor.state, governor.settings, governor.loop, governor.buffer, governor.force, governor.ring)
        run_block(*self._parts, PUBLISHED, self._arrays, arrays, ticks)
