"""Resamples the accelerometer's samples to the ticks of the control loop; called by `sensor` after a recording.

The clock of the sensor's board is fitted (`clock_fit`), separately between restarts of the board. Then a zero-phase
anti-aliasing low-pass, a Kaiser-windowed sinc centred on each tick t, is evaluated over the samples at their times t_i:

    value(t) = sum_i w_i x_i / sum_i w_i,    w_i = sinc(2 f_c (t_i - t)) kaiser(t_i - t) dt_i

f_c is `CORNER_RATIO` times the lower of both rates; dt_i is the spacing of the samples around t_i.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.clock_fit import ClockFit, fit_clock
from study.devices.accelerometer.history import ArrivedSamples

CORNER_RATIO = 0.42
"""Corner frequency of the low-pass (-6 dB), relative to the lower of both rates; chosen with `HALF_LENGTH_PERIODS` and
`KAISER_BETA`."""

HALF_LENGTH_PERIODS = 16
"""Half the length of the low-pass's impulse response, in periods of the lower rate; chosen with `CORNER_RATIO` and
`KAISER_BETA`."""

KAISER_BETA = 8.0
"""Shape parameter of the low-pass's Kaiser window. With `CORNER_RATIO` and the filter's length: flat up to 0.33 of the
lower rate, 80 dB down from half of it on."""

LONGEST_GAP_PERIODS = 2.5
"""Longest accepted gap between two samples, in periods of the lower rate: at least one lost sample is tolerated. Ticks
near a longer gap get NaN. Chosen."""

SHORTEST_FIT_S = 1.0
"""Shortest time span of arrivals (s) to which a clock is fitted: over this time a delay of 0.1 ms is an error of 100
ppm in its rate. Chosen."""

ARRIVALS_PER_S = 50.0
"""Largest number of arrivals per second to which the clock is fitted: the least delayed arrival of each interval,
because a delay contains no information about the clock. Chosen."""

CHUNK_TICKS = 4096
"""Approximate number of ticks that are resampled in a single array operation, which limits the memory needed.
Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class ResampledValues:
    """Sensor values resampled to the ticks of the loop."""

    values: FloatArray
    """(k, channels) at the ticks; NaN where samples are missing."""
    fit: ClockFit | None
    """Fit of the clock between the two restarts with the most samples between them; None where no clock could be
    fitted."""


def fit_and_resample(
    arrived_samples: ArrivedSamples, values: FloatArray, tick_s: FloatArray, rate_hz: float
) -> ResampledValues:
    """Fit the clock and resample to the ticks. values: (n, channels), of the n samples of `arrived_samples`; tick_s:
    (k,), times at which the ticks were due (s), rising by 1 / rate_hz. Samples between two restarts of the board are
    left out where their arrivals span less than `SHORTEST_FIT_S`."""
    host_s = np.full(len(arrived_samples.device_s), np.nan)
    main_fit: ClockFit | None = None
    largest_count = 0
    for restarts in np.unique(arrived_samples.last_restarts):
        is_arrival, is_sample = arrived_samples.last_restarts == restarts, arrived_samples.restarts == restarts
        device_s, arrived_s = arrived_samples.last_device_s[is_arrival], arrived_samples.arrived_s[is_arrival]
        if device_s[-1] - device_s[0] < SHORTEST_FIT_S:
            continue
        fit = fit_clock(*_select_least_delayed(device_s, arrived_s))
        host_s[is_sample] = fit.to_host_s(arrived_samples.device_s[is_sample])
        if is_sample.sum() > largest_count:
            main_fit, largest_count = fit, int(is_sample.sum())
    has_host_time = np.isfinite(host_s)
    time_order = np.argsort(host_s[has_host_time], kind="stable")
    return ResampledValues(
        resample(host_s[has_host_time][time_order], values[has_host_time][time_order], tick_s, rate_hz), main_fit
    )


def resample(sample_s: FloatArray, values: FloatArray, tick_s: FloatArray, rate_hz: float) -> FloatArray:
    """Resample to the ticks with the low-pass: (k, channels); NaN near gaps, near the ends of the samples, and with
    fewer than two samples. sample_s: (n,), times of the samples (s), rising; values: (n, channels); tick_s: (k,), times
    of the ticks (s), 1 / rate_hz apart."""
    resampled = np.full((len(tick_s), values.shape[1]), np.nan)
    if len(sample_s) < 2:
        return resampled
    period_s = float(np.median(np.diff(sample_s)))
    lower_rate_hz = min(rate_hz, 1.0 / period_s)
    half_length_s = HALF_LENGTH_PERIODS / lower_rate_hz
    is_covered = _has_no_gap(sample_s, tick_s, half_length_s, LONGEST_GAP_PERIODS / lower_rate_hz)
    # The spacing of the samples varies: each is weighted by the time interval that it represents.
    spacing_s = np.gradient(sample_s)
    # Right half of a Kaiser window of 4097 points, fine enough for linear interpolation at each distance from the tick.
    window = np.kaiser(4097, KAISER_BETA)[2048:]
    # The filter covers 2 half_length_s / period_s samples on average; the tenth more allows for an irregular spacing.
    offsets = np.arange(-1, 2 + int(np.ceil(2.2 * half_length_s / period_s)))
    for tick_chunk in np.array_split(np.flatnonzero(is_covered), max(1, len(tick_s) // CHUNK_TICKS)):
        first_indices = np.searchsorted(sample_s, tick_s[tick_chunk] - half_length_s)
        sample_indices = (first_indices[:, None] + offsets).clip(0, len(sample_s) - 1)
        distance_s = sample_s[sample_indices] - tick_s[tick_chunk, None]
        is_outside = (np.abs(distance_s) >= half_length_s) | (first_indices[:, None] + offsets != sample_indices)
        weights = np.sinc(2 * CORNER_RATIO * lower_rate_hz * distance_s)
        weights *= (
            np.interp(np.abs(distance_s), np.linspace(0.0, half_length_s, len(window)), window)
            * spacing_s[sample_indices]
        )
        weights[is_outside] = 0.0
        resampled[tick_chunk] = np.einsum("kn,knc->kc", weights, values[sample_indices]) / weights.sum(axis=1)[:, None]
    return resampled


def _has_no_gap(sample_s: FloatArray, tick_s: FloatArray, half_length_s: float, longest_gap_s: float) -> np.ndarray:
    """Whether the samples within half_length_s (s) of each tick have no gap longer than longest_gap_s (s), (k,); the
    distance of the first or last sample from the end of that interval counts as a gap."""
    in_range = (tick_s - half_length_s >= sample_s[0] - longest_gap_s) & (
        tick_s + half_length_s <= sample_s[-1] + longest_gap_s
    )
    gap_indices = np.flatnonzero(np.diff(sample_s) > longest_gap_s)
    gap_starts_s, gap_ends_s = sample_s[gap_indices] - half_length_s, sample_s[gap_indices + 1] + half_length_s
    in_gap = np.searchsorted(gap_starts_s, tick_s, "right") > np.searchsorted(gap_ends_s, tick_s, "right")
    return np.asarray(in_range & ~in_gap)


def _select_least_delayed(device_s: FloatArray, arrived_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Select the least delayed arrival in each interval of 1 / `ARRIVALS_PER_S`: device times and host times (s)."""
    interval_numbers = ((device_s - device_s[0]) * ARRIVALS_PER_S).astype(np.int64)
    delay_order = np.lexsort((arrived_s - device_s, interval_numbers))
    selected_indices = np.sort(delay_order[np.unique(interval_numbers[delay_order], return_index=True)[1]])
    return device_s[selected_indices], arrived_s[selected_indices]
