"""What it takes to conceal one effect: to draw its numbers at a strength, and to build it into a device."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import Bench
from study.evaluation.challenge.device import Device

Place = Literal["mechanism", "hand", "actuator", "sensor"]
Values = Mapping[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Circumstances:
    """What a draw may look at, so that its strengths mean the same on every bench."""

    random: np.random.Generator
    strength: float
    """0 = the weakest that is drawn, 1 = the strongest; the main parameter lies log-uniformly between."""
    bench: Bench
    axis: int
    travel_m: FloatArray
    """(3,): how far the handle moves from the centre where nothing is concealed."""
    peak_mps2: FloatArray
    """(3,): the largest reading there."""
    axes: tuple[int, ...] = (0, 1, 2)
    """Those that are driven and read."""

    def between(self, weakest: float, strongest: float) -> float:
        return float(weakest * (strongest / weakest) ** self.strength)

    def some(self, lowest: float, highest: float) -> float:
        """Log-uniform, whatever the strength."""
        return float(np.exp(self.random.uniform(np.log(lowest), np.log(highest))))

    def sign(self) -> float:
        return float(self.random.choice((-1.0, 1.0)))

    def direction(self) -> FloatArray:
        drawn = self.random.normal(size=3)
        unit: FloatArray = drawn / np.linalg.norm(drawn)
        return unit


@dataclass(frozen=True, slots=True)
class HiddenEffect:
    name: str
    """Of the vocabulary, or of its own where it lies outside."""
    place: Place
    of_axis: bool
    """It sits at one axis; else all share it."""
    draw: Callable[[Circumstances], dict[str, float]]
    """Numbers by name: those of the vocabulary, and what else `build` needs."""
    build: Callable[[Device, int, Values], Device]


def with_cells(table: FloatArray, axis: int, cells: Mapping[int, float]) -> FloatArray:
    """A copy with these columns of the axis's row set."""
    changed = table.copy()
    for column, value in cells.items():
        changed[axis, column] = value
    return changed


def with_forces(device: Device, axis: int, cells: Mapping[int, float]) -> Device:
    return replace(device, forces=with_cells(device.forces, axis, cells))


def with_amplifier(device: Device, axis: int | None, cells: Mapping[int, float]) -> Device:
    """None: the amplifiers of all axes."""
    table = device.amplifiers
    for index in range(3) if axis is None else (axis,):
        table = with_cells(table, index, cells)
    return replace(device, amplifiers=table)
