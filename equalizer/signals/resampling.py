"""Resampling to a uniform time grid: zero-order hold, linear or band-limited interpolation.

The method must fit the signal. Zero-order hold is exact for a command that is held until the next command, which
interpolation would smear. Band-limited interpolation (a Kaiser-windowed low-pass) is exact up to `FLAT_TO` for a signal
that was sampled behind an anti-aliasing filter, to which a hold would add spectral images. Missing samples (NaN, gaps
in the time stamps) remain missing.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray

BoolArray = npt.NDArray[np.bool_]
Method = Literal["held", "linear", "band-limited"]
"""Interpolation method; "held" is a zero-order hold."""

FLAT_TO = 0.88
"""Edge of the flat passband of band-limited resampling, relative to the lower of both Nyquist frequencies, at which the
stopband begins."""
SAME_INSTANT = 1e-3
"""Largest difference of times that count as equal, in sample periods of the grid."""
ON_A_SAMPLE = 1e-5
"""Largest offset, in sample periods, of grid instants from samples that is ignored in band-limited resampling. At four
fifths of the Nyquist frequency it causes an error of about the stopband level of the filter."""
_HALF_LENGTH = 48
"""Half the length of the low-pass, in sample periods of the lower rate."""
_BETA = 8.6
"""Shape parameter of the Kaiser window, beta = 0.1102 (A - 8.7) by Kaiser's formula: A = 87 dB of attenuation."""
_UPSAMPLED = 8
"""Oversampling factor of the samples through which a spline is laid, where the rates have no simple ratio or the grid
begins between samples."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """One channel: values at increasing times. NaN is a missing value."""

    times_s: FloatArray
    """(n,), s."""
    values: FloatArray
    """(n,), in any unit."""
    rate_hz: float
    """Sample rate; 0 where the time stamps are not uniform."""
    gap_s: float
    """Neighbouring times further apart than this have missing samples between them."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Uniform time grid: `count` instants, 1 / rate_hz apart, the first at start_s."""

    start_s: float
    rate_hz: float
    count: int

    def times_s(self) -> FloatArray:
        """(count,): the instants (s)."""
        return self.start_s + np.arange(self.count) / self.rate_hz


def resample(samples: Samples, grid: Grid, method: Method) -> FloatArray:
    """Values at the grid's times, (count,), in the unit of the samples; NaN where samples are missing. Raises
    ValueError where fewer than two samples are known, or the grid begins before the first or ends after the last
    sample."""
    times_s = grid.times_s()
    near = SAME_INSTANT / grid.rate_hz
    if times_s[0] < samples.times_s[0] - near or times_s[-1] > samples.times_s[-1] + near:
        raise ValueError(
            f"the grid from {times_s[0]:g} to {times_s[-1]:g} s leaves the samples, {samples.times_s[0]:g} to "
            f"{samples.times_s[-1]:g} s"
        )
    good = np.isfinite(samples.values)
    if good.sum() < 2:
        raise ValueError("all samples but one are missing; at least two are needed")
    if method == "held":
        index = np.searchsorted(samples.times_s, times_s + near, side="right") - 1
        found: FloatArray = samples.values[np.maximum(index, 0)].copy()
    else:
        filled = np.interp(samples.times_s, samples.times_s[good], samples.values[good])
        whole = Samples(samples.times_s, filled, samples.rate_hz, samples.gap_s)
        found = np.interp(times_s, whole.times_s, filled) if method == "linear" else _resample_band_limited(whole, grid)
    found[_is_missing(samples, good, times_s, near, held=method == "held")] = np.nan
    return found


def _is_missing(samples: Samples, good: BoolArray, times_s: FloatArray, near: float, held: bool) -> BoolArray:
    """(count,): times before the first or after the last known sample, or between two known samples with missing
    samples between them. held: a value remains known for one median sample period. near: tolerance, s."""
    stamps, places = samples.times_s[good], np.flatnonzero(good)
    step = float(np.median(np.diff(samples.times_s)))
    hole = (np.diff(stamps) > samples.gap_s) | (np.diff(places) > 1)
    before = np.clip(np.searchsorted(stamps, times_s + near, side="right") - 1, 0, len(stamps) - 2)
    after_begin = times_s - stamps[before]
    inside = hole[before] & (after_begin > (step - near if held else near)) & (times_s < stamps[before + 1] - near)
    missing: BoolArray = inside | (times_s < stamps[0] - near) | (times_s > stamps[-1] + (step if held else near))
    return missing


