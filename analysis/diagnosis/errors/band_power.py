"""Error measure for impacts: differences of the power of each channel in each band and segment.

Impacts can make the motion chaotic: the waveforms of two simulations whose initial states differ by less than the
resolution of any sensor diverge, while their band amplitudes agree to a few per cent. Therefore ln a is compared, with
a² the mean power density in a band of half an octave (Welch's method, windows of 1 s at most); the noise's power is
added to a predicted a².
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
from equalizer.signals.spectral_density import estimate_spectral_density

WINDOW_S, OCTAVES = 1.0, 0.5
"""Length of a Welch window (s), and width of a band in octaves. Chosen."""
LOWEST_LINE, HIGHEST_SHARE = 2.0, 0.48
"""Lower end of the lowest band in lines of a window (1 / WINDOW_S), and upper limit of the highest band relative to the
sample rate, below the Nyquist frequency. Chosen."""
LONGEST_S, LEAST_SAMPLES = 8.0, 256
"""Longest stretch (s) of a record without segments, and least number of samples of any stretch. Chosen."""
LEAST_POWER_RATIO = 4.0
"""Ratio of a band's power to that of the noise, up to which a band is not compared. Chosen."""
ROLES = ("fit", "choose", "test")
"""Roles of samples, by the names of the masks of `Observed`."""
Residuals = tuple[FloatArray, ...]
"""Residuals of an error measure: per record (n, c), in units of `ErrorMeasure.unit`."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """Samples `start` to `stop` (exclusive) of the record with index `record`, all with the same role of `ROLES`."""

    record: int
    start: int
    stop: int
    role: str


@dataclass(frozen=True, eq=False)
class BandPower:
    """Band powers of the c signals of an error measure, measured and predicted, by stretch, band and channel."""

    measure: ErrorMeasure

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """Per segment (rest left out) and role, the longest run of samples with that role, if it has at least
        `LEAST_SAMPLES`. A record without segments in motion is divided into pieces of `LONGEST_S`."""
        return tuple(
            Stretch(record_index, start, stop, role)
            for record_index, record in enumerate(self.measure.records)
            for start, stop in self._list_spans(record_index)
            for role in ROLES
            for start, stop in _find_longest_run(getattr(record, role), start, stop)
        )

    @cached_property
    def measured(self) -> FloatArray:
        """(stretches, bands, c): ln a of the measured signals; NaN where the power is at most `LEAST_POWER_RATIO` times
        that of the noise."""
        power = self._compute_band_power([record.measured for record in self.measure.records])
        with np.errstate(divide="ignore"):
            return np.where(power > LEAST_POWER_RATIO * self._noise_density, 0.5 * np.log(power), np.nan)

    def predict(self, residuals: Residuals) -> FloatArray:
        """Compute ln a of the predicted signals, (stretches, bands, c), with the noise's power added."""
        unit = self.measure.unit
        predicted = [
            record.measured - residual * unit for record, residual in zip(self.measure.records, residuals, strict=True)
        ]
        return np.asarray(0.5 * np.log(self._compute_band_power(predicted) + self._noise_density))

    def compute_misfits(self, log_errors: FloatArray) -> FitScore:
        """Compute the rms (c,) of differences of ln a, (stretches, bands, c), by role; NaN without a compared band."""
        compared_errors = np.where(np.isnan(self.measured), np.nan, log_errors)
        return FitScore(
            *(_compute_rms(compared_errors[[stretch.role == role for stretch in self.stretches]]) for role in ROLES)
        )

    @cached_property
    def _band_edges_hz(self) -> FloatArray:
        """(bands + 1,), Hz: edges of the bands, at constant ratios."""
        rate_hz = self.measure.records[0].recording.sample_rate_hz
        band_count = int(np.log2(HIGHEST_SHARE * rate_hz * WINDOW_S / LOWEST_LINE) / OCTAVES)
        return np.asarray(LOWEST_LINE / WINDOW_S * 2.0 ** (OCTAVES * np.arange(max(band_count, 1) + 1)))

    @property
    def _noise_density(self) -> FloatArray:
        """(c,): one-sided power density of white noise with the rms of the measure's noise."""
        rate_hz = self.measure.records[0].recording.sample_rate_hz
        return np.asarray(self.measure.noise**2 / (rate_hz / 2))

    def _compute_band_power(self, signals: Sequence[FloatArray]) -> FloatArray:
        """Compute a², (stretches, bands, c): mean power density over the lines of each band, in units squared per
        hertz. A band between two lines has the density of the line above it. signals: (n, c) per record."""
        rate_hz = self.measure.records[0].recording.sample_rate_hz
        band_powers = np.empty((len(self.stretches), len(self._band_edges_hz) - 1, len(self.measure.noise)))
        for stretch_powers, stretch in zip(band_powers, self.stretches, strict=True):
            window_samples = min(int(WINDOW_S * rate_hz), stretch.stop - stretch.start)
            frequency_hz, density = estimate_spectral_density(
                signals[stretch.record][stretch.start : stretch.stop], rate_hz, window_samples
            )
            first_lines = np.searchsorted(frequency_hz, self._band_edges_hz)
            for band, (first_line, stop_line) in enumerate(pairwise(first_lines)):
                stretch_powers[band] = density[first_line : max(stop_line, first_line + 1)].mean(axis=0)
        return band_powers

    def _list_spans(self, record_index: int) -> list[tuple[int, int]]:
        """List start and stop of the segments of a record in motion or, where there are none, of its pieces."""
        record = self.measure.records[record_index]
        segments = [(segment.start, segment.stop) for segment in record.recording.segments if segment.kind != "rest"]
        length, longest_samples = len(record.measured), int(LONGEST_S * record.recording.sample_rate_hz)
        return segments or [
            (start, min(start + longest_samples, length)) for start in range(0, length, longest_samples)
        ]


def _find_longest_run(mask: Mask, start: int, stop: int) -> list[tuple[int, int]]:
    """Find start and stop of the longest run of True in the mask between start and stop; empty where it has fewer than
    `LEAST_SAMPLES` samples."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask[start:stop].astype(np.int8), [0]]))).reshape(-1, 2)
    runs = [
        (start + int(run_start), start + int(run_stop))
        for run_start, run_stop in edges
        if run_stop - run_start >= LEAST_SAMPLES
    ]
    return [max(runs, key=lambda run: run[1] - run[0])] if runs else []


def _compute_rms(log_errors: FloatArray) -> FloatArray:
    """Compute the rms (c,) over stretches and bands, without NaN; NaN where all are NaN."""
    compared_count = np.sum(np.isfinite(log_errors), axis=(0, 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(np.nansum(log_errors**2, axis=(0, 1)) / compared_count))
