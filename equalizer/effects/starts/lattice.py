"""Detection of quantization: whether recorded values lie on an evenly spaced lattice, and its step.

Without noise after rounding, the step follows from the differences between distinct values, refined by a straight line
through value over lattice index. With noise after rounding, the histogram of the values has a ripple whose period is
the step; it is found in the spectrum of the histogram.
"""

import numpy as np

from equalizer.signals.signal import FloatArray

LATTICE_TOLERANCE = 0.02
"""Largest deviation of a value from the lattice, in steps. Rounding to single precision causes less."""
NEARLY_ALL = 0.999
"""Share of the values that must exceed this for a lattice."""
LEAST_VALUES, MOST_VALUES = 3, 0.2
"""Least number of occupied lattice points, and the largest, as a share of the number of samples."""
PEAK_RATIO = 12.0
"""Least ratio of a peak in the histogram's spectrum to the median around it."""
BIN_SHARE = 0.2
"""Width of a bin of the histogram, relative to the rms noise."""


def lattice_offset(values: FloatArray, step: float) -> float | None:
    """Offset of the lattice of this step, between minus and plus half a step, from the mean phase of the values; None
    where the values do not lie on such a lattice."""
    if step <= 0:
        return None
    phasors = np.exp(2j * np.pi * values / step)
    offset = float(np.angle(phasors.mean()) / (2 * np.pi) * step)
    distances = np.abs((values - offset) / step - np.round((values - offset) / step))
    return offset if float(np.mean(distances < LATTICE_TOLERANCE)) > NEARLY_ALL else None


def lattice_step(values: FloatArray) -> float | None:
    """The widest step whose lattice holds nearly all values; None without a lattice."""
    different = np.unique(values)
    if len(different) < LEAST_VALUES:
        return None
    # In single precision several neighbouring values stand for one lattice point.
    gaps = np.diff(different)
    gaps = gaps[gaps > 1e-5 * float(np.ptp(different)) / max(len(different), 1)]
    if not len(gaps):
        return None
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    points = np.unique(np.round((different - different[0]) / step))
    if not LEAST_VALUES <= len(points) <= MOST_VALUES * len(values):
        return None
    # The error of the step accumulates over the range, so that it is refined over the whole range.
    numbers = np.round((different - different[0]) / step)
    for _ in range(2):
        step = float(np.polyfit(numbers, different, 1)[0])
        numbers = np.round((different - different[0]) / step)
    return step if lattice_offset(values, step) is not None else None


def confirm_lattice_step(values: FloatArray, candidate_step: float) -> float:
    """The step of the lattice on which values (n,) lie; 0 = no lattice. candidate_step: a step to test where no lattice
    is found from the values alone, for instance because there are too many different values."""
    detected_step = lattice_step(values)
    return (
        detected_step
        if detected_step is not None
        else candidate_step
        if lattice_offset(values, candidate_step) is not None
        else 0.0
    )


def staircase_step(values: FloatArray, noise: float) -> float | None:
    """The quantization step under noise, from the ripple in the histogram of values (n,); None without one."""
    span = float(np.ptp(values))
    bins = int(span / (BIN_SHARE * noise)) if noise > 0 else 0
    # Too few bins hold no ripple; too many need too much memory.
    if not 64 <= bins <= 4_000_000:
        return None
    counts, edges = np.histogram(values, bins=bins)
    width = float(edges[1] - edges[0])
    padded = 8 * len(counts)
    spectrum = np.abs(np.fft.rfft(counts, padded)) / np.sqrt(len(values))
    per_unit = np.fft.rfftfreq(padded, width)
    # Slow components belong to the distribution of the response; noise smooths ripples shorter than about 3 times its
    # rms.
    in_band = (per_unit > 10 / span) & (per_unit < 0.3 / noise)
    if not in_band.any():
        return None
    peak = int(np.flatnonzero(in_band)[np.argmax(spectrum[in_band])])
    neighbours = (
        (np.abs(per_unit - per_unit[peak]) < 20 / span) & in_band & (np.abs(per_unit - per_unit[peak]) > 2 / span)
    )
    if not neighbours.any() or spectrum[peak] < PEAK_RATIO * float(np.median(spectrum[neighbours])):
        return None
    return float(1 / per_unit[peak])
