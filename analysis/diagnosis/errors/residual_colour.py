"""The colour of what a model leaves of a sound device: where in frequency it misses much, and where next to nothing.

A course without its colour is what could not be foreseen of it from its own past (the error of an autoregression,
Yule 1927, Walker 1931), so that each frequency counts by how much a sound device differs there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import fftconvolve

from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

MOST_LAGS, SAMPLES_PER_LAG = 64, 50
"""That a course is foreseen from, and samples that each asks for."""
FLAT = 1e-4
"""Share of the power that counts as white: no model is trusted better at any frequency."""


@dataclass(frozen=True, slots=True, eq=False)
class Colour:
    steps: FloatArray
    """(lags + 1, c): the filter that takes it off, the first row 1."""

    @property
    def lags(self) -> int:
        return len(self.steps) - 1

    def taken_off(self, left: FloatArray) -> FloatArray:
        """(n, c), NaN where it was. A sample hangs on those before it alone; what is not known counts as 0."""
        known = np.isfinite(left)
        filled = np.where(known, left, 0.0)
        return np.where(known, fftconvolve(filled, self.steps, axes=0)[: len(left)], np.nan)

    def warm(self, left: FloatArray) -> Mask:
        """(n,): where all that a sample is foreseen from is known."""
        unknown = np.concatenate([np.ones(self.lags), ~np.isfinite(left).all(axis=1)])
        until = np.concatenate([[0.0], np.cumsum(unknown)])
        return np.asarray(until[self.lags + 1 :] == until[: len(left)], dtype=np.bool_)


def colour_of(courses: Sequence[FloatArray], least: FloatArray) -> Colour:
    """courses: (n, c) each, NaN where not known. least: (c,), rms of noise that is white."""
    count = sum(int(np.isfinite(course).all(axis=1).sum()) for course in courses)
    lags = int(np.clip(count // SAMPLES_PER_LAG, 1, MOST_LAGS))
    alike: FloatArray = np.sum([_products(course, lags) for course in courses], axis=0) / max(count, 1)
    alike[0] = alike[0] * (1 + FLAT) + least**2
    steps = np.zeros((lags + 1, len(least)))
    steps[0] = 1.0
    for c, row in enumerate(alike.T):
        steps[1:, c] = -solve_toeplitz(row[:-1], row[1:])
    return Colour(steps)


def _products(course: FloatArray, lags: int) -> FloatArray:
    """(lags + 1, c): sums of what lies so many samples apart, multiplied."""
    filled: FloatArray = np.where(np.isfinite(course).all(axis=1, keepdims=True), course, 0.0)
    return np.array([np.sum(filled[k:] * filled[: len(filled) - k], axis=0) for k in range(lags + 1)])
