"""Resampling to a uniform time grid: zero-order hold, linear or band-limited interpolation.

The method must suit the signal. Zero-order hold is exact for a command that is held until the next command.
Band-limited interpolation (a Kaiser-windowed low pass; for uneven times, a spline) is accurate up to `PASSBAND` for a
signal that was sampled behind an anti-aliasing filter; a hold would add spectral images. Missing samples (NaN, gaps in
the time stamps) remain missing.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np

from equalizer.signals.signal import BoolArray, FloatArray

Method = Literal["held", "linear", "band-limited"]
"""Interpolation method; "held" is a zero-order hold."""

PASSBAND = 0.88
"""Edge of the flat passband of band-limited resampling, relative to the lower of both Nyquist frequencies, at which the
stopband begins. Chosen: a wider passband needs a longer low pass."""
TIME_TOLERANCE = 1e-3
"""Largest difference of times that count as equal, in sample periods of the grid. Chosen: far above the rounding of
time stamps, far below a period."""
SAMPLE_TOLERANCE = 1e-5
"""Largest offset, in sample periods, of grid instants from samples that is ignored in band-limited resampling. For a
sinusoid at four fifths of the Nyquist frequency, an error of 0.8 pi 1e-5 (-92 dB): about the filter's stopband level.
"""
_HALF_LENGTH_PERIODS = 48
"""Half the length of the low pass, in sample periods of the lower rate. By Kaiser's formula, a transition band of
1 - `PASSBAND` with `_KAISER_BETA` needs 46."""
_KAISER_BETA = 8.6
"""Shape parameter of the Kaiser window: by Kaiser's formula, 0.1102 (A - 8.7), for an attenuation A of 87 dB."""
_OVERSAMPLING = 8
"""Oversampling factor before spline interpolation, where the rates have no simple ratio or the grid begins between
samples. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """One channel: values at increasing times; NaN is a missing value."""

    times_s: FloatArray
    """(n,): times of the samples (s)."""
    values: FloatArray
    """(n,), in any unit."""
    rate_hz: float
    """Sample rate (Hz); 0 where the time stamps are not uniform."""
    gap_s: float
    """Longest distance (s) of neighbouring times without missing samples between them."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Uniform time grid: `count` instants, 1 / rate_hz apart, the first at start_s."""

    start_s: float
    rate_hz: float
    count: int

    def compute_times_s(self) -> FloatArray:
        """Compute the instants (count,), s."""
        return self.start_s + np.arange(self.count) / self.rate_hz


def resample(samples: Samples, grid: Grid, method: Method) -> FloatArray:
    """Resample to the times of the grid: (count,), in the unit of the samples; NaN where samples are missing. Raises
    ValueError where fewer than two samples are finite, or the grid begins before the first or ends after the last
    sample by more than `TIME_TOLERANCE`. Neither may be empty."""
    times_s = grid.compute_times_s()
    tolerance_s = TIME_TOLERANCE / grid.rate_hz
    if times_s[0] < samples.times_s[0] - tolerance_s or times_s[-1] > samples.times_s[-1] + tolerance_s:
        raise ValueError(
            f"the grid from {times_s[0]:g} to {times_s[-1]:g} s leaves the samples, {samples.times_s[0]:g} to "
            f"{samples.times_s[-1]:g} s"
        )
    is_finite = np.isfinite(samples.values)
    if is_finite.sum() < 2:
        raise ValueError("fewer than two samples have a value; at least two are needed")
    if method == "held":
        sample_indices = np.searchsorted(samples.times_s, times_s + tolerance_s, side="right") - 1
        resampled: FloatArray = samples.values[np.maximum(sample_indices, 0)].copy()
    else:
        interpolated_values = np.interp(samples.times_s, samples.times_s[is_finite], samples.values[is_finite])
        complete_samples = Samples(samples.times_s, interpolated_values, samples.rate_hz, samples.gap_s)
        resampled = (
            np.interp(times_s, complete_samples.times_s, interpolated_values)
            if method == "linear"
            else _resample_band_limited(complete_samples, grid)
        )
    resampled[_mark_missing(samples, is_finite, times_s, tolerance_s, is_held=method == "held")] = np.nan
    return resampled


def _mark_missing(
    samples: Samples, is_finite: BoolArray, times_s: FloatArray, tolerance_s: float, is_held: bool
) -> BoolArray:
    """Mark the grid's times, (count,), before the first or after the last finite sample, or between two of them with
    missing samples between. is_held: a value remains known for one median sample period. tolerance_s: see
    `TIME_TOLERANCE`."""
    known_times_s, known_indices = samples.times_s[is_finite], np.flatnonzero(is_finite)
    period_s = float(np.median(np.diff(samples.times_s)))
    is_gap_after = (np.diff(known_times_s) > samples.gap_s) | (np.diff(known_indices) > 1)
    previous_indices = np.clip(
        np.searchsorted(known_times_s, times_s + tolerance_s, side="right") - 1, 0, len(known_times_s) - 2
    )
    elapsed_s = times_s - known_times_s[previous_indices]
    is_in_gap = (
        is_gap_after[previous_indices]
        & (elapsed_s > (period_s - tolerance_s if is_held else tolerance_s))
        & (times_s < known_times_s[previous_indices + 1] - tolerance_s)
    )
    is_missing: BoolArray = (
        is_in_gap
        | (times_s < known_times_s[0] - tolerance_s)
        | (times_s > known_times_s[-1] + (period_s if is_held else tolerance_s))
    )
    return is_missing


