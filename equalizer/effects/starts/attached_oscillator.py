"""An oscillator attached to a model (mass, spring, damper), and its estimation from the missing force's spectrum."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import cross_density, spectral_density

WINDOW_S, DRIVEN, CHANCE = 2.0, 1e-4, 0.02
"""Window of a spectrum in seconds; least power of a line, relative to the largest; share of the missing force that the
best of all trials explains by chance."""

SPANNED = 1e-9
"""Relative singular value below which directions are linearly dependent (rounding)."""


def with_oscillator(
    model: MechanicalModel, along: FloatArray, mass: float, damping: float, stiffness: float
) -> MechanicalModel:
    """The model with an oscillator as its last coordinate; unchanged for mass 0. along: (n,), the direction in the
    coordinates to which it is tied."""
    if mass <= 0:
        return model
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
    """Power spectrum of the acceleration."""
    cross: ComplexArray
    """(lines, m): cross-spectra of the acceleration with the missing force at each axis."""


def estimate_missing_mass(evidence: Evidence, axis: int) -> MissingMass:
    """Welch spectra of an axis's acceleration and of the missing force at all axes, at the lines below 0.45 of the
    sample rate where the acceleration has more than DRIVEN of its largest power."""
    rate, used = evidence.sample_rate_hz, evidence.used[:, None]
    acceleration = np.gradient(evidence.axis_velocity, 1 / rate, axis=0) * used
    window = min(int(WINDOW_S * rate), len(used))
    own, force = acceleration[:, axis], (evidence.axis_force * used).T
    frequency, power = spectral_density(own, rate, window)
    cross = np.array([cross_density(own, row, rate, window)[1] for row in force]).T
    inside = (frequency > 0) & (frequency < 0.45 * rate) & (power > DRIVEN * power.max())
    return MissingMass(frequency[inside], power[inside], cross[inside])


def oscillator_reaction(frequency_hz: FloatArray, natural_hz: float | FloatArray, damping_ratio: float) -> ComplexArray:
    """Reaction force of an oscillator on its host per unit mass and host acceleration (negative); the arguments are
    broadcast."""
    ratio = frequency_hz / natural_hz
    tied = 1 + 2j * damping_ratio * ratio
    return np.asarray(-tied / (tied - ratio**2))


@dataclass(frozen=True, slots=True, eq=False)
class AttachedOscillator:
    """An oscillator fitted to the missing force."""

    natural_hz: float
    damping_ratio: float
    mass: float
    explained: float
    by_axis: FloatArray
    """(m,): its force on each axis relative to that on its own axis."""


def _orthonormal_basis(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of the columns' span."""
    directions, sizes, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(directions[:, sizes > SPANNED * sizes[0]])


def likely_oscillators(
    missing: MissingMass, axis: int, natural_hz: Sequence[float], damping_ratios: Sequence[float]
) -> list[AttachedOscillator]:
    """Oscillators of all damping ratios and natural frequencies, likeliest first: those with positive mass that explain
    more than chance, below the highest driven frequency. axis: index of the axis they are tied to."""
    if not len(missing.frequency_hz):
        return []
    root = np.sqrt(np.maximum(missing.power, np.finfo(float).tiny))
    wave = 2j * np.pi * missing.frequency_hz
    linear = np.stack([np.ones_like(wave), 1 / wave, 1 / wave**2], axis=1) * root[:, None]
    force = missing.cross / root[:, None]
    aim = np.vstack([force.real, force.imag])
    linear = np.vstack([linear.real, linear.imag])
    beside = _orthonormal_basis(linear)
    alone = aim - beside @ (beside.T @ aim)
    power = max(float(alone[:, axis] @ alone[:, axis]), np.finfo(float).tiny)
    natural = np.array([item for item in natural_hz if item < missing.frequency_hz[-1]])
    found = []
    for ratio in damping_ratios:
        shape = oscillator_reaction(missing.frequency_hz[:, None], natural, ratio) * root[:, None]
        shapes = np.vstack([shape.real, shape.imag])
        # Orthogonal to what the linear parameters explain: the least-squares fit of a shape is then independent of
        # them.
        own = shapes - beside @ (beside.T @ shapes)
        size = np.einsum("lt,lt->t", own, own)
        apart = size > SPANNED**2 * np.einsum("lt,lt->t", shapes, shapes)
        reactions = own[:, apart].T @ alone
        for each, reaction, square in zip(natural[apart].tolist(), reactions, size[apart].tolist(), strict=True):
            if reaction[axis] > 0:
                explained = float(reaction[axis]) ** 2 / square / power
                by_axis = reaction / reaction[axis]
                found.append(AttachedOscillator(each, ratio, float(reaction[axis]) / square, explained, by_axis))
    return sorted((item for item in found if item.explained > CHANCE), key=lambda item: -item.explained)


def subtract_oscillator(missing: MissingMass, each: AttachedOscillator) -> MissingMass:
    """The missing force less that of an oscillator."""
    relative = oscillator_reaction(missing.frequency_hz, each.natural_hz, each.damping_ratio)
    reaction = missing.power * each.mass * relative
    return MissingMass(missing.frequency_hz, missing.power, missing.cross - reaction[:, None] * each.by_axis)
