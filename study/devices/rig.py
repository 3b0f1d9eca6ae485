"""The rig port: a bare device, without limits. Only the safety layer (`study.devices.safe`) may drive one.

A tick of the 1 kHz loop is: `sense` (at t_k), spring and limits, `write` (held until t_(k+1)).

The places below are compiled into the safety layer, which watches this file, and into the simulated devices, whose
code kept on disk does not: after a change of them, delete the compiled files (`*.nbi`, `*.nbc`) of those.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo
from study.session.facts.sensor_facts import SensorFacts

POSITION = slice(0, 3)
"""Slice of a reading with the encoders' position of the handle, m."""
ACCELERATION = slice(3, 6)
"""The accelerometer's reading, m/s², in the device's axes as mounted, zeroed at rest."""
TRUE_ACCELERATION = slice(6, 9)
"""The handle's true acceleration, m/s²: known for a simulated device only, NaN for others."""
SENSOR_CLIPPED = 9
"""1 if a channel of the accelerometer was at its limit, else 0."""
READING_SIZE = 10
"""Numbers in a reading."""


class Rig(Protocol):
    """Driven tick by tick from Python: a real or a scripted device.

    One thread calls `sense`, `write` and `buttons` in turn. While one of these hangs, another thread calls `write`
    with a zero force, and `close`: a driver that is not made for that must serve them all the same, and release no
    force after.
    """

    @property
    def info(self) -> DeviceInfo:
        """Properties of the device as opened."""
        ...

    @property
    def drops_force_after_s(self) -> float:
        """How long without a `write` until the hardware lets go by itself; 0 or infinite: it never does.

        The only thing that turns the force off when this program is killed or the computer hangs. As set in the
        device, not as asked for.
        """
        ...

    def sense(self) -> FloatArray:
        """A reading, shape (READING_SIZE,). Raises `study.errors.DeviceError` when the device is gone."""
        ...

    def buttons(self) -> frozenset[int]:
        """Numbers of the buttons that are down. Asked after every reading, in the same thread: as cheap as one."""
        ...

    def write(self, force_n: FloatArray) -> None:
        """Command a force, shape (3,), x, y, z; held until the next one."""
        ...

    def close(self) -> bool | None:
        """Force off, disconnect. False where the device did not take it. Never raises; may be called again."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class CompiledIo:
    """The same driver compiled: a `Rig` that has an attribute `halves` is driven without the interpreter.

    Both do exactly what the rig's own `sense` and `write` do, errors too; the rig's `buttons` is then asked from any
    thread. See `study.devices.drive.compiled_drive` for the signatures.
    """

    sense: Callable[..., Any]
    """sense(calls, cells, samples, reading): fills reading, shape (READING_SIZE,). 0, or a code above it."""
    write: Callable[..., Any]
    """write(calls, cells, force_n): force_n, shape (3,). 0, or a code above it."""
    calls: npt.NDArray[np.int64]
    """Addresses in `study.devices.native.system_calls`, followed by the driver's own."""
    cells: FloatArray
    samples: FloatArray
    """Samples of the accelerometer, shape (rows, columns)."""
    error: Callable[[int], Exception]
    """error(code): what the rig's own methods raise; asked for in the thread that got the code."""


@dataclass(frozen=True, slots=True, eq=False)
class SensedAcceleration:
    """What an accelerometer measured that is read apart from the ticks."""

    acceleration_mps2: FloatArray
    """(k, 3), as in `ACCELERATION`, at the ticks that were asked for; NaN where it is not known."""
    health: SensorFacts


@runtime_checkable
class OwnClockSensor(Protocol):
    """A rig whose accelerometer has a clock of its own. Its newest value stands in each reading; what belongs to a
    tick is known only later."""

    def sensed(self, since_s: float, tick_s: FloatArray, rate_hz: float) -> SensedAcceleration | None:
        """tick_s (k,): when the ticks were due, 1 / rate_hz apart, by the clock of the loop; since_s: from when on is
        counted. None without such a sensor. In any thread, while nothing moves; may take 0.1 s."""
        ...


def no_buttons() -> frozenset[int]:
    """Buttons pressed on a device that has none: always empty."""
    return frozenset()


def no_hand(on_handle: bool) -> None:
    """A device with no simulated hand."""


def not_prepared(rows: FloatArray, repeats: bool, wait: int) -> None:
    """A device knows nothing of what is to come."""


@dataclass(frozen=True, slots=True, eq=False)
class CompiledRig:
    """A simulated device whose two halves of a tick are compiled, so that whole blocks run without Python."""

    info: DeviceInfo
    state: FloatArray
    """Changed in place by `advance`."""
    parameters: FloatArray
    noise: npt.NDArray[np.uint64]
    """State of the sensor's random numbers, changed in place by `sense`."""
    sense: Callable[..., Any]
    """sense(state, parameters, noise, reading): fills reading, shape (READING_SIZE,)."""
    advance: Callable[..., Any]
    """advance(state, parameters, force_n): holds force_n, shape (3,), for one tick."""
    buttons: Callable[[], frozenset[int]] = no_buttons
    """Numbers of the buttons that are down."""
    prepare: Callable[[FloatArray, bool, int], None] = not_prepared
    """prepare(rows, repeats, wait): told before a stimulus begins, for a rig that only acts as if it were driven. rows
    (n, 3), N: played once or, if it `find_repeats`, again and again; the first comes after `wait` ticks."""
    simulate_hand: Callable[[bool], None] = no_hand
    """simulate_hand(on_handle): the simulated hand lets go, or takes the handle again."""

    def close(self) -> None:
        """Nothing to disconnect."""
