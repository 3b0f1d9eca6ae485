"""Amplitude densities of the residuals on held-out data, with those of the signal and the noise.

Welch's spectra (`estimate_spectral_density`) of all held-out stretches, averaged in power with the lengths as
weights, then over sixths of an octave.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.findings import TimeSeries
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import estimate_spectral_density

_MAX_WINDOW_SAMPLES = 2048
"""Most samples of a Welch window; the shortest stretch limits it further."""
_BINS_PER_OCTAVE = 6
"""Bins per octave of the drawn spectrum."""


@dataclass(frozen=True, slots=True, eq=False)
class RemainderSpectrum:
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


def compute_remainder_spectra(
    time_series: Sequence[TimeSeries], floor: NoiseFloor | None
) -> tuple[RemainderSpectrum, ...]:
    """A spectrum per channel, over all held-out stretches of 64 samples or more in the recordings that have the first
    one's channels. Empty where there is no such stretch."""
    stretches = [(series, start, stop) for series in time_series for start, stop in series.tested if stop - start >= 64]
    if not stretches:
        return ()
    first = stretches[0][0]
    stretches = [stretch for stretch in stretches if stretch[0].channels == first.channels]
    rate_hz = min(series.sample_rate_hz for series, _, _ in stretches)
    window_samples = min(_MAX_WINDOW_SAMPLES, min(stop - start for _, start, stop in stretches))
    lines_hz: FloatArray = np.fft.rfftfreq(window_samples, 1 / rate_hz)[1:].astype(np.float64)
    weights = np.array([stop - start for _, start, stop in stretches], dtype=float)
    power = {
        name: np.average(
            [_compute_power(stretch, name, window_samples) for stretch in stretches], axis=0, weights=weights
        )[1:]
        for name in ("measured", "before", "retuned", "after")
    }
    bin_of_line = np.floor(_BINS_PER_OCTAVE * np.log2(lines_hz)).astype(int)
    count = np.unique(bin_of_line, return_counts=True)[1]

    def mean_per_bin(values: FloatArray) -> FloatArray:
        sums = np.add.reduceat(values, np.flatnonzero(np.diff(bin_of_line, prepend=bin_of_line[0] - 1)), axis=0)
        return np.asarray(sums / count.reshape((-1,) + (1,) * (values.ndim - 1)))

    noise = np.sqrt(mean_per_bin(_compute_noise_power(floor, lines_hz, rate_hz, len(first.channels))))
    densities = {name: np.sqrt(mean_per_bin(density)) for name, density in power.items()}
    centres_hz = np.exp(mean_per_bin(np.log(lines_hz)))
    return tuple(
        RemainderSpectrum(
            name, first.units[k], centres_hz, densities["measured"][:, k], densities["before"][:, k],
            densities["retuned"][:, k], densities["after"][:, k], noise[:, k],
        )
        for k, name in enumerate(first.channels)
    )  # fmt: skip


def _compute_power(part: tuple[TimeSeries, int, int], name: str, length: int) -> FloatArray:
    """(lines, channels): one-sided power density of the measured signal, or of the residual of the named prediction, in
    one stretch; missing samples count as 0."""
    series, start, stop = part
    measured = series.measured[start:stop]
    values = measured if name == "measured" else measured - getattr(series, name)[start:stop]
    finite_values = np.nan_to_num(values)
    return estimate_spectral_density(finite_values, series.sample_rate_hz, length)[1]


def _compute_noise_power(floor: NoiseFloor | None, lines_hz: FloatArray, rate_hz: float, channels: int) -> FloatArray:
    """(lines, channels): one-sided power density of the noise, in the channel's unit squared per hertz; NaN where
    unknown. `ChannelNoise.density` is s² for white noise of variance s², hence the factor 2 / rate_hz."""
    unknown = np.full((len(lines_hz), channels), np.nan)
    if floor is None or not floor.is_known:
        return unknown
    parts = [floor.response.density] + ([] if floor.position is None else [floor.position.density])
    floor_density = np.hstack(parts)
    for k in range(min(channels, floor_density.shape[1])):
        unknown[:, k] = np.interp(lines_hz, floor.frequency_hz, floor_density[:, k]) * 2 / rate_hz
    return unknown
