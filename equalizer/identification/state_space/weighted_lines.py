"""Frequency lines that a model is fitted to: measured responses, weighted by the inverse of their standard errors.

With circular complex Gaussian noise of variance E|error|² = 1 / weight², the weighted sum of squares is the negative
log-likelihood, up to a constant. `weight_lines` prepares the data; `group_lines` and `average_bins` reduce them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.signals.signal import ComplexArray, FloatArray

MIN_RELATIVE_NOISE = 1e-9
"""Smallest standard error, relative to the largest magnitude of all entries, so that noise-free data have finite
weights. Chosen: far below measured noise."""


@dataclass(frozen=True, slots=True, eq=False)
class WeightedLines:
    """Measured responses, each with the inverse of its standard error as weight."""

    frequency_hz: FloatArray
    """(lines,), Hz, in ascending order; a frequency that was measured twice occurs twice."""
    response: ComplexArray
    """(lines, outputs, inputs), in output unit per input unit."""
    weight: FloatArray
    """(lines, outputs, inputs): 1 / standard error, with the standard error sqrt(E|error|²)."""
    sample_rate_hz: float
    """Sample rate (Hz) of the model, which defines `z`."""

    @property
    def z(self) -> ComplexArray:
        """(lines,): exp(2 pi j f / sample rate), at which a discrete-time model is evaluated."""
        return np.asarray(np.exp(2j * np.pi * self.frequency_hz / self.sample_rate_hz), dtype=np.complex128)

    def __len__(self) -> int:
        return len(self.frequency_hz)

    def compute_cost(self, modelled: ComplexArray) -> float:
        """Compute the weighted sum of squared errors of a model's responses (lines, outputs, inputs)."""
        return float((np.abs(self.weight * (modelled - self.response)) ** 2).sum())

    def compute_relative_error(self, modelled: ComplexArray) -> FloatArray:
        """Compute, (lines,), the Frobenius norm of modelled minus measured response, over the rms norm of the measured
        responses."""
        rms_norm = np.sqrt((np.abs(self.response) ** 2).sum(axis=(1, 2)).mean())
        return np.asarray(np.linalg.norm(modelled - self.response, axis=(1, 2)) / rms_norm, dtype=np.float64)


def weight_lines(responses: Sequence[FrequencyResponse], band_hz: tuple[float, float]) -> WeightedLines:
    """Join the reliable, finite lines of the band (Hz, limits included) of all estimates, one or more, in ascending
    order with weights. Where the noise of an entry is not known, it is estimated from the scatter between lines
    (`estimate_scatter_variance`)."""
    band_estimates = [estimate.select_band(*band_hz) for estimate in responses]
    reliable_estimates = [
        estimate.select_lines(estimate.reliable & np.isfinite(estimate.response).all(axis=(1, 2)))
        for estimate in band_estimates
    ]
    reliable_estimates = [estimate for estimate in reliable_estimates if len(estimate)]
    if not reliable_estimates:
        output_count, input_count = len(responses[0].output_channels), len(responses[0].input_channels)
        return WeightedLines(
            np.empty(0),
            np.empty((0, output_count, input_count), complex),
            np.empty((0, output_count, input_count)),
            responses[0].sample_rate_hz,
        )
    frequency_hz = np.concatenate([estimate.frequency_hz for estimate in reliable_estimates])
    ascending_order = np.argsort(frequency_hz, kind="stable")
    response = np.concatenate([estimate.response for estimate in reliable_estimates])[ascending_order]
    variance = np.concatenate([_complete_noise_variance(estimate) for estimate in reliable_estimates])[ascending_order]
    min_error = MIN_RELATIVE_NOISE * float(np.abs(response).max())
    weight = 1 / np.sqrt(np.maximum(variance, min_error**2))
    return WeightedLines(frequency_hz[ascending_order], response, weight, reliable_estimates[0].sample_rate_hz)


def _complete_noise_variance(estimate: FrequencyResponse) -> FloatArray:
    """Return the noise variance (lines, p, m), with `estimate_scatter_variance` where it is not known."""
    variance = estimate.noise_variance
    return np.where(np.isfinite(variance), variance, estimate_scatter_variance(estimate.response))


def estimate_scatter_variance(response: ComplexArray) -> FloatArray:
    """Estimate the noise variance (lines, p, m), the same at all lines, from the median over the lines of squared
    second differences of each entry; for fewer than three lines |response|²."""
    if len(response) < 3:
        return np.abs(response) ** 2
    second_differences = np.diff(response, n=2, axis=0)
    # The median, because a sharp resonance hardly changes it. A second difference has 1 + 4 + 1 = 6 times the variance;
    # |.|² of circular noise is exponentially distributed, with the median ln 2 times its mean.
    median_variance = np.median(np.abs(second_differences) ** 2, axis=0) / (6 * np.log(2))
    return np.asarray(np.broadcast_to(median_variance, response.shape), dtype=np.float64)


def average_bins(
    lines: WeightedLines, bins: Sequence[slice], modelled: ComplexArray, modelled_at_centres: ComplexArray
) -> WeightedLines:
    """Average the lines of each bin with their weights, at its mean frequency. The difference from an approximate model
    is averaged, so that averaging does not flatten resonances within a bin. modelled (lines, p, m),
    modelled_at_centres (bins, p, m): the model's responses on `lines` and at the bins' mean frequencies."""
    squared_weight = lines.weight**2
    difference = squared_weight * (lines.response - modelled)
    weight = np.array([squared_weight[bin_lines].sum(axis=0) for bin_lines in bins])
    mean = np.array([difference[bin_lines].sum(axis=0) for bin_lines in bins]) / weight
    return replace(
        lines,
        frequency_hz=compute_bin_centres_hz(lines, bins),
        response=modelled_at_centres + mean,
        weight=np.sqrt(weight),
    )


def compute_bin_centres_hz(lines: WeightedLines, bins: Sequence[slice]) -> FloatArray:
    """Compute the mean frequency (Hz) of the lines of each bin, (bins,)."""
    return np.array([lines.frequency_hz[bin_lines].mean() for bin_lines in bins])


def group_lines(lines: WeightedLines, min_lines: int, width_octaves: float) -> tuple[slice, ...]:
    """Group neighbouring lines into consecutive slices: each of all lines less than `width_octaves` above its first
    line, and of at least `min_lines` lines, the last slice excepted."""
    edges, frequency_hz = [0], lines.frequency_hz
    while edges[-1] < len(lines):
        start = edges[-1]
        octave_end = int(np.searchsorted(frequency_hz, frequency_hz[start] * 2**width_octaves))
        edges.append(min(max(start + min_lines, octave_end), len(lines)))
    return tuple(slice(start, stop) for start, stop in pairwise(edges))
