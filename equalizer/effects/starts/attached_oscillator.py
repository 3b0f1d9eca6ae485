"""An oscillator (mass on spring and damper) attached to a model, and its estimation from the missing force.

An oscillator of mass m, natural frequency f0 and damping ratio z, attached to a host with acceleration a, exerts on the
host at the frequency f the force

    F = -m a (1 + 2j z r) / (1 + 2j z r - r²),        r = f / f0

The missing force is what must be added at the driven axes so that the re-tuned model moves as measured. Per trial (f0,
z) the mass follows by weighted least squares from the missing force F and the acceleration a, together with corrections
of the model's own mass, damping and stiffness, since F = dM a + dB a / (2j pi f) + dK a / (2j pi f)² may be mere
mistuning. Trials are ranked by the share of the missing force that they explain beyond those corrections. The estimates
only start a fit of the whole model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import estimate_cross_density, estimate_spectral_density

WINDOW_S = 2.0
"""Window of the spectra (s), at most the recording: lines 0.5 Hz apart. Chosen."""
LEAST_POWER_SHARE = 1e-4
"""Least power of a line that is used, relative to the largest line. Chosen."""
CHANCE_SHARE = 0.02
"""Share of the missing force's power, less what the model's linear parameters explain, that the best of all trials
explains by chance. Chosen."""
RANK_TOLERANCE = 1e-9
"""Relative singular value, or norm, below which vectors count as linearly dependent (rounding)."""


def attach_oscillator(
    model: MechanicalModel, direction: FloatArray, mass: float, damping: float, stiffness: float
) -> MechanicalModel:
    """Attach an oscillator to the model as its last coordinate; the model is unchanged for a mass of 0 or below.

    direction: (n,), direction in the model's coordinates along which it is attached. mass (kg), damping (N s/m),
    stiffness (N/m): of the oscillator.
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
    """Spectra of the acceleration a of one driven axis and of the missing force F at all m driven axes."""

    frequency_hz: FloatArray
    """(lines,): frequencies of the lines that are used."""
    power: FloatArray
    """(lines,): power spectral density of the acceleration, (m/s²)²/Hz."""
    cross: ComplexArray
    """(lines, m): cross spectral densities conj(a) F with the missing force at each axis."""


def estimate_missing_force_spectra(evidence: Evidence, axis: int) -> MissingForceSpectra:
    """Estimate the Welch spectra of the acceleration of an axis and of the missing force at all axes, at the lines
    between 0 and 0.45 (chosen) of the sample rate where the acceleration has more than `LEAST_POWER_SHARE` of its
    largest power."""
    sample_rate_hz, is_used = evidence.sample_rate_hz, evidence.used[:, None]
    acceleration = np.gradient(evidence.axis_velocity, 1 / sample_rate_hz, axis=0) * is_used
    window_samples = min(int(WINDOW_S * sample_rate_hz), len(is_used))
    axis_acceleration, force = acceleration[:, axis], (evidence.axis_force * is_used).T
    frequency_hz, power = estimate_spectral_density(axis_acceleration, sample_rate_hz, window_samples)
    cross = np.array(
        [
            estimate_cross_density(axis_acceleration, axis_force, sample_rate_hz, window_samples)[1]
            for axis_force in force
        ]
    ).T
    is_selected = (
        (frequency_hz > 0) & (frequency_hz < 0.45 * sample_rate_hz) & (power > LEAST_POWER_SHARE * power.max())
    )
    return MissingForceSpectra(frequency_hz[is_selected], power[is_selected], cross[is_selected])


def compute_unit_reaction(
    frequency_hz: FloatArray, natural_hz: float | FloatArray, damping_ratio: float
) -> ComplexArray:
    """Compute the force of an oscillator on its host per unit of its mass and of the host's acceleration, F / (m a) in
    the equation above; the arguments are broadcast."""
    ratio = frequency_hz / natural_hz
    spring_and_damper = 1 + 2j * damping_ratio * ratio
    return np.asarray(-spring_and_damper / (spring_and_damper - ratio**2))


