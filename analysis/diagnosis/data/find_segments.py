"""Finds periodic segments in a recording that declares none: parts whose command repeats exactly.

A candidate period is the first high peak of the command's autocorrelation. It is accepted only where the command
itself, sample by sample, repeats with it throughout the part; commands that were measured with noise, or repeat
approximately, are not used. Without such a part, no segments are declared.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.observed_parts import MOST_PERIODS, parts_of
from analysis.diagnosis.noise.rounding import rounding_step
from analysis.wording import conjoin
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal

SHORTEST = 16
"""Shortest period that is searched for, in samples."""
FEWEST_PERIODS = 3
"""Least number of periods of a part: the first contains the transient, and noise needs two more."""
SHORTEST_DECLARED = 256
"""Least period in samples for a diagnosis: of a shorter one an odd multiple is declared, so that odd lines stay odd."""
REPEAT_CORRELATION, DIP_CORRELATION = 0.98, 0.7
"""Least correlation of a command with itself one period later, and level below which it must fall in between."""
SINE_SHARE = 0.98
"""Share of the power on a single line above which a periodic command is a sine."""
EXACT_TOLERANCE = 1e-6
"""Largest difference of a command between periods, relative to its peak: rounding of numbers stored with six digits."""
ROUNDED_TOLERANCE = 1e-3
"""Largest rms difference between periods due to rounding, relative to the command's rms."""
MOST_SAMPLES = 2**19
"""Number of samples in which a period is searched for, which limits the time of the correlation."""
LARGEST_SAMPLE = 1e100
"""Largest sample whose squares can be summed without overflow; a damaged file may hold larger ones."""


def find_segments(recording: Recording) -> tuple[Recording, str]:
    """The recording with the segments found, and a sentence about them; unchanged and without a sentence where it has
    segments, or no part of its command repeats."""
    if recording.segments:
        return recording, ""
    parts = parts_of(recording)
    designed = find_designed_command(recording).samples
    periods = [exact_period(designed[start:stop]) for start, stop in parts]
    if not any(periods):
        return recording, ""
    segments = tuple(
        Segment(start, stop, _segment_kind(designed[start:stop], period), _peak(recording.command, start, stop), period)
        for (start, stop), period in zip(parts, periods, strict=True)
    )
    return replace(recording, segments=segments), _segments_sentence(segments)


def find_designed_command(recording: Recording) -> Signal:
    """The signal that was designed beforehand: the excitation where it was recorded and varies, else the command."""
    excitation = recording.excitation
    if excitation is None:
        return recording.command
    finite_samples = excitation.samples[np.isfinite(excitation.samples).all(axis=1)]
    return excitation if len(finite_samples) and np.ptp(finite_samples, axis=0).max() > 0 else recording.command


def exact_period(command: FloatArray) -> int:
    """Period in samples after which the command (n, m) repeats exactly; 0 where it does not, or not often enough. Where
    the shortest period has less than `SHORTEST_DECLARED` samples, an odd multiple of it."""
    period = find_period(command)
    if (
        not period
        or len(command) // period < FEWEST_PERIODS
        or not _repeats_exactly(command[period:], command[:-period])
    ):
        return 0
    if period >= SHORTEST_DECLARED:
        return period
    # The largest odd multiple of which `MOST_PERIODS` and a period of transient fit in; it is a period, too.
    periods_per_part = len(command) // period // (MOST_PERIODS + 1)
    multiple = period * max(1, periods_per_part - 1 + periods_per_part % 2)
    return multiple if multiple >= SHORTEST_DECLARED else 0


