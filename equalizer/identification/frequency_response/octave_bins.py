"""Averages of a frequency response over bins of equal width in octaves.

Lines of a discrete Fourier transform are equally spaced in Hz; a plot over log frequency (`analysis.figures`), and a
comparison of records of different length (`resonances`), need averages of equal width in octaves.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class OctaveBins:
    """Means per bin; bins without a line are left out. Where lines are further apart than a bin is wide, each bin holds
    a single line."""

    frequency_hz: FloatArray
    """(bins,): arithmetic mean of the lines' frequencies."""
    response: ComplexArray
    """(bins, outputs, inputs): mean of the complex values, so that noise averages out; so does part of a response whose
    phase changes within a bin."""
    lowest: FloatArray
    """(bins, outputs, inputs): magnitude of the weakest line."""
    highest: FloatArray
    """(bins, outputs, inputs): magnitude of the strongest line."""
    noise_variance: FloatArray
    """(bins, outputs, inputs): noise variance E|error|² of a single line, mean over the bin. For independent errors,
    that of the mean response is `lines` times smaller."""
    lines: FloatArray
    """(bins,): number of lines in each bin."""
    reliable: BoolArray
    """(bins,): whether more than half of the bin's lines are reliable."""


def average_octave_bins(response: FrequencyResponse, bin_width_octaves: float) -> OctaveBins:
    """Average a response over bins of equal width in octaves; the first bin begins at the first line. Lines must be in
    ascending order, above 0 Hz, and at least one."""
    bin_index = np.floor(np.log2(response.frequency_hz / response.frequency_hz[0]) / bin_width_octaves).astype(np.int64)
    _, starts, counts = np.unique(bin_index, return_index=True, return_counts=True)
    line_counts = counts.astype(np.float64)
    magnitude = np.abs(response.response)
    return OctaveBins(
        np.add.reduceat(response.frequency_hz, starts) / line_counts,
        np.asarray(
            np.add.reduceat(response.response, starts, axis=0) / line_counts[:, None, None], dtype=np.complex128
        ),
        np.minimum.reduceat(magnitude, starts, axis=0),
        np.maximum.reduceat(magnitude, starts, axis=0),
        np.add.reduceat(response.noise_variance, starts, axis=0) / line_counts[:, None, None],
        line_counts,
        np.add.reduceat(response.reliable.astype(np.float64), starts) > line_counts / 2,
    )
