"""Smoothing of a measured frequency response by local polynomials (after the local polynomial method of Pintelon and
Schoukens, here on the response itself): a parabola is fitted to the neighbours of each line.

Bias stays below the noise while the neighbourhood is narrower than about a resonance's half width.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class LocalPolynomial:
    """Smoothing weights of each line's neighbours: fixed by the lines and their noise, linear in the values."""

    window: npt.NDArray[np.int64]
    """(lines, taken): indices of the neighbours of each line."""
    rows: FloatArray
    """(lines, taken): weights of the neighbours."""
    order: int

    @classmethod
    def over(cls, response: FrequencyResponse, neighbours: int, order: int) -> Self:
        """Weights for a response's lines. Raises ValueError where there are fewer lines than a polynomial takes."""
        taken, lines = 2 * neighbours + 1, len(response)
        if order < 0 or taken < order + 2:
            raise ValueError(f"a polynomial of order {order} needs more than {taken} lines; let neighbours be larger")
        if lines < taken:
            raise ValueError(
                f"smoothing takes {taken} lines at a time, but there are {lines}; widen the band, or lower the degree"
            )
        window = np.clip(np.arange(lines) - neighbours, 0, lines - taken)[:, None] + np.arange(taken)
        weight = _weights(response)[window]
        powers = _powers(response.frequency_hz, window, order)
        fitted = np.linalg.pinv(powers * weight[:, :, None])[:, 0, :] * weight
        return cls(window, fitted, order)

    def apply(self, values: ComplexArray) -> ComplexArray:
        """Smoothed values (lines, ...)."""
        smooth: ComplexArray = np.einsum("lk,lk...->l...", self.rows, values[self.window])
        return smooth

    def power(self, powers: FloatArray) -> FloatArray:
        """Variance after smoothing of independent errors with variances `powers` (lines, ...)."""
        smooth: FloatArray = np.einsum("lk,lk...->l...", self.rows**2, powers[self.window])
        return smooth


def smooth_response(
    response: FrequencyResponse, neighbours: int = 8, order: int = 2, about: ComplexArray | None = None
) -> FrequencyResponse:
    """Smooth each line over itself and `neighbours` lines on either side; near the ends over as many, one-sided.

    about: (lines, outputs, inputs), response of an approximate model: only the difference from it is smoothed, so that
    a resonance narrower than the neighbourhood is not blunted.

    The new noise variance follows from the old one, or from the scatter about the polynomials where that is larger, so
    that lack of fit of the parabolas is included. Errors of lines next to each other are no longer independent. Raises
    ValueError where there are fewer lines than a polynomial takes.
    """
    local = LocalPolynomial.over(response, neighbours, order)
    known = 0.0 if about is None else about
    rest = replace(response, response=np.asarray(response.response - known, dtype=np.complex128))
    smooth = np.asarray(local.apply(rest.response) + known, dtype=np.complex128)
    noise = local.power(response.noise_variance)
    scatter = _scatter(rest, local) * np.sum(local.rows**2, axis=1)[:, None, None]
    remark = f"Smoothed: order {order} over {2 * neighbours + 1} lines."
    return replace(
        response, response=smooth, noise_variance=np.fmax(noise, scatter), remarks=(*response.remarks, remark)
    )


def _weights(response: FrequencyResponse) -> FloatArray:
    """(lines,): relative weights by the lines' noise; equal where it is not known."""
    power = response.noise_variance.sum(axis=(1, 2))
    if not (np.isfinite(power) & (power > 0)).all():
        return np.ones(len(response))
    weights: FloatArray = np.sqrt(power.min() / power)
    return weights


def _powers(frequency_hz: FloatArray, window: npt.NDArray[np.int64], order: int) -> FloatArray:
    """(lines, taken, order + 1): powers of the distance from the line itself."""
    away = frequency_hz[window] - frequency_hz[:, None]
    powers: FloatArray = (away / np.abs(away).max(axis=1, keepdims=True))[:, :, None] ** np.arange(order + 1)
    return powers


def _scatter(response: FrequencyResponse, local: LocalPolynomial) -> FloatArray:
    """(lines, outputs, inputs): power about an unweighted polynomial in each window, per degree of freedom."""
    basis, _ = np.linalg.qr(_powers(response.frequency_hz, local.window, local.order))
    values = response.response[local.window]
    explained = np.abs(np.einsum("lko,lkpm->lopm", basis, values)) ** 2
    residual_power = np.sum(np.abs(values) ** 2, axis=1) - np.sum(explained, axis=1)
    power: FloatArray = np.maximum(residual_power, 0.0) / (values.shape[1] - local.order - 1)
    return power
