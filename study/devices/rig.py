"""Interfaces of a bare haptic device ("rig"), which need not limit its force. Only the safety layer
(`study.devices.safe`) may drive it, apart from the acceptance test; drivers and simulations of devices implement it.

A tick of the 1 kHz loop is: `sense` (at t_k), spring and limits (by the safety layer), `write` or `advance` (held until
t_(k+1)). `Rig` is called from Python at each tick; `CompiledIo` and `CompiledRig` are called from compiled loops.

The indices below are compiled into the safety layer and the drivers, which a change of this file compiles anew
(`study.devices.governor.compiling`).
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
"""Slice of a reading: position of the handle by the encoders, m."""
ACCELERATION = slice(3, 6)
"""Slice of a reading: acceleration by the accelerometer, m/s², in the device's axes as mounted, zeroed at rest."""
TRUE_ACCELERATION = slice(6, 9)
"""Slice of a reading: true acceleration of the handle, m/s², known for a simulated device only; for a replay the
recorded acceleration; NaN for others."""
SENSOR_CLIPPED = 9
"""Index in a reading: 1 if a channel of the accelerometer was at its limit, else 0."""
READING_SIZE = 10
"""Number of elements of a reading, shape (READING_SIZE,)."""


class Rig(Protocol):
    """Interface of a device that is driven tick by tick from Python: a real or a scripted device.

    A single thread calls `sense`, `write` and `buttons` in turn. At the end, and while any of these hangs, other
    threads call `write` with zero force, and `close`. A driver must serve these calls even if its library is not made
    for threads, and must exert no force after them.
    """

    @property
    def info(self) -> DeviceInfo:
        """Properties of the device as opened."""
        ...

    @property
    def drops_force_after_s(self) -> float:
        """Time (s) without a `write` after which the hardware drops the force by itself; 0 or infinite: never.

        Only this turns the force off when the program is killed or the computer hangs. The value that is set in the
        device, which may differ from the value requested.
        """
        ...

    def sense(self) -> FloatArray:
        """Read the sensors: a reading, shape (READING_SIZE,). Raises `study.errors.DeviceError` when the device is
        gone."""
        ...

    def buttons(self) -> frozenset[int]:
        """Read the numbers of the pressed buttons. Called after readings: it must not take longer than `sense`."""
        ...

    def write(self, force_n: FloatArray) -> None:
        """Command a force (x, y, z), shape (3,), N; held until the next command. May raise
        `study.errors.DeviceError`."""
        ...

    def close(self) -> bool | None:
        """Switch the force off, then disconnect. Returns False where the device did not accept the command, so that the
        force may still be on. Never raises; may be called again."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class CompiledIo:
    """Compiled `sense` and `write` of a rig's driver: a `Rig` with an attribute `compiled_io` of this type can be
    driven by a compiled loop, without the Python interpreter.

    Both functions do exactly what the rig's methods of the same names do, including errors; the rig's `buttons` may
    then be called from any thread. See `study.devices.drive.compiled_drive` for the signatures."""

    sense: Callable[..., Any]
    """sense(calls, cells, samples, reading): fills reading, shape (READING_SIZE,). Returns 0, or an error code > 0."""
    write: Callable[..., Any]
    """write(calls, cells, force_n): force_n, shape (3,). Returns 0, or an error code > 0."""
    calls: npt.NDArray[np.int64]
    """Addresses of C functions: those of `study.devices.native.collect_system_calls`, followed by those of the
    driver."""
    cells: FloatArray
    """State of the driver, read and changed by `sense` and `write`; its layout is that of the driver."""
    samples: FloatArray
    """Samples of the accelerometer, shape (rows, columns); a single row without one."""
    error: Callable[[int], Exception]
    """error(code): the exception that the rig's method of the same name raises; called in the thread that got the
    code."""


@dataclass(frozen=True, slots=True, eq=False)
class SensedAcceleration:
    """Acceleration by an accelerometer that is read separately from the ticks."""

    acceleration_mps2: FloatArray
    """(k, 3), m/s², as in `ACCELERATION`, at the requested ticks; NaN where it is not known."""
    health: SensorFacts
    """Quality of the readings."""


@runtime_checkable
class AsynchronousAccelerometer(Protocol):
    """Interface of a rig or sensor whose accelerometer samples by a clock other than that of the loop. A reading holds
    its newest sample; the acceleration at the time of a tick is interpolated later."""

    def sensed(self, since_s: float, tick_s: FloatArray, rate_hz: float) -> SensedAcceleration | None:
        """Estimate the acceleration at past ticks. tick_s (k,): due times of the ticks, 1 / rate_hz apart, on the
        loop's clock (s); since_s: start of the interval that `health` describes. None without such a sensor. May be
        called in any thread while nothing moves; may take 0.1 s."""
        ...


def read_no_buttons() -> frozenset[int]:
    """Pressed buttons of a device without buttons: always empty."""
    return frozenset()


def ignore_hand(on_handle: bool) -> None:
    """`CompiledRig.simulate_hand` of a device without a simulated hand: does nothing."""


def skip_preparation(rows: FloatArray, repeats: bool, wait_ticks: int) -> None:
    """`CompiledRig.prepare` of a device that does not use the coming stimulus: does nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class CompiledRig:
    """A simulated device whose `sense` and `advance` are compiled, so that blocks of ticks run without Python."""

    info: DeviceInfo
    state: FloatArray
    """State of the simulation, changed in place by `advance`."""
    parameters: FloatArray
    """Parameters of the simulation."""
    noise: npt.NDArray[np.uint64]
    """State of the sensor's random numbers, changed in place by `sense`."""
    sense: Callable[..., Any]
    """sense(state, parameters, noise, reading): fills reading, shape (READING_SIZE,)."""
    advance: Callable[..., Any]
    """advance(state, parameters, force_n): integrates the motion over a tick under the constant force_n, shape (3,),
    N."""
    buttons: Callable[[], frozenset[int]] = read_no_buttons
    """Numbers of the pressed buttons."""
    prepare: Callable[[FloatArray, bool, int], None] = skip_preparation
    """prepare(rows, repeats, wait_ticks): called before a stimulus begins; used by the replay of a recording, whose
    motion does not depend on the force. rows (n, 3), N: played once or, if `repeats`, repeatedly; the first after
    `wait_ticks` ticks."""
    simulate_hand: Callable[[bool], None] = ignore_hand
    """simulate_hand(on_handle): True: the simulated hand takes the handle; False: it lets go."""

    def close(self) -> None:
        """Nothing to disconnect."""
