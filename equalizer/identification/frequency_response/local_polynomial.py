"""Smoothing of a measured frequency response by local polynomial regression (weighted least squares).

Around each line k a polynomial of low order in the frequency (default: a parabola) is fitted to the response on the
neighbouring lines by least squares, each weighted with 1 / its standard deviation; its value at line k is the smoothed
response. As the fit is linear in the values, it is a weighted sum over the neighbours, with weights that depend on the
lines and their noise only:  G_smooth(k) = sum over l of W(k, l) G(l).

The bias stays small while the neighbourhood is narrower than about the half width of a resonance.

The idea is that of the local polynomial method (Pintelon and Schoukens, System Identification, 2nd ed., 2012, chapter
7), which fits input and output spectra with their transients; here the estimated response itself is fitted.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class LocalPolynomial:
    """Smoothing weights of the neighbours of each line: W in the equation of the module docstring."""

    window: npt.NDArray[np.int64]
    """(lines, width): indices of the neighbours of each line, the line itself included."""
    weights: FloatArray
    """(lines, width): weights of the neighbours; real, of sum 1."""
    order: int
    """Order of the polynomial."""

    @classmethod
    def from_response(cls, response: FrequencyResponse, neighbours: int, order: int) -> Self:
        """Compute the weights for the lines of a response. neighbours: lines on either side. Raises ValueError for a
        negative order, for fewer than order + 2 lines in a neighbourhood, or for fewer lines in the response than in a
        neighbourhood."""
        width, line_count = 2 * neighbours + 1, len(response)
        if order < 0:
            raise ValueError(f"order is {order}; a polynomial has order 0 or above")
        if width < order + 2:
            raise ValueError(f"a polynomial of order {order} needs more than {width} lines; increase neighbours")
        if line_count < width:
            raise ValueError(
                f"smoothing takes {width} lines at a time, but there are {line_count}; widen the band, or reduce "
                "neighbours"
            )
        window = np.clip(np.arange(line_count) - neighbours, 0, line_count - width)[:, None] + np.arange(width)
        line_weights = _compute_line_weights(response)[window]
        powers = _compute_powers(response.frequency_hz, window, order)
        weights = np.linalg.pinv(powers * line_weights[:, :, None])[:, 0, :] * line_weights
        return cls(window, weights, order)

    def apply(self, values: ComplexArray) -> ComplexArray:
        """Smooth values (lines, ...) over the lines; the result has the same shape."""
        smoothed: ComplexArray = np.einsum("lk,lk...->l...", self.weights, values[self.window])
        return smoothed

    def propagate_variance(self, variances: FloatArray) -> FloatArray:
        """Compute the variance (lines, ...) after smoothing of errors that are independent between lines. variances:
        (lines, ...), before smoothing."""
        smoothed_variance: FloatArray = np.einsum("lk,lk...->l...", self.weights**2, variances[self.window])
        return smoothed_variance


def smooth_response(
    response: FrequencyResponse, neighbours: int = 8, order: int = 2, baseline: ComplexArray | None = None
) -> FrequencyResponse:
    """Smooth each line over itself and `neighbours` lines on either side; near the ends of the band over an asymmetric
    neighbourhood of the same number of lines. The defaults (17 lines, a parabola) are chosen.

    baseline: (lines, outputs, inputs), response of an approximate model: only the difference from it is smoothed, so
    that a resonance narrower than the neighbourhood is not flattened.

    The noise variance of the result is that of the weighted sum or, where that is larger, follows from the scatter of
    the lines about the polynomial, so that lack of fit is included. Errors of adjacent lines are then no longer
    independent. Raises ValueError as `LocalPolynomial.from_response` does.
    """
    polynomial = LocalPolynomial.from_response(response, neighbours, order)
    baseline_response = 0.0 if baseline is None else baseline
    difference = replace(response, response=np.asarray(response.response - baseline_response, dtype=np.complex128))
    smoothed = np.asarray(polynomial.apply(difference.response) + baseline_response, dtype=np.complex128)
    propagated_variance = polynomial.propagate_variance(response.noise_variance)
    scatter_variance = _estimate_scatter(difference, polynomial) * np.sum(polynomial.weights**2, axis=1)[:, None, None]
    remark = f"Smoothed: order {order} over {2 * neighbours + 1} lines."
    return replace(
        response,
        response=smoothed,
        noise_variance=np.fmax(propagated_variance, scatter_variance),
        remarks=(*response.remarks, remark),
    )


def _compute_line_weights(response: FrequencyResponse) -> FloatArray:
    """Compute the least-squares weights (lines,): 1 / standard deviation of the noise over all outputs and inputs,
    scaled to at most 1; all 1 where the noise of a line is not known or zero."""
    noise_power = response.noise_variance.sum(axis=(1, 2))
    if not (np.isfinite(noise_power) & (noise_power > 0)).all():
        return np.ones(len(response))
    weights: FloatArray = np.sqrt(noise_power.min() / noise_power)
    return weights


def _compute_powers(frequency_hz: FloatArray, window: npt.NDArray[np.int64], order: int) -> FloatArray:
    """Compute powers 0 to `order` of the frequency difference from the line, scaled to at most 1: (lines, width,
    order + 1)."""
    offset_hz = frequency_hz[window] - frequency_hz[:, None]
    powers: FloatArray = (offset_hz / np.abs(offset_hz).max(axis=1, keepdims=True))[:, :, None] ** np.arange(order + 1)
    return powers


def _estimate_scatter(response: FrequencyResponse, polynomial: LocalPolynomial) -> FloatArray:
    """Estimate the residual variance (lines, outputs, inputs) of an unweighted polynomial fit in each window, per
    degree of freedom."""
    basis, _ = np.linalg.qr(_compute_powers(response.frequency_hz, polynomial.window, polynomial.order))
    values = response.response[polynomial.window]
    explained_power = np.abs(np.einsum("lko,lkpm->lopm", basis, values)) ** 2
    residual_power = np.sum(np.abs(values) ** 2, axis=1) - np.sum(explained_power, axis=1)
    scatter_variance: FloatArray = np.maximum(residual_power, 0.0) / (values.shape[1] - polynomial.order - 1)
    return scatter_variance