def _resample_band_limited(samples: Samples, grid: Grid) -> FloatArray:
    """Resample by a polyphase filter where the rates have a simple ratio and the grid begins at a sample; else
    oversample, and interpolate by a spline. Simple: a denominator up to 1000, chosen, as the filter's length grows
    with it."""
    if not samples.rate_hz:
        return _resample_uneven(samples, grid)
    first_index = (grid.start_s - samples.times_s[0]) * samples.rate_hz
    ratio = Fraction(grid.rate_hz / samples.rate_hz).limit_denominator(1000)
    is_exact_ratio = abs(float(ratio) * samples.rate_hz / grid.rate_hz - 1) * grid.count < SAMPLE_TOLERANCE
    if is_exact_ratio and abs(first_index - round(first_index)) < SAMPLE_TOLERANCE:
        return _resample_by_ratio(samples.values, ratio, round(first_index), grid.count)
    oversampled_values = _resample_by_ratio(
        samples.values, Fraction(_OVERSAMPLING), 0, _OVERSAMPLING * (len(samples.values) - 1) + 1
    )
    oversampled_rate_hz = _OVERSAMPLING * samples.rate_hz
    times_s = samples.times_s[0] + np.arange(len(oversampled_values)) / oversampled_rate_hz
    return _resample_spline(times_s, oversampled_values, grid, samples.rate_hz)


def _resample_uneven(samples: Samples, grid: Grid) -> FloatArray:
    """Interpolate samples at uneven times by a quintic spline. Gaps are first filled by linear interpolation, because
    the spline would oscillate in them."""
    times_s, values = samples.times_s, samples.values
    steps_s = np.diff(times_s)
    period_s = float(np.median(steps_s))
    gap_indices = np.flatnonzero(steps_s > samples.gap_s)
    if len(gap_indices):
        gap_times_s = [np.arange(times_s[i] + period_s, times_s[i + 1] - period_s / 2, period_s) for i in gap_indices]
        all_times_s = np.sort(np.concatenate([times_s, *gap_times_s]))
        times_s, values = all_times_s, np.interp(all_times_s, times_s, values)
    return _resample_spline(times_s, values, grid, 1 / period_s)


def _resample_spline(times_s: FloatArray, values: FloatArray, grid: Grid, source_rate_hz: float) -> FloatArray:
    """Interpolate by a spline of degree 5 (3 for four or five samples, 1 for two or three) at the times of the grid.
    Where the grid is more than 1 % slower than the source (chosen), the spline is evaluated on a finer grid, of twice
    the source's rate or more, and low-pass filtered against aliasing."""
    # Imported here, as below: SciPy's signal and interpolation modules take long to import, and most runs need neither.
    from scipy.interpolate import make_interp_spline

    spline_degree = min(5, (len(values) - 2) // 2 * 2 + 1)
    origin_s = times_s[0]
    spline = make_interp_spline(times_s - origin_s, values, k=spline_degree)
    oversampling = int(np.ceil(2 * source_rate_hz / grid.rate_hz)) if grid.rate_hz < 0.99 * source_rate_hz else 1
    dense_times_s = (
        grid.start_s - origin_s + np.arange((grid.count - 1) * oversampling + 1) / (grid.rate_hz * oversampling)
    )
    dense_values: FloatArray = spline(np.clip(dense_times_s, 0.0, times_s[-1] - origin_s))
    return (
        dense_values
        if oversampling == 1
        else _resample_by_ratio(dense_values, Fraction(1, oversampling), 0, grid.count)
    )


def _resample_by_ratio(values: FloatArray, ratio: Fraction, first_sample: int, count: int) -> FloatArray:
    """Resample to `ratio` times the rate by a polyphase FIR filter: `count` values from the index `first_sample` of
    `values` on. Beyond the ends, values are extrapolated by point reflection."""
    from scipy import signal as sg

    up, down = ratio.numerator, ratio.denominator
    if ratio == 1:
        return values[first_sample : first_sample + count].copy()
    filter_margin = _HALF_LENGTH_PERIODS * (max(up, down) // up + 1)
    pad_length = filter_margin + (-(filter_margin + first_sample)) % down
    larger_factor = max(up, down)
    low_pass = sg.firwin(
        2 * _HALF_LENGTH_PERIODS * larger_factor + 1,
        (1 + PASSBAND) / 2 / larger_factor,
        window=("kaiser", _KAISER_BETA),
    )
    padded_values = np.pad(values, pad_length, mode="reflect", reflect_type="odd")
    resampled: FloatArray = sg.resample_poly(padded_values, up, down, window=low_pass)
    first_output = (pad_length + first_sample) * up // down
    return resampled[first_output : first_output + count].copy()
