"""Detection of quantization: whether values lie on an evenly spaced lattice, and its step."""

import numpy as np

from equalizer.signals.signal import FloatArray

CLOSE = 0.02
"""Shares of a step by which values may deviate from the lattice; single precision needs less."""
NEARLY_ALL = 0.999
"""Share of values that must lie on the lattice."""
LEAST_VALUES, MOST_VALUES = 3, 0.2
"""Least number of different values that make a lattice; and most, as a share of the samples."""
PEAK = 12.0
"""Least ratio of a peak in the histogram's spectrum to its surroundings."""
BIN_SHARE = 0.2
"""Width of a histogram's bin, relative to the noise."""


def lattice_offset(values: FloatArray, step: float) -> float | None:
    """Offset of the lattice of this step, between minus and plus half a step; None where values are not on one."""
    if step <= 0:
        return None
    turn = np.exp(2j * np.pi * values / step)
    offset = float(np.angle(turn.mean()) / (2 * np.pi) * step)
    away = np.abs((values - offset) / step - np.round((values - offset) / step))
    return offset if float(np.mean(away < CLOSE)) > NEARLY_ALL else None


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


def confirm_lattice_step(values: FloatArray, other: float) -> float:
    """The step of the lattice that values (n,) lie on; 0 = none. other: a step to test where there are too many
    different values to find a lattice from them alone."""
    own = lattice_step(values)
    return own if own is not None else other if lattice_offset(values, other) is not None else 0.0


def staircase_step(values: FloatArray, noise: float) -> float | None:
    """The quantization step under noise, from the ripple in the histogram of values (n,); None without one."""
    span = float(np.ptp(values))
    bins = int(span / (BIN_SHARE * noise)) if noise > 0 else 0
    if not 64 <= bins <= 4_000_000:
        return None
    counts, edges = np.histogram(values, bins=bins)
    width = float(edges[1] - edges[0])
    padded = 8 * len(counts)
    spectrum = np.abs(np.fft.rfft(counts, padded)) / np.sqrt(len(values))
    per_unit = np.fft.rfftfreq(padded, width)
    # Slow components of the histogram are the response's own distribution.
    inside = (per_unit > 10 / span) & (per_unit < 0.3 / noise)
    if not inside.any():
        return None
    top = int(np.flatnonzero(inside)[np.argmax(spectrum[inside])])
    around = (np.abs(per_unit - per_unit[top]) < 20 / span) & inside & (np.abs(per_unit - per_unit[top]) > 2 / span)
    if not around.any() or spectrum[top] < PEAK * float(np.median(spectrum[around])):
        return None
    return float(1 / per_unit[top])
