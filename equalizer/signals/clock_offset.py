"""Clock offset of two recordings of the same motion, from the peak of their normalised cross-correlation.

For signals a and b without their means, on one grid, at lag l:

    r(l) = sum a(k + l) b(k) / sqrt(sum a(k + l)² sum b(k)²),    sums over the samples where both overlap.

The offset is that of the largest |r|, interpolated by a spline. It is refused where |r| is small, where the maximum
lies at the end of the searched range, and where another peak is about as high, as with periodic signals.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.signals.resampling import Grid, Samples, resample
from equalizer.signals.signal import FloatArray

IntArray = npt.NDArray[np.signedinteger]
BoolArray = npt.NDArray[np.bool_]

LEAST_CORRELATION = 0.5
"""Least |r| for an offset to be trusted. By hand."""
AMBIGUOUS = 0.98
"""Height of a second peak, relative to the highest, above which the offset is ambiguous. By hand."""
LEAST_OVERLAP = 0.25
"""Least overlap of the two signals, as a share of the shorter one. By hand."""
LEAST_LAGS = 8
"""Least number of lags to search: the spline of fifth order needs six."""
ENERGY_FLOOR = 1e-9
"""Least product of the overlapping energies, relative to that of the whole signals: silent stretches must not give a
large r. By hand."""


class NoOffsetError(ValueError):
    """The cross-correlation of two signals has no single clear peak, so their clock offset is not known."""


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """Offset between the clocks of two recordings of the same motion."""

    offset_s: float
    """Added to the other clock's time to give the reference's."""
    correlation: float
    """Normalised cross-correlation at this offset; negative where one signal is inverted."""


def offset_by_correlation(reference: Samples, other: Samples, about_s: float, within_s: float) -> ClockOffset:
    """The offset between about_s - within_s and about_s + within_s of the largest magnitude of the normalised
    cross-correlation.

    Both are put onto one band-limited grid at twice the faster rate; the peak of the normalised cross-correlation is
    taken between its samples, along a spline. Raises NoOffsetError where nothing agrees, the best agreement is at the
    end of the range, or another offset agrees as well.
    """
    rate_hz = 2 * max(1 / float(np.median(np.diff(part.times_s))) for part in (reference, other))
    first, second = (_resample_centred(part, rate_hz) for part in (reference, other))
    correlation = _correlate_normalised(first, second)
    lags = np.arange(-(len(second) - 1), len(first))
    offsets_s = reference.times_s[0] - other.times_s[0] + lags / rate_hz
    allowed = (np.abs(offsets_s - about_s) <= within_s) & _has_enough_overlap(lags, len(first), len(second))
    if allowed.sum() < LEAST_LAGS:
        raise NoOffsetError("the two signals do not overlap within the range of offsets that is searched; widen it")
    offsets_s, correlation = offsets_s[allowed], correlation[allowed]
    peak = int(np.argmax(np.abs(correlation)))
    best = abs(correlation[peak])
    if best < LEAST_CORRELATION:
        raise NoOffsetError(
            f"the two signals agree nowhere (highest correlation {best:.2f}); give two signals of the same quantity"
        )
    if not 0 < peak < len(correlation) - 1:
        raise NoOffsetError(
            f"the two signals agree best at the end of the range that is searched ({offsets_s[peak]:g} s); widen it"
        )
    _refuse_rivals(offsets_s, np.abs(correlation), peak)
    return _interpolate_peak(offsets_s, correlation, peak)


def _resample_centred(samples: Samples, rate_hz: float) -> FloatArray:
    count = int(np.floor((samples.times_s[-1] - samples.times_s[0]) * rate_hz)) + 1
    values = resample(samples, Grid(float(samples.times_s[0]), rate_hz, count), "band-limited")
    centred = values - np.nanmean(values)
    return np.nan_to_num(centred, nan=0.0)


def _correlate_normalised(first: FloatArray, second: FloatArray) -> FloatArray:
    """r of the module for signals (n,) and (m,), at each of the n + m - 1 lags -(m - 1) to n - 1."""
    # Here and below: SciPy's signal and interpolation modules take longer to import than a diagnosis that does not need
    # them.
    from scipy import signal as sg

    raw = sg.correlate(first, second, mode="full", method="fft")
    first_energy = sg.correlate(first**2, np.ones(len(second)), mode="full", method="fft")
    second_energy = sg.correlate(np.ones(len(first)), second**2, mode="full", method="fft")
    floor = ENERGY_FLOOR * float(np.sum(first**2) * np.sum(second**2))
    normalised: FloatArray = raw / np.sqrt(np.maximum(first_energy * second_energy, max(floor, np.finfo(float).tiny)))
    return normalised


def _has_enough_overlap(lags: IntArray, first: int, second: int) -> BoolArray:
    """Mask of the lags at which signals of these lengths overlap by at least `LEAST_OVERLAP`."""
    overlap = np.minimum(first, lags + second) - np.maximum(0, lags)
    has_overlap: BoolArray = overlap >= LEAST_OVERLAP * min(first, second)
    return has_overlap


def _refuse_rivals(offsets_s: FloatArray, height: FloatArray, peak: int) -> None:
    """Raises NoOffsetError where another peak than that at the index `peak` is about as high. height: |r|."""
    from scipy import signal as sg

    peaks, _ = sg.find_peaks(height)
    rivals = [
        candidate for candidate in peaks if abs(candidate - peak) > 2 and height[candidate] > AMBIGUOUS * height[peak]
    ]
    if rivals:
        raise NoOffsetError(
            f"offsets of {offsets_s[peak]:g} s and {offsets_s[rivals[0]]:g} s agree equally well, as happens with "
            "periodic signals; search a shorter range"
        )


def _interpolate_peak(offsets_s: FloatArray, correlation: FloatArray, peak: int) -> ClockOffset:
    """The maximum of |r| within a lag of the index `peak`, on a spline of fifth order."""
    from scipy.interpolate import make_interp_spline

    neighbours = slice(max(0, peak - 8), peak + 9)
    spline = make_interp_spline(
        offsets_s[neighbours] - offsets_s[peak], correlation[neighbours], k=min(5, len(correlation) - 1)
    )
    step = offsets_s[1] - offsets_s[0]
    fine = np.linspace(-step, step, 4001)
    values = spline(fine)
    best = int(np.argmax(np.abs(values)))
    return ClockOffset(float(offsets_s[peak] + fine[best]), float(values[best]))
