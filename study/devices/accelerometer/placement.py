"""Resamples the accelerometer's samples to the ticks of the control loop, by the fitted clock.

Between two restarts of the sensor's board its clock is fitted separately (`clock_fit`). Then a zero-phase anti-aliasing
low-pass, a Kaiser-windowed sinc centred on each tick t, is evaluated over the samples at their own times t_i:

    value(t) = sum_i w_i x_i / sum_i w_i,    w_i = sinc(2 f_c (t_i - t)) kaiser(t_i - t) dt_i

f_c is `CORNER` times the lower of both rates; dt_i is the spacing of the samples around t_i.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.clock_fit import ClockFit, fit_clock
from study.devices.accelerometer.history import ArrivedSamples

CORNER = 0.42
"""Corner frequency of the low-pass (-6 dB), relative to the lower of both rates."""

HALF_PERIODS = 16
"""Half the length of the low-pass's impulse response, in periods of the lower rate."""

KAISER_BETA = 8.0
"""Shape of the low-pass's Kaiser window. With `CORNER` and the filter's length: flat up to 0.33 of the lower rate, 80
dB down from half of it on."""

LONGEST_GAP = 2.5
"""Longest gap between two samples, in periods of the lower rate: ticks near a longer gap have no value."""

LEAST_FIT_S = 1.0
"""Shortest stretch of arrivals (s) to which a clock is fitted: over this time a delay of 0.1 ms is already an error of
100 ppm in its rate."""

POINTS_PER_S = 50.0
"""Largest number of arrivals per second to which the clock is fitted. The least delayed ones are selected, because a
delay contains no information about the clock."""

CHUNK_TICKS = 4096
"""Approximate number of ticks that are resampled in a single array operation, which limits the memory needed."""


@dataclass(frozen=True, slots=True, eq=False)
class ResampledValues:
    """Sensor values resampled to the ticks of the loop."""

    values: FloatArray
    """(k, channels) at the ticks; NaN where samples are missing."""
    fit: ClockFit | None
    """Fit of the clock to which most samples belong; None where none could be fitted."""


def fit_and_resample(
    interval: ArrivedSamples, values: FloatArray, tick_s: FloatArray, rate_hz: float
) -> ResampledValues:
    """Fit the clock and resample to the ticks. values: (n, channels), of the n samples of `interval`; tick_s: (k,),
    times at which the ticks were due (s), rising by 1 / rate_hz. Samples of a clock that cannot be fitted are left
    out."""
    host_s = np.full(len(interval.device_s), np.nan)
    best: ClockFit | None = None
    largest_count = 0
    for clock in np.unique(interval.last_restarts):
        arrivals, samples = interval.last_restarts == clock, interval.restarts == clock
        device_s, arrived_s = interval.last_device_s[arrivals], interval.arrived_s[arrivals]
        if device_s[-1] - device_s[0] < LEAST_FIT_S:
            continue
        fit = fit_clock(*_select_least_delayed(device_s, arrived_s))
        host_s[samples] = fit.host_s(interval.device_s[samples])
        if samples.sum() > largest_count:
            best, largest_count = fit, int(samples.sum())
    has_host_time = np.isfinite(host_s)
    order = np.argsort(host_s[has_host_time], kind="stable")
    return ResampledValues(resample(host_s[has_host_time][order], values[has_host_time][order], tick_s, rate_hz), best)


def resample(sample_s: FloatArray, values: FloatArray, tick_s: FloatArray, rate_hz: float) -> FloatArray:
    """Values at the ticks, (k, channels); NaN near gaps and with fewer than two samples. sample_s: (n,), times of the
    samples (s), rising; values: (n, channels); tick_s: (k,), times of the ticks (s), 1 / rate_hz apart."""
    resampled = np.full((len(tick_s), values.shape[1]), np.nan)
    if len(sample_s) < 2:
        return resampled
    period_s = float(np.median(np.diff(sample_s)))
    lower_hz = min(rate_hz, 1.0 / period_s)
    half_s = HALF_PERIODS / lower_hz
    is_covered = _has_no_gap(sample_s, tick_s, half_s, LONGEST_GAP / lower_hz)
    # The spacing of the samples varies: each is weighted by the time interval that it represents.
    spacing_s = np.gradient(sample_s)
    # Right half of the Kaiser window, interpolated at each distance from the tick.
    window = np.kaiser(4097, KAISER_BETA)[2048:]
    offsets = np.arange(-1, 2 + int(np.ceil(2.2 * half_s / period_s)))
    for chunk in np.array_split(np.flatnonzero(is_covered), max(1, len(tick_s) // CHUNK_TICKS)):
        first = np.searchsorted(sample_s, tick_s[chunk] - half_s)
        sample_index = (first[:, None] + offsets).clip(0, len(sample_s) - 1)
        distance_s = sample_s[sample_index] - tick_s[chunk, None]
        is_outside = (np.abs(distance_s) >= half_s) | (first[:, None] + offsets != sample_index)
        weights = np.sinc(2 * CORNER * lower_hz * distance_s)
        weights *= (
            np.interp(np.abs(distance_s), np.linspace(0.0, half_s, len(window)), window) * spacing_s[sample_index]
        )
        weights[is_outside] = 0.0
        resampled[chunk] = np.einsum("kn,knc->kc", weights, values[sample_index]) / weights.sum(axis=1)[:, None]
    return resampled


def _has_no_gap(sample_s: FloatArray, tick_s: FloatArray, half_s: float, longest_s: float) -> np.ndarray:
    """(k,), whether the samples within half_s of each tick cover it without a gap longer than longest_s."""
    in_range = (tick_s - half_s >= sample_s[0] - longest_s) & (tick_s + half_s <= sample_s[-1] + longest_s)
    gaps = np.flatnonzero(np.diff(sample_s) > longest_s)
    gap_starts_s, gap_ends_s = sample_s[gaps] - half_s, sample_s[gaps + 1] + half_s
    in_gap = np.searchsorted(gap_starts_s, tick_s, "right") > np.searchsorted(gap_ends_s, tick_s, "right")
    return np.asarray(in_range & ~in_gap)


def _select_least_delayed(device_s: FloatArray, arrived_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Select the least delayed arrival in each interval of 1 / POINTS_PER_S: its device time and its host time (s)."""
    bins = ((device_s - device_s[0]) * POINTS_PER_S).astype(np.int64)
    order = np.lexsort((arrived_s - device_s, bins))
    chosen = np.sort(order[np.unique(bins[order], return_index=True)[1]])
    return device_s[chosen], arrived_s[chosen]
