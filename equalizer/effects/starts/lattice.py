"""Detection of quantization: whether recorded values lie on an evenly spaced lattice, and its step.

Without noise after rounding, the step follows from the differences between distinct values, refined by a straight line
through value over lattice index. With noise after rounding, the histogram of the values has a ripple whose period is
the step; it is found in the spectrum of the histogram. Called by the effect `quantization` and by `analysis.diagnosis`
(faults of a signal). Steps and offsets have the unit of the values.
"""

import numpy as np

from equalizer.signals.signal import FloatArray

LATTICE_TOLERANCE = 0.02
"""Largest deviation of a value from the lattice, in steps. Chosen: rounding to single precision causes less."""
LEAST_LATTICE_SHARE = 0.999
"""Share of the values above which they count as lying on a lattice. Chosen, as are the limits below."""
LEAST_POINTS, LARGEST_POINT_RATIO = 3, 0.2
"""Least number of occupied lattice points, and the largest, relative to the number of samples."""
LEAST_RIPPLE_RATIO = 12.0
"""Least ratio of a peak in the histogram's spectrum to the median around it."""
BIN_NOISE_RATIO = 0.2
"""Width of a bin of the histogram, relative to the rms noise."""


def find_lattice_offset(values: FloatArray, step: float) -> float | None:
    """Find the offset of the lattice of a given step, between minus and plus half a step, from the mean phase of the
    values (n,). None where the values do not lie on such a lattice, or the step is not positive."""
    if step <= 0:
        return None
    phasors = np.exp(2j * np.pi * values / step)
    offset = float(np.angle(phasors.mean()) / (2 * np.pi) * step)
    lattice_distances = np.abs((values - offset) / step - np.round((values - offset) / step))
    return offset if float(np.mean(lattice_distances < LATTICE_TOLERANCE)) > LEAST_LATTICE_SHARE else None


def find_lattice_step(values: FloatArray) -> float | None:
    """Find the step of the lattice on which nearly all values (n,) lie: the median of the gaps between distinct values
    below 1.5 times the smallest, refined; None without a lattice."""
    distinct_values = np.unique(values)
    if len(distinct_values) < LEAST_POINTS:
        return None
    # In single precision several neighbouring values belong to one lattice point: gaps below 1e-5 of the mean gap do
    # not count.
    gaps = np.diff(distinct_values)
    gaps = gaps[gaps > 1e-5 * float(np.ptp(distinct_values)) / max(len(distinct_values), 1)]
    if not len(gaps):
        return None
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    lattice_points = np.unique(np.round((distinct_values - distinct_values[0]) / step))
    if not LEAST_POINTS <= len(lattice_points) <= LARGEST_POINT_RATIO * len(values):
        return None
    # An error of the step accumulates over the range: fit value over index, then again with the corrected indices.
    lattice_indices = np.round((distinct_values - distinct_values[0]) / step)
    for _ in range(2):
        step = float(np.polyfit(lattice_indices, distinct_values, 1)[0])
        lattice_indices = np.round((distinct_values - distinct_values[0]) / step)
    return step if find_lattice_offset(values, step) is not None else None


def confirm_lattice_step(values: FloatArray, candidate_step: float) -> float:
    """Find the step of the lattice on which values (n,) lie; 0 = no lattice. candidate_step: a step to test where no
    lattice is found from the values alone, for instance because there are too many different values."""
    detected_step = find_lattice_step(values)
    return (
        detected_step
        if detected_step is not None
        else candidate_step
        if find_lattice_offset(values, candidate_step) is not None
        else 0.0
    )


def find_step_under_noise(values: FloatArray, noise: float) -> float | None:
    """Find the quantization step under noise, from the ripple in the histogram of values (n,); None without one, or
    where the noise is 0 or the range too narrow or too wide for the histogram. noise: rms, in the unit of the
    values."""
    value_range = float(np.ptp(values))
    bin_count = int(value_range / (BIN_NOISE_RATIO * noise)) if noise > 0 else 0
    # With fewer bins no ripple can be told from the distribution; more need too much memory. Chosen.
    if not 64 <= bin_count <= 4_000_000:
        return None
    counts, edges = np.histogram(values, bins=bin_count)
    bin_width = float(edges[1] - edges[0])
    # Zero padding interpolates the spectrum eightfold, which locates the peak.
    padded_length = 8 * len(counts)
    spectrum = np.abs(np.fft.rfft(counts, padded_length)) / np.sqrt(len(values))
    ripple_frequency = np.fft.rfftfreq(padded_length, bin_width)
    # Up to 10 cycles over the range belong to the distribution of the response; noise smooths ripples shorter than
    # about 3 times its rms.
    is_in_band = (ripple_frequency > 10 / value_range) & (ripple_frequency < 0.3 / noise)
    if not is_in_band.any():
        return None
    peak_line = int(np.flatnonzero(is_in_band)[np.argmax(spectrum[is_in_band])])
    # Lines around the peak, in cycles over the range: within 20, but not within 2, which belong to the peak itself.
    is_neighbour = (
        (np.abs(ripple_frequency - ripple_frequency[peak_line]) < 20 / value_range)
        & is_in_band
        & (np.abs(ripple_frequency - ripple_frequency[peak_line]) > 2 / value_range)
    )
    if not is_neighbour.any() or spectrum[peak_line] < LEAST_RIPPLE_RATIO * float(np.median(spectrum[is_neighbour])):
        return None
    return float(1 / ripple_frequency[peak_line])
