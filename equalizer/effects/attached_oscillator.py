"""A mass on a spring and a damper that hangs on a model, and how it shows in the missing force."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import csd

from equalizer.effects.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

WINDOW_S = 2.0


def with_oscillator(
    model: MechanicalModel, along: FloatArray, mass: float, damping: float, stiffness: float
) -> MechanicalModel:
    """One more coordinate, the last. along: (n,), the direction in the coordinates to which it is tied."""
    tie = np.append(-along, 1.0)
    grown = {name: np.pad(getattr(model, name), ((0, 1), (0, 1))) for name in ("mass", "damping", "stiffness")}
    grown["mass"][-1, -1] = mass
    return replace(
        model,
        mass=grown["mass"],
        damping=grown["damping"] + damping * np.outer(tie, tie),
        stiffness=grown["stiffness"] + stiffness * np.outer(tie, tie),
        input=np.pad(model.input, ((0, 1), (0, 0))),
        output=np.pad(model.output, ((0, 0), (0, 1))),
    )


@dataclass(frozen=True, slots=True, eq=False)
class MissingMass:
    """Spectra of the missing force against an axis's acceleration; (lines,)."""

    frequency_hz: FloatArray
    power: FloatArray
    """Of the acceleration."""
    cross: ComplexArray
    """(lines, m): of the acceleration with the missing force at each axis."""


def missing_mass(evidence: Evidence, axis: int) -> MissingMass:
    rate, used = evidence.sample_rate_hz, evidence.used[:, None]
    acceleration = np.gradient(evidence.axis_velocity, 1 / rate, axis=0) * used
    window = min(int(WINDOW_S * rate), len(used))
    own, force = acceleration[:, axis], (evidence.axis_force * used).T
    frequency, power = csd(own, own, rate, nperseg=window)
    cross = np.array([csd(own, row, rate, nperseg=window)[1] for row in force]).T
    inside = (frequency > 0) & (frequency < 0.45 * rate)
    return MissingMass(frequency[inside], power[inside].real, cross[inside])


def hanging(frequency_hz: FloatArray, natural_hz: float, damping_ratio: float) -> ComplexArray:
    """(lines,): the force on its host per acceleration and mass of an oscillator, negative."""
    ratio = frequency_hz / natural_hz
    tied = 1 + 2j * damping_ratio * ratio
    return np.asarray(-tied / (tied - ratio**2))


@dataclass(frozen=True, slots=True, eq=False)
class Hung:
    """The oscillator that explains most."""

    natural_hz: float
    damping_ratio: float
    mass: float
    explained: float
    by_axis: FloatArray
    """(m,): its pull on each axis over that on the own one."""


def hung(seen: MissingMass, axis: int, natural_hz: Sequence[float], damping_ratios: Sequence[float]) -> list[Hung]:
    """The best of each damping ratio and natural frequency, likeliest first; only masses above zero."""
    root = np.sqrt(np.maximum(seen.power, np.finfo(float).tiny))
    wave = 2j * np.pi * seen.frequency_hz
    linear = np.stack([np.ones_like(wave), 1 / wave, 1 / wave**2], axis=1) * root[:, None]
    force = seen.cross / root[:, None]
    found = []
    for ratio in damping_ratios:
        for natural in natural_hz:
            shape = hanging(seen.frequency_hz, natural, ratio) * root
            columns = np.column_stack([shape, linear])
            stacked = np.vstack([columns.real, columns.imag])
            size = np.linalg.norm(stacked, axis=0)
            aim = np.vstack([force.real, force.imag])
            strengths, *_ = np.linalg.lstsq(stacked / size, aim, rcond=1e-9)
            rest = aim[:, axis] - stacked / size @ strengths[:, axis]
            mass = strengths[0, axis] / size[0]
            if mass > 0:
                explained = 1 - float(rest @ rest / max(aim[:, axis] @ aim[:, axis], np.finfo(float).tiny))
                pulls = np.asarray(strengths[0] / strengths[0, axis])
                found.append(Hung(natural, ratio, float(mass), explained, pulls))
    return sorted(found, key=lambda one: -one.explained)


def without(seen: MissingMass, one: Hung) -> MissingMass:
    """What an oscillator leaves of the missing force."""
    pull = seen.power * one.mass * hanging(seen.frequency_hz, one.natural_hz, one.damping_ratio)
    return MissingMass(seen.frequency_hz, seen.power, seen.cross - pull[:, None] * one.by_axis)
