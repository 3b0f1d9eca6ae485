"""The runner of a device's control ticks: its interface, and its implementation for simulated (compiled) devices.

A tick reads the sensors (sense), decides the force (govern) and applies it (advance). `CompiledRunner` runs whole
blocks of ticks of a simulated device without Python; `stepped_runner` drives the other devices tick by tick. The drives
(`virtual_drive`, `realtime_drive`) call a runner, which `study.devices.safe` makes. The parts of a tick are passed as
function pointers, not inlined: one loop is compiled for all rigs, its machine code can be cached on disk, and it never
contains an outdated copy of a part."""

from typing import Any, Protocol

import numpy as np
from numba import njit, types
from numba.experimental.function_type import _get_wrapper_address

from study.devices.device import Fault
from study.devices.drive.last_reading import LastReading
from study.devices.governor import cells
from study.devices.governor.govern import MATRIX_TYPE, PUBLISH_SIGNATURE, TICK_SIGNATURE, VECTOR_TYPE, publish, tick
from study.devices.governor.governor import Governor
from study.devices.rig import READING_SIZE, CompiledRig

_NOISE_TYPE = types.uint64[::1]
"""State of a sensor's random numbers, `CompiledRig.noise`."""
_SENSE_TYPE = types.FunctionType(types.void(VECTOR_TYPE, VECTOR_TYPE, _NOISE_TYPE, VECTOR_TYPE))
"""Type of the pointer to `CompiledRig.sense`; the other parts of a tick follow."""
_TICK_TYPE = types.FunctionType(TICK_SIGNATURE)
_PUBLISH_TYPE = types.FunctionType(PUBLISH_SIGNATURE)
_ADVANCE_TYPE = types.FunctionType(types.void(VECTOR_TYPE, VECTOR_TYPE, VECTOR_TYPE))
_RIG_TYPE = types.Tuple((VECTOR_TYPE, VECTOR_TYPE, _NOISE_TYPE, VECTOR_TYPE))  # type: ignore[no-untyped-call]
"""Type of the argument `rig` of `run_block`."""
_GOVERNOR_TYPE = types.Tuple((VECTOR_TYPE, VECTOR_TYPE, MATRIX_TYPE, MATRIX_TYPE, VECTOR_TYPE, MATRIX_TYPE))  # type: ignore[no-untyped-call]
"""Type of the argument `governor` of `run_block`."""


class FunctionPointer(types.WrapperAddressProtocol):
    """Pointer to a compiled part of a tick, whose address is looked up once. For a plain function numba looks the
    address up at every call of the loop, which takes 0.3 ms, as long as a hundred ticks."""

    def __init__(self, function: Any, pointer_type: Any) -> None:
        self._numba_type_ = pointer_type
        self._signature = pointer_type.signature
        self._address = _get_wrapper_address(function, pointer_type.signature)  # type: ignore[no-untyped-call]

    def __wrapper_address__(self) -> int:
        return int(self._address)

    def signature(self) -> Any:
        """numba's signature of the function; required by numba's protocol `WrapperAddressProtocol`."""
        return self._signature


def make_tick_pointers(sense: Any, advance: Any) -> tuple[FunctionPointer, FunctionPointer, FunctionPointer]:
    """Make the pointers to sense, `govern.tick` and advance of a rig, the first three arguments of `run_block`."""
    return (
        FunctionPointer(sense, _SENSE_TYPE),
        FunctionPointer(tick, _TICK_TYPE),
        FunctionPointer(advance, _ADVANCE_TYPE),
    )


PUBLISH_POINTER = FunctionPointer(publish, _PUBLISH_TYPE)
"""Pointer to the part that writes a tick into the telemetry ring, the same for every rig."""
_BLOCK_SIGNATURE = types.void(
    _SENSE_TYPE, _TICK_TYPE, _ADVANCE_TYPE, _PUBLISH_TYPE, _RIG_TYPE, _GOVERNOR_TYPE, types.int64
)
"""Signature of `run_block`."""


@njit(_BLOCK_SIGNATURE, cache=True, nogil=True, error_model="numpy")
def run_block(  # noqa: PLR0913 - compiled code takes function pointers one by one
    sense: Any, govern: Any, advance: Any, publish: Any, rig: Any, governor: Any, ticks: int
) -> None:
    """Run at most `ticks` ticks, fewer if the stimulus ends within them. rig = (state, parameters, noise) of the
    CompiledRig, and an array for the reading; governor = (state, settings, loop, buffer, force) of
    `study.devices.governor.govern.tick`, and the telemetry ring. sense, govern, advance: from `make_tick_pointers`;
    publish: `PUBLISH_POINTER`. All arrays are changed in place."""
    rig_state, parameters, noise, reading = rig
    state, settings, loop, buffer, force, ring = governor
    for _ in range(ticks):
        sense(rig_state, parameters, noise, reading)
        is_finished = govern(state, settings, loop, buffer, reading, force)
        advance(rig_state, parameters, force)
        if ring.shape[0] > 1:  # no ring: an empty call would cost half of the time of a simple rig's tick
            publish(state, settings, ring, reading)
        if is_finished:
            break


