"""The forces that would explain a residual, and how much of it each of them does."""

import numpy as np

from analysis.diagnosis.residual_spectra import ResidualSpectra
from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

_TINY = np.finfo(np.float64).tiny


def equivalent_forces(spectra: ResidualSpectra, directions: ComplexArray) -> ComplexArray:
    """(experiments, lines, k): weighted least squares. directions: (lines, channels, k), as in `Entry`."""
    root = np.sqrt(np.maximum(spectra.noise, _TINY))
    solved = np.linalg.pinv(directions[None] / root[..., None]) @ (spectra.residual / root)[..., None]
    return np.asarray(solved[..., 0], dtype=np.complex128)


def force_shares(spectra: ResidualSpectra, directions: ComplexArray) -> FloatArray:
    """(k,): of the residual that all forces together explain, in units of noise, what would come back without each one
    alone; 1 in sum. Median over lines of an experiment, mean over experiments by their power."""
    root = np.sqrt(np.maximum(spectra.noise, _TINY))
    forces = equivalent_forces(spectra, directions)
    parts = np.sum(np.abs(directions[None] / root[..., None] * forces[:, :, None, :]) ** 2, axis=2)
    shares = np.median(parts / np.maximum(parts.sum(axis=2, keepdims=True), _TINY), axis=1)
    mean = np.average(shares, axis=0, weights=np.maximum(parts.sum(axis=(1, 2)), _TINY))
    return np.asarray(mean / mean.sum(), dtype=np.float64)
