"""An oscillator (mass on spring and damper) attached to a model, and its estimation from the missing force.

An oscillator of mass m, natural frequency f0 and damping ratio z, attached to a host with acceleration a, exerts on the
host at the frequency f the force

    F = -m a (1 + 2j z r) / (1 + 2j z r - r²),        r = f / f0

The missing force is what must be added at the driven axes so that the re-tuned model moves as measured. Per trial
(f0, z) the mass follows by weighted least squares from the missing force F and the acceleration a, together with
corrections of the model's own mass, damping and stiffness, since F = dM a + dB a / (2j pi f) + dK a / (2j pi f)² may be
mere mistuning. Trials are ranked by the share of the missing force that they explain beyond those corrections. The
estimates only start a fit of the whole model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import estimate_cross_density, estimate_spectral_density

WINDOW_S = 2.0
"""Window of the spectra (s): lines 0.5 Hz apart."""
LEAST_POWER_SHARE = 1e-4
"""Least power of a line that is used, relative to the largest line. By hand."""
CHANCE_SHARE = 0.02
"""Share of the missing force's power that the best of all trials explains by chance. By hand."""
RANK_TOLERANCE = 1e-9
"""Relative singular value, or norm, below which vectors count as linearly dependent (rounding)."""


def with_oscillator(
    model: MechanicalModel, direction: FloatArray, mass: float, damping: float, stiffness: float
) -> MechanicalModel:
    """The model with an oscillator as its last coordinate; unchanged for mass 0 or below.

    direction: (n,), direction in the model's coordinates along which it is attached. mass, damping, stiffness: SI.
    """
    if mass <= 0:
        return model
    relative_direction = np.append(-direction, 1.0)
    matrices = {name: np.pad(getattr(model, name), ((0, 1), (0, 1))) for name in ("mass", "damping", "stiffness")}
    matrices["mass"][-1, -1] = mass
    return replace(
        model,
        mass=matrices["mass"],
        damping=matrices["damping"] + damping * np.outer(relative_direction, relative_direction),
        stiffness=matrices["stiffness"] + stiffness * np.outer(relative_direction, relative_direction),
        input=np.pad(model.input, ((0, 1), (0, 0))),
        output=np.pad(model.output, ((0, 0), (0, 1))),
    )


@dataclass(frozen=True, slots=True, eq=False)
class MissingForceSpectra:
    """Spectra of an axis's acceleration a and of the missing force F at all m driven axes."""

    frequency_hz: FloatArray
    """(lines,): frequencies of the lines that are used."""
    power: FloatArray
    """(lines,): power spectral density of the acceleration."""
    cross: ComplexArray
    """(lines, m): cross spectral densities conj(a) F with the missing force at each axis."""


def missing_force_spectra(evidence: Evidence, axis: int) -> MissingForceSpectra:
    """Welch spectra of the acceleration of an axis and of the missing force at all axes, at the lines below 0.45 of the
    sample rate where the acceleration has more than `LEAST_POWER_SHARE` of its largest power."""
    rate, used = evidence.sample_rate_hz, evidence.used[:, None]
    acceleration = np.gradient(evidence.axis_velocity, 1 / rate, axis=0) * used
    window = min(int(WINDOW_S * rate), len(used))
    axis_acceleration, force = acceleration[:, axis], (evidence.axis_force * used).T
    frequency, power = estimate_spectral_density(axis_acceleration, rate, window)
    cross = np.array([estimate_cross_density(axis_acceleration, row, rate, window)[1] for row in force]).T
    selected = (frequency > 0) & (frequency < 0.45 * rate) & (power > LEAST_POWER_SHARE * power.max())
    return MissingForceSpectra(frequency[selected], power[selected], cross[selected])


