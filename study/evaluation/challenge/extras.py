"""What every real device has a little of, and no label names: four small things, other ones on every device.

At a factor of 1 they change the readings by about a tenth of their noise; the factor is that of each thing's size.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.friction_kernel import NEGATIVE, POSITIVE, STIFFNESS
from study.evaluation.challenge.handle_force_kernel import CUBE, DRAG, PHASE, PITCH, RIPPLE

Extra = Callable[[Device, float, np.random.Generator], Device]
COUNT = 4


def with_extras(device: Device, factor: float, seed: int) -> Device:
    """The same seed gives the same things; factor 0 leaves the device alone."""
    if factor == 0.0:
        return device
    random = np.random.default_rng([seed, 977])
    for number in random.choice(len(EXTRAS), COUNT, replace=False):
        device = EXTRAS[number](device, factor, random)
    return device


def _added(table: FloatArray, cells: dict[int, FloatArray | float]) -> FloatArray:
    changed = table.copy()
    for column, values in cells.items():
        changed[:, column] = values
    return changed


def _rubbing(device: Device, factor: float, random: np.random.Generator) -> Device:
    level = factor * random.uniform(0.25e-4, 1e-4, 3)
    return replace(device, friction=_added(device.friction, {STIFFNESS: 3e5, POSITIVE: level, NEGATIVE: level}))


def _ripple(device: Device, factor: float, random: np.random.Generator) -> Device:
    cells = {
        RIPPLE: factor * random.uniform(0.5e-4, 2e-4, 3),
        PITCH: random.uniform(7e-4, 3e-3, 3),
        PHASE: random.uniform(0.0, 2 * np.pi, 3),
    }
    return replace(device, forces=_added(device.forces, dict(cells)))


def _hardening(device: Device, factor: float, random: np.random.Generator) -> Device:
    return replace(device, forces=_added(device.forces, {CUBE: factor * random.uniform(-40.0, 40.0, 3)}))


def _drag(device: Device, factor: float, random: np.random.Generator) -> Device:
    return replace(device, forces=_added(device.forces, {DRAG: factor * random.uniform(0.0, 0.004, 3)}))


def _modes_off(device: Device, factor: float, random: np.random.Generator) -> Device:
    parts = device.bench.oscillators
    off = 1.0 + factor * random.uniform(-4e-4, 4e-4, parts.frequency_hz.shape)
    return replace(
        device, bench=replace(device.bench, oscillators=replace(parts, frequency_hz=off * parts.frequency_hz))
    )


def _crossed(device: Device, factor: float, random: np.random.Generator) -> Device:
    mixing = device.sensor.orientation + factor * random.uniform(-3e-3, 3e-3, (3, 3)) * (1.0 - np.eye(3))
    return replace(device, sensor=replace(device.sensor, orientation=mixing))


def _humming(device: Device, factor: float, random: np.random.Generator) -> Device:
    return replace(device, sensor=replace(device.sensor, hum=factor * random.uniform(-0.004, 0.004, (2, 3))))


EXTRAS: tuple[Extra, ...] = (_rubbing, _ripple, _hardening, _drag, _modes_off, _crossed, _humming)
