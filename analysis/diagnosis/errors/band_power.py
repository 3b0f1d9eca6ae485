"""Error measure for impacts: the power of each channel in each band and segment, because waveforms are unpredictable.

The logarithm of the amplitude in half octaves (Welch's spectra over 1 s), the noise counted in. Two simulations of a
rattling device whose initial states differ by less than any sensor resolves agree in it to a few per cent, while their
waveforms do not (chaos).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import spectral_density

WINDOW_S, OCTAVES = 1.0, 0.5
"""Length of a Welch window in s, and width of a band in octaves."""
LOWEST, HIGHEST = 2.0, 0.48
"""Edges of the bands, relative to a window's own line, and relative to the sample rate."""
LONGEST_S, LEAST = 8.0, 256
"""Longest stretch without segments, and least samples of any stretch."""
HEARD = 4.0
"""Least ratio of a band's power to the noise's."""
PARTS = ("fit", "choose", "test")
Residuals = tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True)
class Stretch:
    """Samples of one record with one role (fit, choose or test)."""

    record: int
    first: int
    last: int
    part: str


@dataclass(frozen=True, eq=False)
class BandPower:
    """Band powers of the signals of an error measure, measured and predicted, by stretch, band and channel."""

    measure: ErrorMeasure

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """Per segment (rest left out) and role, the longest run of its samples, where that has `LEAST` or more. Without
        segments, pieces of `LONGEST_S` take their place."""
        return tuple(
            Stretch(number, first, last, part)
            for number, record in enumerate(self.measure.records)
            for first, last in self._spans(number)
            for part in PARTS
            for first, last in _longest_run(getattr(record, part), first, last)
        )

    @cached_property
    def measured(self) -> FloatArray:
        """(stretches, bands, c): logarithm of the amplitude; NaN where it is below the noise."""
        power = self._power([record.measured for record in self.measure.records])
        with np.errstate(divide="ignore"):
            return np.where(power > HEARD * self._noise, 0.5 * np.log(power), np.nan)

    def predict(self, residuals: Residuals) -> FloatArray:
        """(stretches, bands, c): logarithm of the predicted amplitude, the noise's power added."""
        unit = self.measure.unit
        predicted = [r.measured - left * unit for r, left in zip(self.measure.records, residuals, strict=True)]
        return np.asarray(0.5 * np.log(self._power(predicted) + self._noise))

    def misfits(self, off: FloatArray) -> FitScore:
        """Rms by channel of a difference of logarithms `off`, on the samples to fit, choose and test by; NaN = none."""
        known_errors = np.where(np.isnan(self.measured), np.nan, off)
        return FitScore(*(_rms(known_errors[[stretch.part == part for stretch in self.stretches]]) for part in PARTS))

    @cached_property
    def _edges(self) -> FloatArray:
        """(bands + 1,), Hz"""
        rate_hz = self.measure.records[0].recording.sample_rate_hz
        count = int(np.log2(HIGHEST * rate_hz * WINDOW_S / LOWEST) / OCTAVES)
        return np.asarray(LOWEST / WINDOW_S * 2.0 ** (OCTAVES * np.arange(max(count, 1) + 1)))

    @property
    def _noise(self) -> FloatArray:
        rate_hz = self.measure.records[0].recording.sample_rate_hz
        return np.asarray(self.measure.noise**2 / (rate_hz / 2))

    def _power(self, predicted: Sequence[FloatArray]) -> FloatArray:
        """(stretches, bands, c): mean density."""
        rate_hz = self.measure.records[0].recording.sample_rate_hz
        rows = np.empty((len(self.stretches), len(self._edges) - 1, len(self.measure.noise)))
        for row, stretch in zip(rows, self.stretches, strict=True):
            window = min(int(WINDOW_S * rate_hz), stretch.last - stretch.first)
            lines, density = spectral_density(predicted[stretch.record][stretch.first : stretch.last], rate_hz, window)
            firsts = np.searchsorted(lines, self._edges)
            for band, (low, high) in enumerate(pairwise(firsts)):
                row[band] = density[low : max(high, low + 1)].mean(axis=0)
        return rows

    def _spans(self, number: int) -> list[tuple[int, int]]:
        record = self.measure.records[number]
        segments = [(segment.start, segment.stop) for segment in record.recording.segments if segment.kind != "rest"]
        length, longest = len(record.measured), int(LONGEST_S * record.recording.sample_rate_hz)
        return segments or [(first, min(first + longest, length)) for first in range(0, length, longest)]


def _longest_run(mask: Mask, first: int, last: int) -> list[tuple[int, int]]:
    """The longest run of samples that count, between first and last; empty where it is short."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask[first:last].astype(np.int8), [0]]))).reshape(-1, 2)
    runs = [(first + int(a), first + int(b)) for a, b in edges if b - a >= LEAST]
    return [max(runs, key=lambda run: run[1] - run[0])] if runs else []


def _rms(off: FloatArray) -> FloatArray:
    count = np.sum(np.isfinite(off), axis=(0, 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(np.nansum(off**2, axis=(0, 1)) / count))
