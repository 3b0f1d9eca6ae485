"""Inertia between the positions of a calibration: each entry a polynomial of the position, by least squares."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from equalizer.linkage.calibration import LinkageCalibration
from equalizer.signals.signal import FloatArray

DEGREES = (4, 3, 2, 1)
SPARE = 2
"""Times as many positions as terms: below it a lower degree is taken."""


@dataclass(frozen=True, slots=True, eq=False)
class InertiaField:
    scale_m: float
    powers: tuple[tuple[int, ...], ...]
    coefficients: FloatArray
    """(terms, 3, 3), kg, of powers of position over scale"""
    misfit: float
    """Largest difference from the calibration, relative to its largest entry."""

    def at(self, place_m: FloatArray) -> FloatArray:
        """(3, 3), kg."""
        values: FloatArray = np.tensordot(
            _terms(np.atleast_2d(place_m) / self.scale_m, self.powers)[0], self.coefficients, 1
        )
        return values

    def slopes(self, place_m: FloatArray) -> FloatArray:
        """(3, 3, 3), kg/m: entry [a] is the derivative of the inertia along axis a."""
        place = np.asarray(place_m) / self.scale_m
        slopes = np.zeros((3, 3, 3))
        for axis in range(3):
            for power, coefficient in zip(self.powers, self.coefficients, strict=True):
                if power[axis]:
                    lowered = [each - (number == axis) for number, each in enumerate(power)]
                    term = power[axis] * math.prod(float(x) ** n for x, n in zip(place, lowered, strict=True))
                    slopes[axis] += term * coefficient / self.scale_m
        return slopes


def fit_inertia_field(calibration: LinkageCalibration) -> InertiaField:
    """Raises ValueError for fewer than eight positions, or such that lie in a plane."""
    positions, inertia = calibration.position_m, calibration.inertia_kg
    scale_m = float(np.linalg.norm(positions, axis=1).max()) or 1.0
    for degree in DEGREES:
        powers = tuple(p for p in itertools.product(range(degree + 1), repeat=3) if sum(p) <= degree)
        terms = _terms(positions / scale_m, powers)
        if len(positions) >= SPARE * len(powers) and np.linalg.matrix_rank(terms) == len(powers):
            found = np.linalg.lstsq(terms, inertia.reshape(len(inertia), 9), rcond=None)[0]
            misfit = float(np.abs(terms @ found - inertia.reshape(len(inertia), 9)).max() / np.abs(inertia).max())
            coefficients: FloatArray = np.asarray(found, dtype=np.float64).reshape(-1, 3, 3)
            return InertiaField(scale_m, powers, coefficients, misfit)
    raise ValueError(f"{len(positions)} positions do not tell how the inertia changes: it takes eight in space")


def _terms(places: FloatArray, powers: tuple[tuple[int, ...], ...]) -> FloatArray:
    """(places, terms)"""
    columns = [np.prod(places ** np.array(power), axis=1) for power in powers]
    terms: FloatArray = np.stack(columns, axis=1)
    return terms