def find_period(command: FloatArray) -> int:
    """The shortest period in samples after which the command (n, m) nearly repeats, by autocorrelation; 0 = none."""
    used = command[:MOST_SAMPLES]
    largest = float(np.abs(used).max(initial=0.0))
    if LARGEST_SAMPLE < largest < np.inf:
        used = used / largest
    spread = np.std(used, axis=0) if used.size else np.zeros(command.shape[1])
    if not np.isfinite(used).all() or not (spread > 0).any() or len(used) < 2 * SHORTEST:
        return 0
    scaled = (used[:, spread > 0] - used[:, spread > 0].mean(axis=0)) / spread[spread > 0]
    correlation = _correlation(scaled)[: len(used) // 2 + 1]
    dips = np.flatnonzero(correlation < DIP_CORRELATION)
    if not len(dips):
        return 0
    high = np.flatnonzero(correlation[dips[0] :] > REPEAT_CORRELATION) + dips[0]
    if not len(high) or high[0] < SHORTEST:
        return 0
    # The maximum of the first run of consecutive lags that are high enough.
    last = high[0] + int(np.argmax(np.diff(np.append(high, high[-1] + 2)) > 1))
    return int(high[0] + np.argmax(correlation[high[0] : last + 1]))


def _correlation(samples: FloatArray) -> FloatArray:
    """(n,): autocorrelation by lag, normalised by the energy of both copies where they overlap."""
    n = len(samples)
    size = 2 ** int(np.ceil(np.log2(2 * n)))
    spectrum = np.fft.rfft(samples, size, axis=0)
    products = np.fft.irfft(np.sum(np.abs(spectrum) ** 2, axis=1), size)[:n]
    energy = np.concatenate([[0.0], np.cumsum(np.sum(samples**2, axis=1))])
    lags = np.arange(n)
    overlap_energy = energy[n - lags] * (energy[n] - energy[lags])
    return np.asarray(products / np.sqrt(np.maximum(overlap_energy, np.finfo(np.float64).tiny)))


def _repeats_exactly(later_period: FloatArray, earlier_period: FloatArray) -> bool:
    """Whether each channel repeats, up to rounding: to six digits, or by one step of its own resolution with an rms
    difference of at most `ROUNDED_TOLERANCE`."""
    if not np.isfinite(later_period).all() or not np.isfinite(earlier_period).all():
        return False
    for later_column, earlier_column in zip(later_period.T, earlier_period.T, strict=True):
        difference = np.abs(later_column - earlier_column)
        if difference.max() <= EXACT_TOLERANCE * np.abs(later_column).max():
            continue
        step = rounding_step(later_column)
        if difference.max() > 1.5 * step or np.sqrt(np.mean(difference**2)) > ROUNDED_TOLERANCE * np.std(later_column):
            return False
    return True


def _segment_kind(command: FloatArray, period: int) -> str:
    """Kind of a segment: noise without a period, sine with nearly all power on a single line, else multisine."""
    if not period:
        return "noise"
    power = np.sum(np.abs(np.fft.rfft(command[:period] - command[:period].mean(axis=0), axis=0)) ** 2, axis=1)
    return "sine" if power.max() > SINE_SHARE * power.sum() else "multisine"


def _peak(command: Signal, start: int, stop: int) -> float:
    """Largest magnitude of the finite samples from start to stop, over all channels; 0 without any."""
    samples = command.samples[start:stop]
    finite_samples = samples[np.isfinite(samples)]
    return float(np.abs(finite_samples).max()) if finite_samples.size else 0.0


def _segments_sentence(segments: Sequence[Segment]) -> str:
    periodic = [segment for segment in segments if segment.period]
    periods = conjoin([str(period) for period in sorted({segment.period for segment in periodic})])
    levels = conjoin([f"{level:.4g}" for level in sorted({segment.amplitude for segment in periodic})])
    subject = (
        "The command" if len(periodic) == len(segments) else f"In {len(periodic)} of {len(segments)} parts the command"
    )
    fewest = min((segment.stop - segment.start) // segment.period for segment in periodic)
    return (
        f"{subject} repeats exactly, every {periods} samples, {fewest} times or more in each part: segments with that "
        f"period were made, with peaks of {levels} (SI units)."
    )
