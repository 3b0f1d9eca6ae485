"""Small unmodelled effects that every real device has and that no label names: four per device, drawn from seven.

At factor 1 they change the readings by about a tenth of the noise; the factor scales the size of each.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.friction_kernel import NEGATIVE, POSITIVE, STIFFNESS
from study.evaluation.challenge.handle_force_kernel import CUBE, DRAG, PHASE, PITCH, RIPPLE

Extra = Callable[[Device, float, np.random.Generator], Device]
"""extra(device, factor, random): the device with it, of a random size."""
COUNT = 4
"""Unlabelled effects per device."""


def with_extras(device: Device, factor: float, seed: int) -> Device:
    """The device with four drawn extras. The same seed gives the same ones; factor 0 leaves the device as it is."""
    if factor == 0.0:
        return device
    random = np.random.default_rng([seed, 977])
    for number in random.choice(len(EXTRAS), COUNT, replace=False):
        device = EXTRAS[number](device, factor, random)
    return device


def _with_columns(table: FloatArray, cells: dict[int, FloatArray | float]) -> FloatArray:
    """A copy of the table with these columns set."""
    changed = table.copy()
    for column, values in cells.items():
        changed[:, column] = values
    return changed


def _add_friction(device: Device, factor: float, random: np.random.Generator) -> Device:
    level = factor * random.uniform(0.25e-4, 1e-4, 3)
    return replace(device, friction=_with_columns(device.friction, {STIFFNESS: 3e5, POSITIVE: level, NEGATIVE: level}))


def _add_ripple(device: Device, factor: float, random: np.random.Generator) -> Device:
    cells = {
        RIPPLE: factor * random.uniform(0.5e-4, 2e-4, 3),
        PITCH: random.uniform(7e-4, 3e-3, 3),
        PHASE: random.uniform(0.0, 2 * np.pi, 3),
    }
    return replace(device, forces=_with_columns(device.forces, dict(cells)))


def _add_hardening(device: Device, factor: float, random: np.random.Generator) -> Device:
    return replace(device, forces=_with_columns(device.forces, {CUBE: factor * random.uniform(-40.0, 40.0, 3)}))


def _add_drag(device: Device, factor: float, random: np.random.Generator) -> Device:
    return replace(device, forces=_with_columns(device.forces, {DRAG: factor * random.uniform(0.0, 0.004, 3)}))


def _shift_modes(device: Device, factor: float, random: np.random.Generator) -> Device:
    parts = device.bench.oscillators
    off = 1.0 + factor * random.uniform(-4e-4, 4e-4, parts.frequency_hz.shape)
    return replace(
        device, bench=replace(device.bench, oscillators=replace(parts, frequency_hz=off * parts.frequency_hz))
    )


def _mix_channels(device: Device, factor: float, random: np.random.Generator) -> Device:
    mixing = device.sensor.orientation + factor * random.uniform(-3e-3, 3e-3, (3, 3)) * (1.0 - np.eye(3))
    return replace(device, sensor=replace(device.sensor, orientation=mixing))


def _add_hum(device: Device, factor: float, random: np.random.Generator) -> Device:
    return replace(device, sensor=replace(device.sensor, hum=factor * random.uniform(-0.004, 0.004, (2, 3))))


EXTRAS: tuple[Extra, ...] = (
    _add_friction,
    _add_ripple,
    _add_hardening,
    _add_drag,
    _shift_modes,
    _mix_channels,
    _add_hum,
)
"""Extras that are drawn from."""
