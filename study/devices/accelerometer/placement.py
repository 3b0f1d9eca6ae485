"""Resamples the board's samples to the ticks of the loop, by the fitted clock.

Each clock between two restarts of the board is fitted by itself (`clock_fit`). Then a low-pass without delay (a
windowed sinc about each tick, over the samples as they lie in time) keeps what a rate of ticks can show and takes away
what it would alias.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.clock_fit import ClockFit, fit_clock
from study.devices.accelerometer.history import ArrivedSamples

CORNER = 0.42
"""Frequency of the low-pass's -6 dB, relative to the lower of both rates."""

HALF_PERIODS = 16
"""Half the length of the low-pass, in periods of the lower rate."""

KAISER_BETA = 8.0
"""Shape of the low-pass's Kaiser window. With `CORNER` and the filter's length: flat up to 0.33 of the lower rate, 80
dB down from half of it on."""

LONGEST_GAP = 2.5
"""Periods of the lower rate: samples further apart leave the ticks about them without a value."""

LEAST_FIT_S = 1.0
"""Shorter stretches of a clock are too short to be fitted: an arrival that is 0.1 ms late would be 100 ppm."""

POINTS_PER_S = 50.0
"""Most arrivals per second that the clock is fitted to: the least delayed ones, because a delay says nothing about the
clock."""

AT_ONCE = 4096
"""Ticks."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedSamples:
    """Sensor values resampled to the ticks of the loop."""

    values: FloatArray
    """(k, channels) at the ticks; NaN where samples are missing."""
    fit: ClockFit | None
    """Fit of the clock to which most samples belong; None where none could be fitted."""


def place(stretch: ArrivedSamples, values: FloatArray, tick_s: FloatArray, rate_hz: float) -> PlacedSamples:
    """Resample samples to the ticks of the loop. values: (n, channels) of the samples; tick_s: (k,), rising, when the
    ticks were due, rate_hz apart."""
    host_s = np.full(len(stretch.device_s), np.nan)
    best: ClockFit | None = None
    most = 0
    for clock in np.unique(stretch.last_restarts):
        arrivals, samples = stretch.last_restarts == clock, stretch.restarts == clock
        device_s, arrived_s = stretch.last_device_s[arrivals], stretch.arrived_s[arrivals]
        if device_s[-1] - device_s[0] < LEAST_FIT_S:
            continue
        fit = fit_clock(*_promptest(device_s, arrived_s))
        host_s[samples] = fit.host_s(stretch.device_s[samples])
        if samples.sum() > most:
            best, most = fit, int(samples.sum())
    known = np.isfinite(host_s)
    order = np.argsort(host_s[known], kind="stable")
    return PlacedSamples(resample(host_s[known][order], values[known][order], tick_s, rate_hz), best)


def resample(sample_s: FloatArray, values: FloatArray, tick_s: FloatArray, rate_hz: float) -> FloatArray:
    """(k, channels). sample_s: (n,), rising; values: (n, channels); tick_s: (k,), rate_hz apart."""
    placed = np.full((len(tick_s), values.shape[1]), np.nan)
    if len(sample_s) < 2:
        return placed
    period_s = float(np.median(np.diff(sample_s)))
    lower_hz = min(rate_hz, 1.0 / period_s)
    half_s = HALF_PERIODS / lower_hz
    whole = _is_without_gap(sample_s, tick_s, half_s, LONGEST_GAP / lower_hz)
    # Samples lie closer where the board was late: each counts for the time that it stands for.
    stands_for_s = np.gradient(sample_s)
    window = np.kaiser(4097, KAISER_BETA)[2048:]
    reach = np.arange(-1, 2 + int(np.ceil(2.2 * half_s / period_s)))
    for chunk in np.array_split(np.flatnonzero(whole), max(1, len(tick_s) // AT_ONCE)):
        first = np.searchsorted(sample_s, tick_s[chunk] - half_s)
        at = (first[:, None] + reach).clip(0, len(sample_s) - 1)
        apart_s = sample_s[at] - tick_s[chunk, None]
        outside = (np.abs(apart_s) >= half_s) | (first[:, None] + reach != at)
        weights = np.sinc(2 * CORNER * lower_hz * apart_s)
        weights *= np.interp(np.abs(apart_s), np.linspace(0.0, half_s, len(window)), window) * stands_for_s[at]
        weights[outside] = 0.0
        placed[chunk] = np.einsum("kn,knc->kc", weights, values[at]) / weights.sum(axis=1)[:, None]
    return placed


def _is_without_gap(sample_s: FloatArray, tick_s: FloatArray, half_s: float, longest_s: float) -> np.ndarray:
    """(k,), whether the samples about each tick are without a gap."""
    inside = (tick_s - half_s >= sample_s[0] - longest_s) & (tick_s + half_s <= sample_s[-1] + longest_s)
    gaps = np.flatnonzero(np.diff(sample_s) > longest_s)
    begins, ends = sample_s[gaps] - half_s, sample_s[gaps + 1] + half_s
    in_gap = np.searchsorted(begins, tick_s, "right") > np.searchsorted(ends, tick_s, "right")
    return np.asarray(inside & ~in_gap)


def _promptest(device_s: FloatArray, arrived_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Select the least delayed arrival of each fiftieth of a second."""
    bins = ((device_s - device_s[0]) * POINTS_PER_S).astype(np.int64)
    order = np.lexsort((arrived_s - device_s, bins))
    chosen = np.sort(order[np.unique(bins[order], return_index=True)[1]])
    return device_s[chosen], arrived_s[chosen]