def _resample_band_limited(samples: Samples, grid: Grid) -> FloatArray:
    """Polyphase filter where the rates have a simple ratio and the grid begins at a sample; else a spline on samples
    that are oversampled first."""
    if not samples.rate_hz:
        return _resample_uneven(samples, grid)
    first = (grid.start_s - samples.times_s[0]) * samples.rate_hz
    ratio = Fraction(grid.rate_hz / samples.rate_hz).limit_denominator(1000)
    exact = abs(float(ratio) * samples.rate_hz / grid.rate_hz - 1) * grid.count < ON_A_SAMPLE
    if exact and abs(first - round(first)) < ON_A_SAMPLE:
        return _resample_by_ratio(samples.values, ratio, round(first), grid.count)
    dense = _resample_by_ratio(samples.values, Fraction(_UPSAMPLED), 0, _UPSAMPLED * (len(samples.values) - 1) + 1)
    dense_rate_hz = _UPSAMPLED * samples.rate_hz
    times_s = samples.times_s[0] + np.arange(len(dense)) / dense_rate_hz
    return _resample_spline(times_s, dense, grid, samples.rate_hz)


def _resample_uneven(samples: Samples, grid: Grid) -> FloatArray:
    """Quintic spline through samples at uneven times. Gaps are bridged by straight lines first, because the spline
    would oscillate in them."""
    times_s, values = samples.times_s, samples.values
    steps = np.diff(times_s)
    median_s = float(np.median(steps))
    wide = np.flatnonzero(steps > samples.gap_s)
    if len(wide):
        between = [np.arange(times_s[i] + median_s, times_s[i + 1] - median_s / 2, median_s) for i in wide]
        every = np.sort(np.concatenate([times_s, *between]))
        times_s, values = every, np.interp(every, times_s, values)
    return _resample_spline(times_s, values, grid, 1 / median_s)


def _resample_spline(times_s: FloatArray, values: FloatArray, grid: Grid, source_rate_hz: float) -> FloatArray:
    """Quintic spline through the samples, at the times of the grid. Where the grid is slower than the source, the
    spline is evaluated on a finer grid and low-pass filtered, against aliasing."""
    # Imported here, as below: SciPy's signal and interpolation modules take long to import, and most runs need neither.
    from scipy.interpolate import make_interp_spline

    order = min(5, (len(values) - 1) // 2 * 2 + 1)
    origin_s = times_s[0]
    spline = make_interp_spline(times_s - origin_s, values, k=order)
    finer = int(np.ceil(2 * source_rate_hz / grid.rate_hz)) if grid.rate_hz < 0.99 * source_rate_hz else 1
    dense_times_s = grid.start_s - origin_s + np.arange((grid.count - 1) * finer + 1) / (grid.rate_hz * finer)
    dense: FloatArray = spline(np.clip(dense_times_s, 0.0, times_s[-1] - origin_s))
    return dense if finer == 1 else _resample_by_ratio(dense, Fraction(1, finer), 0, grid.count)


def _resample_by_ratio(values: FloatArray, ratio: Fraction, first: int, count: int) -> FloatArray:
    """Polyphase FIR resampling to `ratio` times the rate, `count` values from the sample `first` on. Ends are continued
    by point reflection."""
    from scipy import signal as sg

    up, down = ratio.numerator, ratio.denominator
    if ratio == 1:
        return values[first : first + count].copy()
    reach = _HALF_LENGTH * (max(up, down) // up + 1)
    pad = reach + (-(reach + first)) % down
    slower = max(up, down)
    taps = sg.firwin(2 * _HALF_LENGTH * slower + 1, (1 + FLAT_TO) / 2 / slower, window=("kaiser", _BETA))
    padded = np.pad(values, pad, mode="reflect", reflect_type="odd")
    whole: FloatArray = sg.resample_poly(padded, up, down, window=taps)
    start = (pad + first) * up // down
    return whole[start : start + count].copy()
