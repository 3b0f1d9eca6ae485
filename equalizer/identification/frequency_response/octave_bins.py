"""Averages of a frequency response over bins of equal width in octaves.

Lines of a discrete Fourier transform are equally spaced in Hz; a plot over log frequency, and a comparison of records
of different length, need averages of equal width in octaves.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import BoolArray, FrequencyResponse
from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class OctaveBins:
    """Means per bin. Where lines are further apart than a bin is wide, a bin is a line; empty bins are left out."""

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
    """(bins, outputs, inputs): noise variance E|error|² of a single line, averaged; that of the mean is `lines` times
    smaller."""
    lines: FloatArray
    """(bins,): number of lines in each."""
    reliable: BoolArray
    """(bins,): whether most lines of the bin are reliable."""


def octave_bins(response: FrequencyResponse, octaves: float) -> OctaveBins:
    """Average a response over bins of this width in octaves, which begin at its first line. It must have a line, the
    first above 0 Hz, in ascending order."""
    number = np.floor(np.log2(response.frequency_hz / response.frequency_hz[0]) / octaves).astype(np.int64)
    _, starts, counts = np.unique(number, return_index=True, return_counts=True)
    lines = counts.astype(np.float64)
    magnitude = np.abs(response.response)
    return OctaveBins(
        np.add.reduceat(response.frequency_hz, starts) / lines,
        np.asarray(np.add.reduceat(response.response, starts, axis=0) / lines[:, None, None], dtype=np.complex128),
        np.minimum.reduceat(magnitude, starts, axis=0),
        np.maximum.reduceat(magnitude, starts, axis=0),
        np.add.reduceat(response.noise_variance, starts, axis=0) / lines[:, None, None],
        lines,
        np.add.reduceat(response.reliable.astype(np.float64), starts) > lines / 2,
    )
