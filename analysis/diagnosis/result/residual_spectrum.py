"""Compute the amplitude densities of the residuals on held-out data, with those of the signal and the noise.

Welch's spectra (`estimate_spectral_density`) of held-out stretches are averaged in power with the lengths as weights,
then over sixths of an octave.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.findings import TimeSeries
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import estimate_spectral_density

_MAX_WINDOW_SAMPLES = 2048
"""Largest number of samples of a Welch window; the shortest stretch limits it further. Chosen."""
_BINS_PER_OCTAVE = 6
"""Bins per octave of the drawn spectrum. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldOutSpectrum:
    """Amplitude densities of one channel, in its unit per root hertz; arrays are (lines,), a line per sixth of an
    octave."""

    channel: str
    unit: str
    frequency_hz: FloatArray
    measured: FloatArray
    """Density of the measured signal."""
    before: FloatArray
    """Density of the residual of the model as given."""
    retuned: FloatArray
    """Density of the residual of the re-tuned model."""
    after: FloatArray
    """Density of the residual of the model with the named effects."""
    noise: FloatArray
    """Density of the noise; NaN where not known."""


def compute_held_out_spectra(
    time_series: Sequence[TimeSeries], floor: NoiseFloor | None
) -> tuple[HeldOutSpectrum, ...]:
    """Compute a spectrum per channel, over all held-out stretches of 64 samples (chosen) or more in the recordings that
    have the channels of the first such stretch. Empty where there is none. floor: noise of the first recording."""
    stretches = [(series, start, stop) for series in time_series for start, stop in series.tested if stop - start >= 64]
    if not stretches:
        return ()
    first_series = stretches[0][0]
    stretches = [stretch for stretch in stretches if stretch[0].channels == first_series.channels]
    rate_hz = min(series.sample_rate_hz for series, _, _ in stretches)
    window_samples = min(_MAX_WINDOW_SAMPLES, min(stop - start for _, start, stop in stretches))
    lines_hz: FloatArray = np.fft.rfftfreq(window_samples, 1 / rate_hz)[1:].astype(np.float64)
    weights = np.array([stop - start for _, start, stop in stretches], dtype=float)
    power_by_signal = {
        name: np.average(
            [_compute_power(stretch, name, window_samples) for stretch in stretches], axis=0, weights=weights
        )[1:]
        for name in ("measured", "before", "retuned", "after")
    }
    bin_numbers = np.floor(_BINS_PER_OCTAVE * np.log2(lines_hz)).astype(int)
    line_counts = np.unique(bin_numbers, return_counts=True)[1]

    def average_per_bin(values: FloatArray) -> FloatArray:
        sums = np.add.reduceat(values, np.flatnonzero(np.diff(bin_numbers, prepend=bin_numbers[0] - 1)), axis=0)
        return np.asarray(sums / line_counts.reshape((-1,) + (1,) * (values.ndim - 1)))

    noise = np.sqrt(average_per_bin(_compute_noise_power(floor, lines_hz, rate_hz, len(first_series.channels))))
    densities = {name: np.sqrt(average_per_bin(density)) for name, density in power_by_signal.items()}
    centres_hz = np.exp(average_per_bin(np.log(lines_hz)))
    return tuple(
        HeldOutSpectrum(
            name, first_series.units[channel], centres_hz, densities["measured"][:, channel],
            densities["before"][:, channel], densities["retuned"][:, channel], densities["after"][:, channel],
            noise[:, channel],
        )
        for channel, name in enumerate(first_series.channels)
    )  # fmt: skip


def _compute_power(stretch: tuple[TimeSeries, int, int], name: str, window_samples: int) -> FloatArray:
    """Compute (lines, channels): one-sided power density of the measured signal, or of the residual of the named
    prediction, in one stretch; missing samples count as 0. stretch: recording, first and end sample."""
    series, start, stop = stretch
    measured = series.measured[start:stop]
    values = measured if name == "measured" else measured - getattr(series, name)[start:stop]
    finite_values = np.nan_to_num(values)
    return estimate_spectral_density(finite_values, series.sample_rate_hz, window_samples)[1]


def _compute_noise_power(
    floor: NoiseFloor | None, lines_hz: FloatArray, rate_hz: float, channel_count: int
) -> FloatArray:
    """Compute (lines, channels): one-sided power density of the noise, in the channel's unit squared per hertz; NaN
    where unknown. `ChannelNoise.density` is s² for white noise of variance s², hence the factor 2 / rate_hz."""
    noise_power = np.full((len(lines_hz), channel_count), np.nan)
    if floor is None or not floor.is_known:
        return noise_power
    densities = [floor.response.density] + ([] if floor.position is None else [floor.position.density])
    floor_density = np.hstack(densities)
    for channel in range(min(channel_count, floor_density.shape[1])):
        noise_power[:, channel] = np.interp(lines_hz, floor.frequency_hz, floor_density[:, channel]) * 2 / rate_hz
    return noise_power