class Runner(Protocol):
    """Interface of a runner: runs the ticks of a rig, and ends its force when the rig fails."""

    catches_up: bool
    """Whether late ticks can still be run: True for a simulated device, whose time waits; False for a real device."""
    failure: BaseException | None
    """The exception because of which the rig can no longer be used; None while it can."""
    force_off: bool
    """False if the last command of zero force may not have reached the rig."""
    disconnected: bool
    """False if the rig was to be closed but failed to close, or not in time."""

    @property
    def moving(self) -> bool:
        """Whether the governor still commands a force, or the rig has not received its last zero force."""
        ...

    @property
    def last_reading(self) -> LastReading | None:
        """The last reading of `run` or `read_sensors`; None before the first, after a failed `read_sensors`, and when
        the rig can no longer be used. May be read from any thread."""
        ...

    def prepare(self) -> None:
        """Prepare the rig. Called after the governor has begun a stimulus and before its first tick."""
        ...

    def read_sensors(self) -> None:
        """Read the sensors once while nothing moves, without writing a force. Never raises. To be called only in the
        thread that runs the ticks."""
        ...

    def run(self, ticks: int) -> None:
        """Run at most this many ticks, fewer if the stimulus ends within them. Never raises for a failing rig, whose
        exception is then in `failure`."""
        ...

    def drop(self, fault: Fault) -> None:
        """Force off at once with this fault; the rig stays usable if it takes the zero force. To be called only while
        no tick runs."""
        ...

    def give_up(self, failure: BaseException) -> None:
        """Force off permanently, because the rig or its loop has failed. Never raises. May be called from any
        thread."""
        ...

    def cut(self) -> None:
        """Emergency stop that bypasses a loop that no longer responds: force off permanently. Never raises. May be
        called from any thread."""
        ...

    def disconnect(self) -> None:
        """Force off permanently, at the end of the use of the rig; closes a real device. Never raises. May be called
        twice."""
        ...


class CompiledRunner:
    """Runner of a simulated rig, in compiled blocks of at most block_ticks ticks. Its force is off as soon as no block
    runs."""

    catches_up = True
    force_off = disconnected = True

    def __init__(self, rig: CompiledRig, governor: Governor, block_ticks: int) -> None:
        self._pointers = make_tick_pointers(rig.sense, rig.advance)
        self._rig = rig
        self._rig_arrays = (rig.state, rig.parameters, rig.noise, np.zeros(READING_SIZE))
        # Separate random numbers: the number of calls of `read_sensors` must not change what is recorded.
        self._idle_noise = ~rig.noise
        self._last_reading: LastReading | None = None
        self._governor = governor
        self._block_ticks = block_ticks
        self.failure: BaseException | None = None
        self._run_block(0)  # the first call takes longer: now, not when a stimulus is due

    @property
    def moving(self) -> bool:
        return self._governor.moving

    @property
    def last_reading(self) -> LastReading | None:
        return self._last_reading if self.failure is None else None

    def prepare(self) -> None:
        """Pass the stimulus to the rig (`CompiledRig.prepare`): its rows (n, 3), N, whether they repeat, and the number
        of ticks before the first."""
        state = self._governor.state
        repeats, wait_ticks = bool(np.isinf(state[cells.LENGTH])), int(state[cells.ONSET_TICKS] - state[cells.TICK])
        self._rig.prepare(self._governor.steady, repeats, wait_ticks)

    def read_sensors(self) -> None:
        """Read the sensors; if that raises, `last_reading` is None."""
        rig, reading = self._rig, np.zeros(READING_SIZE)
        try:
            rig.sense(rig.state, rig.parameters, self._idle_noise, reading)
            self._last_reading = LastReading(reading, rig.buttons())
        except Exception:  # noqa: BLE001 - no reading, and `last_reading` is None
            self._last_reading = None

    def run(self, ticks: int) -> None:
        """Run ticks in blocks of `block_ticks`; after each, the reading is stored for `last_reading`."""
        try:
            for first_tick in range(0, ticks, self._block_ticks):
                self._run_block(min(self._block_ticks, ticks - first_tick))
                self._last_reading = LastReading(self._rig_arrays[-1].copy(), self._rig.buttons())
                if not self._governor.moving:
                    break
        except Exception as error:  # noqa: BLE001 - any error: the force goes off, and the next call reports it
            self.give_up(error)

    def drop(self, fault: Fault) -> None:
        """End with this fault, and run one more tick, in which the rig receives zero force."""
        self._governor.abandon(fault)
        self._run_block(1)

    def give_up(self, failure: BaseException) -> None:
        """Keep the first failure, and end the stimulus with the fault LOST."""
        self.failure = self.failure or failure
        self._governor.abandon(Fault.LOST)

    def cut(self) -> None:
        """Nothing to do: the tick checks the governor's stop request, also within a block."""

    def disconnect(self) -> None:
        """End a stimulus that is in progress with the fault LOST."""
        if self._governor.moving:
            self._governor.abandon(Fault.LOST)

    def _run_block(self, ticks: int) -> None:
        """Run a block of at most this many ticks; the governor's arrays are new for each stimulus."""
        governor = self._governor
        governor_arrays = (
            governor.state,
            governor.settings,
            governor.loop,
            governor.buffer,
            governor.force,
            governor.ring,
        )
        run_block(*self._pointers, PUBLISH_POINTER, self._rig_arrays, governor_arrays, ticks)
