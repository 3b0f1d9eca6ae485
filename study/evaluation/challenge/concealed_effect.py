"""Definition of a concealable effect: how its parameters are drawn for a strength, and how it is built into a
device."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import Bench
from study.evaluation.challenge.device import Device

Place = Literal["mechanism", "hand", "actuator", "sensor"]
"""Where an effect acts on the way from the command to the record."""
Values = Mapping[str, float]
"""Drawn parameters of an effect, by name."""


@dataclass(frozen=True, slots=True, eq=False)
class EffectContext:
    """What a draw may use, so that a strength means the same on every bench."""

    random: np.random.Generator
    strength: float
    """0 = weakest that is drawn, 1 = strongest; the main parameter lies log-uniformly between."""
    bench: Bench
    axis: int
    travel_m: FloatArray
    """(3,): largest distance of the handle from the centre without the effect."""
    peak_mps2: FloatArray
    """(3,): largest reading without the effect."""
    axes: tuple[int, ...] = (0, 1, 2)
    """Driven and read axes."""

    def log_between(self, weakest: float, strongest: float) -> float:
        """Geometric interpolation between two values by the strength."""
        return float(weakest * (strongest / weakest) ** self.strength)

    def draw_log_uniform(self, lowest: float, highest: float) -> float:
        """Log-uniform random value, independent of the strength."""
        return float(np.exp(self.random.uniform(np.log(lowest), np.log(highest))))

    def sign(self) -> float:
        """+1 or -1 with equal probability."""
        return float(self.random.choice((-1.0, 1.0)))

    def direction(self) -> FloatArray:
        """Unit vector (3,), uniformly distributed."""
        drawn = self.random.normal(size=3)
        unit: FloatArray = drawn / np.linalg.norm(drawn)
        return unit


@dataclass(frozen=True, slots=True)
class ConcealedEffect:
    """One effect that can be concealed."""

    name: str
    """Name in the vocabulary; a name of its own for a decoy."""
    place: Place
    of_axis: bool
    """Whether the effect acts on one axis; otherwise on all."""
    draw: Callable[[EffectContext], dict[str, float]]
    """Parameters by name: those of the vocabulary, and what else `build` needs."""
    build: Callable[[Device, int, Values], Device]


def with_cells(table: FloatArray, axis: int, cells: Mapping[int, float]) -> FloatArray:
    """A copy of the table with these columns of the axis's row set."""
    changed = table.copy()
    for column, value in cells.items():
        changed[axis, column] = value
    return changed


def with_forces(device: Device, axis: int, cells: Mapping[int, float]) -> Device:
    """The device with these columns of position- and velocity-dependent forces set on one axis."""
    return replace(device, forces=with_cells(device.forces, axis, cells))


def with_amplifier(device: Device, axis: int | None, cells: Mapping[int, float]) -> Device:
    """The device with these amplifier columns set; axis None: on all axes."""
    table = device.amplifiers
    for index in range(3) if axis is None else (axis,):
        table = with_cells(table, index, cells)
    return replace(device, amplifiers=table)
