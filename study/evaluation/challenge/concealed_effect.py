"""Definition of a concealable effect: how its parameters are drawn for a strength, and how it is built into a device.

The effects themselves are in `effects`; `draw_case` draws them and builds them in.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import Bench
from study.evaluation.challenge.device import Device

Place = Literal["mechanism", "hand", "actuator", "sensor"]
"""Place on the path of the signal, from the command to the recording, at which an effect acts."""
Values = Mapping[str, float]
"""Drawn parameters of an effect, by name."""


@dataclass(frozen=True, slots=True, eq=False)
class EffectContext:
    """Data from which the parameters of an effect are drawn, so that a strength means the same on every bench."""

    random: np.random.Generator
    strength: float
    """0 = weakest, 1 = strongest effect that is drawn; between them, the main parameter is interpolated
    geometrically."""
    bench: Bench
    """Linear dynamics of the device."""
    axis: int
    """Axis at which the effect is built in, 0 to 2."""
    travel_m: FloatArray
    """(3,): largest distance of the handle from the centre, per axis, without the effect (m)."""
    peak_mps2: FloatArray
    """(3,): largest magnitude of the accelerometer's reading, per axis, without the effect (m/s²)."""
    axes: tuple[int, ...] = (0, 1, 2)
    """Driven and measured axes."""

    def interpolate_log(self, weakest: float, strongest: float) -> float:
        """Interpolate geometrically between two values of the same sign by the strength."""
        return float(weakest * (strongest / weakest) ** self.strength)

    def draw_log_uniform(self, lowest: float, highest: float) -> float:
        """Draw a log-uniform random value, independent of the strength; both limits are positive."""
        return float(np.exp(self.random.uniform(np.log(lowest), np.log(highest))))

    def draw_sign(self) -> float:
        """Draw +1 or -1 with equal probability."""
        return float(self.random.choice((-1.0, 1.0)))

    def draw_direction(self) -> FloatArray:
        """Draw a unit vector (3,), uniformly distributed on the sphere."""
        components = self.random.normal(size=3)
        unit_vector: FloatArray = components / np.linalg.norm(components)
        return unit_vector


@dataclass(frozen=True, slots=True)
class ConcealedEffect:
    """An effect that can be concealed."""

    name: str
    """Name in the vocabulary of effects; a decoy (an effect outside the vocabulary) has another name."""
    place: Place
    """Place at which it acts."""
    is_single_axis: bool
    """Whether the effect acts on one axis; otherwise on all."""
    draw: Callable[[EffectContext], dict[str, float]]
    """Draws the parameters, by name: those of the vocabulary, and further parameters that `build` needs."""
    build: Callable[[Device, int, Values], Device]
    """build(device, axis, values): a new device with the effect."""


def replace_cells(table: FloatArray, axis: int | slice, cells: Mapping[int, FloatArray | float]) -> FloatArray:
    """Replace columns of the row or rows `axis` in a copy of a table (3, columns). cells: value, or one per row, by
    column."""
    new_table = table.copy()
    for column, value in cells.items():
        new_table[axis, column] = value
    return new_table


def replace_sensor(device: Device, parameters: Mapping[str, Any]) -> Device:
    """Replace parameters of the sensor, given by name; returns a new device."""
    return replace(device, sensor=replace(device.sensor, **parameters))


def replace_handle_forces(device: Device, axis: int, cells: Mapping[int, float]) -> Device:
    """Replace columns of the position- and velocity-dependent forces of one axis; returns a new device. cells: value by
    column of `handle_force_kernel`."""
    return replace(device, forces=replace_cells(device.forces, axis, cells))


def replace_amplifier_cells(device: Device, axis: int | None, cells: Mapping[int, float]) -> Device:
    """Replace columns of the amplifier of one axis, or of all axes with axis None; returns a new device. cells: value
    by column of `actuator_kernel`."""
    table = device.amplifiers
    for amplifier_axis in range(3) if axis is None else (axis,):
        table = replace_cells(table, amplifier_axis, cells)
    return replace(device, amplifiers=table)