@dataclass(frozen=True, slots=True, eq=False)
class AttachedOscillator:
    """An oscillator fitted to the missing force."""

    natural_hz: float
    """Natural frequency of the oscillator on the fixed host."""
    damping_ratio: float
    mass: float
    """kg; kg m² on a rotational axis."""
    explained_share: float
    """Share, 0 to 1, that it explains of the missing force's power on its axis which the model's linear parameters
    leave."""
    by_axis: FloatArray
    """(m,): its force on each axis relative to that on its own axis."""


def _compute_orthonormal_basis(columns: FloatArray) -> FloatArray:
    """Compute an orthonormal basis (n, rank) of the span of columns (n, k)."""
    left_vectors, singular_values, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(left_vectors[:, singular_values > RANK_TOLERANCE * singular_values[0]])


def find_likely_oscillators(
    missing: MissingForceSpectra, axis: int, natural_hz: Sequence[float], damping_ratios: Sequence[float]
) -> list[AttachedOscillator]:
    """Fit an oscillator for each pair of a damping ratio and a natural frequency (Hz), and list those that explain most
    first.

    Left out are those whose fitted mass is not positive, those that explain no more than `CHANCE_SHARE`, those that
    corrections of the linear parameters reproduce, and natural frequencies from the highest line on. axis: index of the
    axis to which they are attached.
    """
    if not len(missing.frequency_hz):
        return []
    weight = np.sqrt(np.maximum(missing.power, np.finfo(float).tiny))
    s = 2j * np.pi * missing.frequency_hz
    linear_terms = np.stack([np.ones_like(s), 1 / s, 1 / s**2], axis=1) * weight[:, None]
    force = missing.cross / weight[:, None]
    target = np.vstack([force.real, force.imag])
    basis = _compute_orthonormal_basis(np.vstack([linear_terms.real, linear_terms.imag]))
    unexplained_force = target - basis @ (basis.T @ target)
    unexplained_power = max(float(unexplained_force[:, axis] @ unexplained_force[:, axis]), np.finfo(float).tiny)
    trials_hz = np.array([trial_hz for trial_hz in natural_hz if trial_hz < missing.frequency_hz[-1]])
    oscillators = []
    for damping_ratio in damping_ratios:
        spectrum = compute_unit_reaction(missing.frequency_hz[:, None], trials_hz, damping_ratio) * weight[:, None]
        spectra = np.vstack([spectrum.real, spectrum.imag])
        # Projected orthogonally to the linear terms (Frisch-Waugh): each trial can then be fitted by itself.
        projected = spectra - basis @ (basis.T @ spectra)
        square_norms = np.einsum("lt,lt->t", projected, projected)
        is_independent = square_norms > RANK_TOLERANCE**2 * np.einsum("lt,lt->t", spectra, spectra)
        reactions = projected[:, is_independent].T @ unexplained_force
        for frequency_hz, reaction, square_norm in zip(
            trials_hz[is_independent].tolist(), reactions, square_norms[is_independent].tolist(), strict=True
        ):
            if reaction[axis] > 0:
                explained_share = float(reaction[axis]) ** 2 / square_norm / unexplained_power
                by_axis = reaction / reaction[axis]
                oscillators.append(
                    AttachedOscillator(
                        frequency_hz, damping_ratio, float(reaction[axis]) / square_norm, explained_share, by_axis
                    )
                )
    return sorted(
        (oscillator for oscillator in oscillators if oscillator.explained_share > CHANCE_SHARE),
        key=lambda oscillator: -oscillator.explained_share,
    )


def subtract_oscillator(missing: MissingForceSpectra, oscillator: AttachedOscillator) -> MissingForceSpectra:
    """Subtract the force of an oscillator from the missing force at all axes; returns the remaining spectra."""
    unit_reaction = compute_unit_reaction(missing.frequency_hz, oscillator.natural_hz, oscillator.damping_ratio)
    axis_reaction = missing.power * oscillator.mass * unit_reaction
    return MissingForceSpectra(
        missing.frequency_hz, missing.power, missing.cross - axis_reaction[:, None] * oscillator.by_axis
    )
