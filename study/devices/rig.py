"""The rig port: a bare device, without limits. Only the safety layer (`study.devices.safe`) may drive one.

A tick of the 1 kHz loop is: `sense` (at t_k), spring and limits, `write` (held until t_(k+1)).

The places below are compiled into the safety layer, which watches this file, and into the simulated devices, whose
code kept on disk does not: after a change of them, delete the compiled files (`*.nbi`, `*.nbc`) of those.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo

POSITION = slice(0, 3)
"""Slice of a reading with the encoders' position of the handle, m."""
ACCELERATION = slice(3, 6)
"""The accelerometer's reading, m/s², in the device's axes as mounted, zeroed at rest."""
TRUE_ACCELERATION = slice(6, 9)
"""The handle's true acceleration, m/s²: known for a simulated device only, NaN for others."""
SENSOR_CLIPPED = 9
"""1 if a channel of the accelerometer was at its limit, else 0."""
READING_SIZE = 10


class Rig(Protocol):
    """Driven tick by tick from Python: a real or a scripted device.

    One thread calls `sense`, `write` and `buttons` in turn. While one of these hangs, another thread calls `write`
    with a zero force, and `close`: a driver that is not made for that must serve them all the same, and release no
    force after.
    """

    @property
    def info(self) -> DeviceInfo: ...

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

    def close(self) -> None:
        """Force off, disconnect. Never raises; may be called again."""
        ...


def no_buttons() -> frozenset[int]:
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
