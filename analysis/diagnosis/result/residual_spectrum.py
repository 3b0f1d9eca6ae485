"""Residual spectra on held-out data, beside the noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.findings import TimeSeries
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import spectral_density

_LENGTH = 2048
"""Samples of a Welch window."""
_PER_OCTAVE = 6
"""Bins per octave of the drawn spectrum."""


@dataclass(frozen=True, slots=True, eq=False)
class RemainderSpectrum:
    """Amplitude densities of one channel, in its unit per root hertz; all (lines,)."""

    channel: str
    unit: str
    frequency_hz: FloatArray
    measured: FloatArray
    before: FloatArray
    retuned: FloatArray
    after: FloatArray
    noise: FloatArray
    """Density of the noise; NaN where not known."""


def remainder_spectra(time_series: Sequence[TimeSeries], floor: NoiseFloor | None) -> tuple[RemainderSpectrum, ...]:
    """One per channel, over all held-out stretches; in sixths of an octave. Empty where nothing was held out."""
    parts = [(series, start, stop) for series in time_series for start, stop in series.tested if stop - start >= 64]
    if not parts:
        return ()
    first = parts[0][0]
    parts = [part for part in parts if part[0].channels == first.channels]
    rate_hz = min(series.sample_rate_hz for series, _, _ in parts)
    length = min(_LENGTH, min(stop - start for _, start, stop in parts))
    lines_hz: FloatArray = np.fft.rfftfreq(length, 1 / rate_hz)[1:].astype(np.float64)
    weights = np.array([stop - start for _, start, stop in parts], dtype=float)
    power = {
        name: np.average([_power(part, name, length) for part in parts], axis=0, weights=weights)[1:]
        for name in ("measured", "before", "retuned", "after")
    }
    group = np.floor(_PER_OCTAVE * np.log2(lines_hz)).astype(int)
    count = np.unique(group, return_counts=True)[1]

    def means(values: FloatArray) -> FloatArray:
        sums = np.add.reduceat(values, np.flatnonzero(np.diff(group, prepend=group[0] - 1)), axis=0)
        return np.asarray(sums / count.reshape((-1,) + (1,) * (values.ndim - 1)))

    noise = np.sqrt(means(_noise_power(floor, lines_hz, rate_hz, len(first.channels))))
    shown = {name: np.sqrt(means(each)) for name, each in power.items()}
    at = np.exp(means(np.log(lines_hz)))
    return tuple(
        RemainderSpectrum(
            name, first.units[k], at, shown["measured"][:, k], shown["before"][:, k], shown["retuned"][:, k],
            shown["after"][:, k], noise[:, k],
        )
        for k, name in enumerate(first.channels)
    )  # fmt: skip


def _power(part: tuple[TimeSeries, int, int], name: str, length: int) -> FloatArray:
    """(lines, channels)"""
    series, start, stop = part
    measured = series.measured[start:stop]
    values = measured if name == "measured" else measured - getattr(series, name)[start:stop]
    known = np.nan_to_num(values)
    return spectral_density(known, series.sample_rate_hz, length)[1]


def _noise_power(floor: NoiseFloor | None, lines_hz: FloatArray, rate_hz: float, channels: int) -> FloatArray:
    """(lines, channels), one-sided density."""
    unknown = np.full((len(lines_hz), channels), np.nan)
    if floor is None or not floor.known:
        return unknown
    parts = [floor.response.density] + ([] if floor.position is None else [floor.position.density])
    density = np.hstack(parts)
    for k in range(min(channels, density.shape[1])):
        unknown[:, k] = np.interp(lines_hz, floor.frequency_hz, density[:, k]) * 2 / rate_hz
    return unknown