def oscillator_reaction(frequency_hz: FloatArray, natural_hz: float | FloatArray, damping_ratio: float) -> ComplexArray:
    """Force of an oscillator on its host per unit of its mass and of the host's acceleration, F / (m a) in the equation
    above; the arguments are broadcast."""
    ratio = frequency_hz / natural_hz
    spring_and_damper = 1 + 2j * damping_ratio * ratio
    return np.asarray(-spring_and_damper / (spring_and_damper - ratio**2))


@dataclass(frozen=True, slots=True, eq=False)
class AttachedOscillator:
    """An oscillator fitted to the missing force."""

    natural_hz: float
    damping_ratio: float
    mass: float
    """kg; kg m² on a rotational axis."""
    explained_share: float
    """Share, 0 to 1, of the missing force's power on its axis that it explains beyond the model's linear parameters."""
    by_axis: FloatArray
    """(m,): its force on each axis relative to that on its own axis."""


def _orthonormal_basis(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of the columns' span."""
    directions, sizes, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(directions[:, sizes > RANK_TOLERANCE * sizes[0]])


def likely_oscillators(
    missing: MissingForceSpectra, axis: int, natural_hz: Sequence[float], damping_ratios: Sequence[float]
) -> list[AttachedOscillator]:
    """An oscillator for each pair of a damping ratio and a natural frequency (Hz), the one that explains most first.

    Left out are those of negative mass, those that explain no more than `CHANCE_SHARE`, and natural frequencies above
    the highest line. axis: index of the axis to which they are attached."""
    if not len(missing.frequency_hz):
        return []
    root = np.sqrt(np.maximum(missing.power, np.finfo(float).tiny))
    omega = 2j * np.pi * missing.frequency_hz
    linear = np.stack([np.ones_like(omega), 1 / omega, 1 / omega**2], axis=1) * root[:, None]
    force = missing.cross / root[:, None]
    target = np.vstack([force.real, force.imag])
    basis = _orthonormal_basis(np.vstack([linear.real, linear.imag]))
    unexplained = target - basis @ (basis.T @ target)
    power = max(float(unexplained[:, axis] @ unexplained[:, axis]), np.finfo(float).tiny)
    trial_frequencies_hz = np.array([value for value in natural_hz if value < missing.frequency_hz[-1]])
    oscillators = []
    for ratio in damping_ratios:
        shape = oscillator_reaction(missing.frequency_hz[:, None], trial_frequencies_hz, ratio) * root[:, None]
        shapes = np.vstack([shape.real, shape.imag])
        # Projected orthogonally to the linear terms (Frisch-Waugh): each shape can then be fitted by itself.
        projected = shapes - basis @ (basis.T @ shapes)
        square_norms = np.einsum("lt,lt->t", projected, projected)
        independent = square_norms > RANK_TOLERANCE**2 * np.einsum("lt,lt->t", shapes, shapes)
        reactions = projected[:, independent].T @ unexplained
        for frequency_hz, reaction, square_norm in zip(
            trial_frequencies_hz[independent].tolist(), reactions, square_norms[independent].tolist(), strict=True
        ):
            if reaction[axis] > 0:
                explained = float(reaction[axis]) ** 2 / square_norm / power
                by_axis = reaction / reaction[axis]
                oscillators.append(
                    AttachedOscillator(frequency_hz, ratio, float(reaction[axis]) / square_norm, explained, by_axis)
                )
    return sorted(
        (value for value in oscillators if value.explained_share > CHANCE_SHARE),
        key=lambda value: -value.explained_share,
    )


def subtract_oscillator(missing: MissingForceSpectra, oscillator: AttachedOscillator) -> MissingForceSpectra:
    """The spectra with the force of an oscillator subtracted from the missing force."""
    relative = oscillator_reaction(missing.frequency_hz, oscillator.natural_hz, oscillator.damping_ratio)
    reaction = missing.power * oscillator.mass * relative
    return MissingForceSpectra(
        missing.frequency_hz, missing.power, missing.cross - reaction[:, None] * oscillator.by_axis
    )
