"""Complete, settled periods of a recording's periodic segments, and their spectra."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import compute_line_spectra

_TRANSIENT_RATIO = 2.0
"""Largest energy ratio, first third over last third, of a period's difference from the segment's last period; above it
the difference still decays, so that the period contains the transient. Chosen by hand."""
_SHORTEST_PERIOD = 8
"""Shortest period that is used, in samples: a shorter one has too few spectral lines. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class Periods:
    """The usable periods of one periodic segment."""

    index: int
    """Index of the segment in the recording."""
    segment: Segment
    starts: tuple[int, ...]
    """First samples of the complete, settled periods; at least one as made by `find_settled_periods`."""
    settled: bool
    """False if only the segment's first period is usable, which contains the transient."""

    @property
    def length(self) -> int:
        """Number of samples of one period."""
        return self.segment.period

    @property
    def count(self) -> int:
        """Number of usable periods."""
        return len(self.starts)

    def compute_line_frequencies(self, sample_rate_hz: float) -> FloatArray:
        """Compute (lines,), Hz: frequencies of the lines of `compute_period_spectra`; not zero, nor half the rate."""
        lines: FloatArray = np.arange(1.0, (self.length + 1) // 2) * (sample_rate_hz / self.length)
        return lines


def find_settled_periods(recording: Recording) -> tuple[Periods, ...]:
    """Find the usable periods of the periodic segments. The first period is left out, unless it is the only complete
    one, and further ones until the transient has decayed; so are periods with missing samples, periods of fewer than
    `_SHORTEST_PERIOD` samples, and segments without a usable period."""
    usable_periods = []
    for index, segment in enumerate(recording.segments):
        if segment.period < _SHORTEST_PERIOD:
            continue
        period_starts = range(segment.start, segment.stop - segment.period + 1, segment.period)
        complete_starts = [start for start in period_starts if _is_complete(recording, start, segment.period)]
        settled_starts = _drop_transients(
            recording, [start for start in complete_starts if start != segment.start], segment.period
        )
        if settled_starts or complete_starts:
            usable_periods.append(
                Periods(index, segment, tuple(settled_starts or complete_starts), bool(settled_starts))
            )
    return tuple(usable_periods)


def stack_periods(samples: FloatArray, periods: Periods) -> FloatArray:
    """Stack the samples of the usable periods: (periods, length, channels). samples: (n, channels)."""
    return np.stack([samples[start : start + periods.length] for start in periods.starts])


def compute_period_spectra(samples: FloatArray, periods: Periods) -> ComplexArray:
    """Compute the spectrum (rfft / length) of each usable period: (periods, lines, channels), on the lines of
    `Periods.compute_line_frequencies`."""
    return compute_line_spectra(stack_periods(samples, periods))


def compute_mean_spectrum(samples: FloatArray, periods: Periods) -> ComplexArray:
    """Compute (lines, channels): spectrum of the mean period, rfft / length."""
    return np.asarray(compute_line_spectra(stack_periods(samples, periods).mean(axis=0, keepdims=True))[0])


def _is_complete(recording: Recording, start: int, length: int) -> bool:
    """Whether no sample of the period is missing (NaN), in command, response and position."""
    signals = [recording.command.samples, recording.response.samples]
    signals += [] if recording.position is None else [recording.position.samples]
    return all(bool(np.isfinite(samples[start : start + length]).all()) for samples in signals)


def _drop_transients(recording: Recording, starts: list[int], length: int) -> list[int]:
    """Return the starts of the periods after the transient: leading periods are dropped, except for the last two, while
    their difference from the last period decays within a period (`_TRANSIENT_RATIO`)."""
    samples, third_length = recording.response.samples, length // 3
    while len(starts) > 2:
        difference = samples[starts[0] : starts[0] + length] - samples[starts[-1] : starts[-1] + length]
        energy = np.sum((difference - difference.mean(axis=0)) ** 2, axis=1)
        if energy[:third_length].sum() <= _TRANSIENT_RATIO * energy[-third_length:].sum():
            break
        starts = starts[1:]
    return starts
