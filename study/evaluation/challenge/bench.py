"""Linear part of a simulated device, the bench: a handle with three axes on springs and dampers to the ground, with
oscillators (structural modes) attached. `device` integrates it.

Equation of motion: M d2q/dt2 + C dq/dt + K q = (f, 0), where q holds the positions of the handle and of the
oscillators' masses along their directions, and f is the force on the handle. All ranges of parameters were chosen.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray

MAX_MASS_COUPLING_KG, MAX_STIFFNESS_COUPLING_SHARE = 0.012, 0.03
"""Largest off-diagonal elements: of the mass (kg), and of the stiffness as a fraction of its mean. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Oscillators:
    """Masses on springs and dampers, each moving along a direction fixed to the handle."""

    frequency_hz: FloatArray
    """(k,), natural frequency with the handle fixed"""
    mass_kg: FloatArray
    """(k,)"""
    damping_ratio: FloatArray
    """(k,), fraction of the critical damping with the handle fixed"""
    direction: FloatArray
    """(k, 3), unit vectors"""

    def append_oscillator(
        self, frequency_hz: float, mass_kg: float, damping_ratio: float, direction: FloatArray
    ) -> "Oscillators":
        """Return a copy with a further oscillator. frequency_hz: with the handle fixed; direction: unit vector (3,)."""
        return Oscillators(
            np.append(self.frequency_hz, frequency_hz),
            np.append(self.mass_kg, mass_kg),
            np.append(self.damping_ratio, damping_ratio),
            np.vstack([self.direction, direction]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """Matrices of the handle on its ground, and the oscillators attached to it."""

    mass: FloatArray
    """(3, 3), kg, at the handle"""
    damping: FloatArray
    """(3, 3), N s/m, to the ground"""
    stiffness: FloatArray
    """(3, 3), N/m, to the ground"""
    oscillators: Oscillators

    def assemble_matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Assemble mass (kg), damping (N s/m) and stiffness (N/m) of handle and k oscillators, (3 + k, 3 + k) each."""
        oscillators = self.oscillators
        spring_stiffness = oscillators.mass_kg * (2 * np.pi * oscillators.frequency_hz) ** 2
        damper_coefficient = 2 * oscillators.damping_ratio * np.sqrt(spring_stiffness * oscillators.mass_kg)
        mass = np.zeros((3 + len(spring_stiffness),) * 2)
        mass[:3, :3] = self.mass
        mass[3:, 3:] = np.diag(oscillators.mass_kg)
        return (
            mass,
            _add_oscillators(self.damping, damper_coefficient, oscillators.direction),
            _add_oscillators(self.stiffness, spring_stiffness, oscillators.direction),
        )


def draw_bench(random: np.random.Generator) -> Bench:
    """Draw the bench of a case, with three oscillators. Means and factors are uniformly distributed in the ranges below
    (kg, N s/m, N/m, Hz), the directions of the oscillators on the sphere."""
    mean_mass_kg = random.uniform(0.17, 0.29)
    mass = np.diag(mean_mass_kg * random.uniform(0.92, 1.08, 3)) + _draw_symmetric(random, MAX_MASS_COUPLING_KG)
    mean_stiffness_n_per_m = random.uniform(90.0, 210.0)
    stiffness = np.diag(mean_stiffness_n_per_m * random.uniform(0.6, 1.5, 3)) + _draw_symmetric(
        random, MAX_STIFFNESS_COUPLING_SHARE * mean_stiffness_n_per_m
    )
    directions = random.normal(size=(3, 3))
    oscillators = Oscillators(
        random.uniform((9.5, 77.0, 135.0), (13.2, 110.0, 208.0)),
        mean_mass_kg * random.uniform((0.12, 0.08, 0.06), (0.21, 0.18, 0.14)),
        random.uniform((0.06, 0.022, 0.016), (0.135, 0.047, 0.037)),
        directions / np.linalg.norm(directions, axis=1, keepdims=True),
    )
    return Bench(mass, np.diag(random.uniform(2.6, 6.5, 3)), stiffness, oscillators)


def _draw_symmetric(random: np.random.Generator, limit: float) -> FloatArray:
    """Draw a symmetric matrix (3, 3) with zero diagonal and off-diagonal elements uniform in [-limit, limit)."""
    upper_triangle = np.triu(random.uniform(-limit, limit, (3, 3)), 1)
    symmetric: FloatArray = upper_triangle + upper_triangle.T
    return symmetric


def _add_oscillators(ground: FloatArray, coefficients: FloatArray, direction: FloatArray) -> FloatArray:
    """Add oscillators to a damping or stiffness matrix; returns (3 + k, 3 + k). ground: (3, 3), of the handle to the
    ground; coefficients: (k,), of the oscillators; direction: (k, 3)."""
    coordinate_count = 3 + len(coefficients)
    matrix = np.zeros((coordinate_count, coordinate_count))
    matrix[:3, :3] = ground + direction.T @ np.diag(coefficients) @ direction
    matrix[:3, 3:] = -direction.T * coefficients
    matrix[3:, :3] = matrix[:3, 3:].T
    matrix[3:, 3:] = np.diag(coefficients)
    return matrix
