"""Clock offset of two recordings of the same motion, from the peak of their normalised cross-correlation.

For signals a and b without their means, on one grid, at lag l:

    r(l) = sum a(k + l) b(k) / sqrt(sum a(k + l)² sum b(k)²),    sums over the samples where both overlap.

The offset is the lag of the largest |r|, interpolated by a spline. It is rejected where |r| is small, where the maximum
lies at the end of the searched range, and where another peak is about as high, as with periodic signals.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.signals.resampling import Grid, Samples, resample
from equalizer.signals.signal import BoolArray, FloatArray

IntArray = npt.NDArray[np.signedinteger]

LEAST_CORRELATION = 0.5
"""Least |r| at which an offset is accepted. Chosen, like all constants here without another reason."""
AMBIGUOUS_RATIO = 0.98
"""Height of a second peak, relative to the highest, above which the offset is ambiguous."""
LEAST_OVERLAP = 0.25
"""Least overlap of the two signals, as a share of the shorter one."""
LEAST_LAGS = 8
"""Least number of lags in the searched range: a spline of degree 5 needs six."""
ENERGY_FLOOR = 1e-9
"""Lower limit of the product of the overlapping energies in the denominator of r, relative to that of the whole
signals, so that silent stretches do not give a large r."""


class NoOffsetError(ValueError):
    """The clock offset of two signals cannot be determined: their cross-correlation has no single clear peak."""


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """Offset between the clocks of two recordings of the same motion."""

    offset_s: float
    """Offset (s) that is added to the times of the second clock to give times of the reference clock."""
    correlation: float
    """Normalised cross-correlation at this offset; negative where one signal is inverted."""


def find_clock_offset(reference: Samples, shifted: Samples, centre_s: float, half_range_s: float) -> ClockOffset:
    """Find the clock offset with the largest |r| between centre_s - half_range_s and centre_s + half_range_s. shifted:
    the same motion, recorded with the second clock.

    Both are resampled (band-limited) to twice the higher of their rates. Raises NoOffsetError where the overlap within
    the range is too short, |r| is too small, its maximum is at the end of the range, or another peak is about as high;
    ValueError as `resample` does.
    """
    rate_hz = 2 * max(1 / float(np.median(np.diff(samples.times_s))) for samples in (reference, shifted))
    reference_values, shifted_values = (_resample_centred(samples, rate_hz) for samples in (reference, shifted))
    correlation = _correlate_normalised(reference_values, shifted_values)
    lags = np.arange(-(len(shifted_values) - 1), len(reference_values))
    offsets_s = reference.times_s[0] - shifted.times_s[0] + lags / rate_hz
    is_searched = (np.abs(offsets_s - centre_s) <= half_range_s) & _has_enough_overlap(
        lags, len(reference_values), len(shifted_values)
    )
    if is_searched.sum() < LEAST_LAGS:
        raise NoOffsetError("the two signals do not overlap within the range of offsets that is searched; widen it")
    offsets_s, correlation = offsets_s[is_searched], correlation[is_searched]
    peak_index = int(np.argmax(np.abs(correlation)))
    highest_magnitude = abs(correlation[peak_index])
    if highest_magnitude < LEAST_CORRELATION:
        raise NoOffsetError(
            f"the two signals agree nowhere (highest correlation {highest_magnitude:.2f}); give two signals of the "
            "same quantity"
        )
    if not 0 < peak_index < len(correlation) - 1:
        raise NoOffsetError(
            f"the two signals agree best at the end of the range that is searched ({offsets_s[peak_index]:g} s); "
            "widen it"
        )
    _refuse_rival_peaks(offsets_s, np.abs(correlation), peak_index)
    return _interpolate_peak(offsets_s, correlation, peak_index)


def _resample_centred(samples: Samples, rate_hz: float) -> FloatArray:
    """Resample to a uniform grid from the first time on, (n,), and subtract the mean; missing values become zero."""
    sample_count = int(np.floor((samples.times_s[-1] - samples.times_s[0]) * rate_hz)) + 1
    values = resample(samples, Grid(float(samples.times_s[0]), rate_hz, sample_count), "band-limited")
    centred = values - np.nanmean(values)
    return np.nan_to_num(centred, nan=0.0)


def _correlate_normalised(first: FloatArray, second: FloatArray) -> FloatArray:
    """Compute the normalised cross-correlation r (module docstring) of signals (n,) and (m,) at the lags -(m - 1) to n
    - 1."""
    # Imported here and below, because SciPy's signal and interpolation modules take long to import.
    from scipy import signal as sg

    cross_correlation = sg.correlate(first, second, mode="full", method="fft")
    first_energy = sg.correlate(first**2, np.ones(len(second)), mode="full", method="fft")
    second_energy = sg.correlate(np.ones(len(first)), second**2, mode="full", method="fft")
    energy_floor = ENERGY_FLOOR * float(np.sum(first**2) * np.sum(second**2))
    normalised: FloatArray = cross_correlation / np.sqrt(
        np.maximum(first_energy * second_energy, max(energy_floor, np.finfo(float).tiny))
    )
    return normalised


def _has_enough_overlap(lags: IntArray, first_length: int, second_length: int) -> BoolArray:
    """Whether signals of these lengths overlap by at least `LEAST_OVERLAP` at each lag, (lags,)."""
    overlap_samples = np.minimum(first_length, lags + second_length) - np.maximum(0, lags)
    has_overlap: BoolArray = overlap_samples >= LEAST_OVERLAP * min(first_length, second_length)
    return has_overlap


def _refuse_rival_peaks(offsets_s: FloatArray, magnitude: FloatArray, peak_index: int) -> None:
    """Raise NoOffsetError where a peak more than two lags from `peak_index` is higher than `AMBIGUOUS_RATIO` times the
    highest. magnitude: |r|, (lags,)."""
    from scipy import signal as sg

    peak_indices, _ = sg.find_peaks(magnitude)
    rival_indices = [
        candidate_index
        for candidate_index in peak_indices
        if abs(candidate_index - peak_index) > 2
        and magnitude[candidate_index] > AMBIGUOUS_RATIO * magnitude[peak_index]
    ]
    if rival_indices:
        raise NoOffsetError(
            f"offsets of {offsets_s[peak_index]:g} s and {offsets_s[rival_indices[0]]:g} s agree equally well, as "
            "happens with periodic signals; search a shorter range"
        )


def _interpolate_peak(offsets_s: FloatArray, correlation: FloatArray, peak_index: int) -> ClockOffset:
    """Find the maximum of |r| within one lag of `peak_index`, on a spline of degree 5 through the eight neighbours on
    either side (fewer at an end of the range), in steps of 1/2000 of a lag."""
    from scipy.interpolate import make_interp_spline

    neighbours = slice(max(0, peak_index - 8), peak_index + 9)
    spline = make_interp_spline(
        offsets_s[neighbours] - offsets_s[peak_index], correlation[neighbours], k=min(5, len(correlation) - 1)
    )
    lag_s = offsets_s[1] - offsets_s[0]
    fine_offsets_s = np.linspace(-lag_s, lag_s, 4001)
    fine_correlation = spline(fine_offsets_s)
    fine_index = int(np.argmax(np.abs(fine_correlation)))
    return ClockOffset(float(offsets_s[peak_index] + fine_offsets_s[fine_index]), float(fine_correlation[fine_index]))
