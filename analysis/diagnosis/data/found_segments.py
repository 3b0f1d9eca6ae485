"""Finds periodic segments in a recording that declares none: parts whose command repeats exactly.

A period is accepted only where the command itself, sample by sample, repeats throughout the part; commands that were
measured with noise, or repeat approximately, are not used. Without such a part, no segments are declared.
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
LEAST_WHOLE = 3
"""Least number of periods of a part: the first contains the transient, and noise needs two more."""
LEAST_BY_ITSELF = 256
"""Least period in samples for a diagnosis: of a shorter one an odd multiple is declared, so that odd lines stay odd."""
ALIKE, DIPPED = 0.98, 0.7
"""Least correlation of a command with itself one period later, and level below which it must fall in between."""
EXACT = 1e-6
"""Largest difference of a command between periods, relative to its peak: rounding of numbers stored with six digits."""
ROUNDED = 1e-3
"""Largest rms difference between periods due to rounding, relative to the command's rms."""
MOST_SAMPLES = 2**19
"""Samples in which a period is looked for: limits the time of the correlation."""


def find_segments(recording: Recording) -> tuple[Recording, str]:
    """The recording with the segments found, and a sentence about them; unchanged and without a sentence where it has
    segments, or no part of its command repeats."""
    if recording.segments:
        return recording, ""
    parts = parts_of(recording)
    decided = designed_command(recording).samples
    periods = [exact_period(decided[start:stop]) for start, stop in parts]
    if not any(periods):
        return recording, ""
    segments = tuple(
        Segment(start, stop, _segment_kind(decided[start:stop], period), _peak(recording.command, start, stop), period)
        for (start, stop), period in zip(parts, periods, strict=True)
    )
    return replace(recording, segments=segments), _segments_sentence(segments)


def designed_command(recording: Recording) -> Signal:
    """The signal that was designed beforehand: the excitation where one was recorded and varies, else the command."""
    excitation = recording.excitation
    if excitation is None:
        return recording.command
    known = excitation.samples[np.isfinite(excitation.samples).all(axis=1)]
    return excitation if len(known) and np.ptp(known, axis=0).max() > 0 else recording.command


HUGE = 1e100
"""Values that no signal has, but a damaged file may."""


def exact_period(command: FloatArray) -> int:
    """Period in samples after which the command (n, m) repeats exactly; 0 where it does not, or not often enough. An
    odd multiple of the shortest period where that is too short to be of use."""
    period = find_period(command)
    if not period or len(command) // period < LEAST_WHOLE or not _is_same(command[period:], command[:-period]):
        return 0
    if period >= LEAST_BY_ITSELF:
        return period
    # While enough periods are left for the noise estimate; any multiple of a period is a period.
    times = len(command) // period // (MOST_PERIODS + 1)
    multiple = period * max(1, times - 1 + times % 2)
    return multiple if multiple >= LEAST_BY_ITSELF else 0


def find_period(command: FloatArray) -> int:
    """The shortest period in samples after which the command (n, m) nearly repeats, by autocorrelation; 0 = none."""
    used = command[:MOST_SAMPLES]
    most = float(np.abs(used).max(initial=0.0))
    if HUGE < most < np.inf:
        used = used / most  # whose squares would overflow
    sizes = np.std(used, axis=0) if used.size else np.zeros(command.shape[1])
    if not np.isfinite(used).all() or not (sizes > 0).any() or len(used) < 2 * SHORTEST:
        return 0
    scaled = (used[:, sizes > 0] - used[:, sizes > 0].mean(axis=0)) / sizes[sizes > 0]
    correlation = _correlation(scaled)[: len(used) // 2 + 1]
    dips = np.flatnonzero(correlation < DIPPED)
    if not len(dips):
        return 0
    after = np.flatnonzero(correlation[dips[0] :] > ALIKE) + dips[0]
    if not len(after) or after[0] < SHORTEST:
        return 0
    # First local maximum that is high enough.
    last = after[0] + int(np.argmax(np.diff(np.append(after, after[-1] + 2)) > 1))
    return int(after[0] + np.argmax(correlation[after[0] : last + 1]))


def _correlation(samples: FloatArray) -> FloatArray:
    """(n,): autocorrelation by lag, normalised by the energy of both copies where they overlap."""
    n = len(samples)
    size = 2 ** int(np.ceil(np.log2(2 * n)))
    spectrum = np.fft.rfft(samples, size, axis=0)
    raw = np.fft.irfft(np.sum(np.abs(spectrum) ** 2, axis=1), size)[:n]
    energy = np.concatenate([[0.0], np.cumsum(np.sum(samples**2, axis=1))])
    lags = np.arange(n)
    both = energy[n - lags] * (energy[n] - energy[lags])
    return np.asarray(raw / np.sqrt(np.maximum(both, np.finfo(np.float64).tiny)))


def _is_same(later: FloatArray, before: FloatArray) -> bool:
    """Whether each channel repeats, up to rounding."""
    if not np.isfinite(later).all() or not np.isfinite(before).all():
        return False
    for column, other in zip(later.T, before.T, strict=True):
        off = np.abs(column - other)
        if off.max() <= EXACT * np.abs(column).max():
            continue
        step = rounding_step(column)
        if off.max() > 1.5 * step or np.sqrt(np.mean(off**2)) > ROUNDED * np.std(column):
            return False
    return True


def _segment_kind(command: FloatArray, period: int) -> str:
    if not period:
        return "noise"
    power = np.sum(np.abs(np.fft.rfft(command[:period] - command[:period].mean(axis=0), axis=0)) ** 2, axis=1)
    return "sine" if power.max() > ALIKE * power.sum() else "multisine"


def _peak(command: Signal, start: int, stop: int) -> float:
    samples = command.samples[start:stop]
    known = samples[np.isfinite(samples)]
    return float(np.abs(known).max()) if known.size else 0.0


def _segments_sentence(segments: Sequence[Segment]) -> str:
    periodic = [segment for segment in segments if segment.period]
    periods = conjoin([str(period) for period in sorted({segment.period for segment in periodic})])
    levels = conjoin([f"{level:.4g}" for level in sorted({segment.amplitude for segment in periodic})])
    where = (
        "The command" if len(periodic) == len(segments) else f"In {len(periodic)} of {len(segments)} parts the command"
    )
    least = min((segment.stop - segment.start) // segment.period for segment in periodic)
    return (
        f"{where} repeats exactly, every {periods} samples, {least} times or more in each part: segments with that "
        f"period were made, with peaks of {levels} (SI units)."
    )
