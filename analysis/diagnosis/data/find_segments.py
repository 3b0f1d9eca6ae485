"""Find periodic segments in a recording that declares none: stretches whose excitation repeats, up to rounding.

The excitation is tested where it was recorded, else the command (`find_designed_command`); below, both are called
command. A candidate period of a whole part is the first high peak of its autocorrelation. It is accepted only where the
command itself, sample by sample, repeats with it throughout the part; else the part is searched for stretches that do,
such as levels one after another, whose candidate periods are the distances to equal samples
(`_find_repeating_stretches`). Commands that were measured with noise, or repeat approximately, are not used. Without
such a stretch, no segments are declared. Called by `prepare_recordings` and `study.importing.build_recording`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from analysis.diagnosis.data.observed_parts import MOST_PERIODS
from analysis.diagnosis.noise.rounding import find_rounding_step
from analysis.wording import conjoin
from equalizer.signals.recording import Recording, Segment, find_parts
from equalizer.signals.signal import FloatArray, Signal

SHORTEST_PERIOD = 16
"""Shortest period that is searched for, in samples. Chosen by hand."""
FEWEST_PERIODS = 3
"""Least number of periods of a part: the first contains the transient, and noise needs two more."""
SHORTEST_DECLARED_PERIOD = 256
"""Least period in samples for a diagnosis: of a shorter one an odd multiple is declared, so that odd lines stay odd.
Chosen by hand."""
REPEAT_CORRELATION, DIP_CORRELATION = 0.98, 0.7
"""Least correlation of a command with itself one period later, and level below which it must fall in between. Chosen by
hand."""
SINE_SHARE = 0.98
"""Share of the power on a single line above which a periodic command is a sine. Chosen by hand."""
EXACT_TOLERANCE = 1e-6
"""Largest difference of a command between periods, relative to its peak: rounding of numbers stored with six digits."""
ROUNDED_TOLERANCE = 1e-3
"""Largest rms difference between periods due to rounding, relative to the standard deviation of the command. Chosen by
hand."""
MOST_SEARCHED_SAMPLES = 2**19
"""Largest number of samples in which a period is searched for; limits the computing time of the correlation."""
LARGEST_SAMPLE = 1e100
"""Magnitude of a sample above which samples are scaled, so that their squares do not overflow (a damaged file)."""


def find_segments(recording: Recording) -> tuple[Recording, str]:
    """Find the segments. Returns the recording with them, and a sentence about them; the recording unchanged and an
    empty string where it has segments, or no stretch of its excitation repeats. What does not repeat becomes segments,
    too, without a period, but for short stretches between others and such with a constant excitation."""
    if recording.segments:
        return recording, ""
    designed_samples = find_designed_command(recording).samples
    stretches = [
        (start + first, start + last, period)
        for start, stop in find_parts(recording)
        for first, last, period in _divide_part(designed_samples[start:stop])
    ]
    if not any(period for _, _, period in stretches):
        return recording, ""
    segments = tuple(
        Segment(
            start,
            stop,
            _classify_segment(designed_samples[start:stop], period),
            _compute_peak(recording.command, start, stop),
            period,
        )
        for start, stop, period in stretches
    )
    return replace(recording, segments=segments), _describe_segments(segments)


def find_designed_command(recording: Recording) -> Signal:
    """Find the signal that was designed: the excitation where it was recorded and varies, else the command."""
    excitation = recording.excitation
    if excitation is None:
        return recording.command
    finite_samples = excitation.samples[np.isfinite(excitation.samples).all(axis=1)]
    return excitation if len(finite_samples) and np.ptp(finite_samples, axis=0).max() > 0 else recording.command


def find_exact_period(command: FloatArray) -> int:
    """Find the period in samples after which the command (n, m) repeats exactly; 0 where it does not, or not often
    enough. Where the shortest period has less than `SHORTEST_DECLARED_PERIOD` samples, an odd multiple of it, or 0 if
    no multiple that is long enough fits into the part often enough."""
    period = find_period(command)
    if (
        not period
        or len(command) // period < FEWEST_PERIODS
        or not _is_exact_repeat(command[period:], command[:-period])
    ):
        return 0
    return _choose_declared_period(period, len(command))


def _choose_declared_period(period: int, length: int) -> int:
    """Choose the period to declare for `length` samples that repeat after `period`: see `find_exact_period`."""
    if period >= SHORTEST_DECLARED_PERIOD:
        return period
    # The largest odd multiple of which `MOST_PERIODS` and one for the transient fit into the part, else the period.
    largest_multiple = length // period // (MOST_PERIODS + 1)
    declared_period = period * max(1, largest_multiple - 1 + largest_multiple % 2)
    return declared_period if declared_period >= SHORTEST_DECLARED_PERIOD else 0


def _divide_part(command: FloatArray) -> list[tuple[int, int, int]]:
    """Divide a part, command (n, m), into stretches (start, stop, period), period 0 = not periodic: the whole part
    where it repeats throughout or nowhere."""
    n = len(command)
    if period := find_exact_period(command):
        return [(0, n, period)]
    stretches = _find_repeating_stretches(command)
    ends, starts = [0, *(stop for _, stop, _ in stretches)], [*(start for start, _, _ in stretches), n]
    remainders = [
        (start, stop, 0)
        for start, stop in zip(ends, starts, strict=True)
        if stop - start >= SHORTEST_DECLARED_PERIOD and np.ptp(command[start:stop], axis=0).any()
    ]
    covered, rest = (sum(stop - start for start, stop, _ in part) for part in (stretches, remainders))
    return sorted(stretches + remainders) if covered > rest else [(0, n, 0)]  # fewer may repeat by chance


def _find_repeating_stretches(command: FloatArray) -> list[tuple[int, int, int]]:
    """Find stretches (start, stop, declared period) in which the command (n, m) repeats exactly, in order. From each
    start, the distances at which the next `SHORTEST_DECLARED_PERIOD` samples recur are candidate periods."""
    width = SHORTEST_DECLARED_PERIOD
    if len(command) < FEWEST_PERIODS * width or not np.isfinite(command).all():
        return []
    tolerance, recurrences = _compute_tolerance(command), _Recurrences(command)
    stretches: list[tuple[int, int, int]] = []
    start = free_from = 0
    while start + width <= len(command):
        found = None
        if (np.ptp(command[start : start + width], axis=0) > tolerance).any():
            for period in recurrences.find(start, tolerance):
                if found := _extend_stretch(command, (free_from, start), period, tolerance):
                    break
        if found and (declared_period := _choose_declared_period(period, found[1] - found[0])):
            stretches.append((*found, declared_period))
        start, free_from = (found[1], found[1]) if found else (start + width, free_from)
    return stretches


def find_period(command: FloatArray) -> int:
    """Find the shortest period in samples after which the command (n, m) nearly repeats, by autocorrelation; 0 =
    none."""
    searched_samples = command[:MOST_SEARCHED_SAMPLES]
    largest_sample = float(np.abs(searched_samples).max(initial=0.0))
    if LARGEST_SAMPLE < largest_sample < np.inf:
        searched_samples = searched_samples / largest_sample
    channel_std = np.std(searched_samples, axis=0) if searched_samples.size else np.zeros(command.shape[1])
    if (
        not np.isfinite(searched_samples).all()
        or not (channel_std > 0).any()
        or len(searched_samples) < 2 * SHORTEST_PERIOD
    ):
        return 0
    scaled_samples = (
        searched_samples[:, channel_std > 0] - searched_samples[:, channel_std > 0].mean(axis=0)
    ) / channel_std[channel_std > 0]
    correlation = _compute_autocorrelation(scaled_samples)[: len(searched_samples) // 2 + 1]
    dip_lags = np.flatnonzero(correlation < DIP_CORRELATION)
    if not len(dip_lags):
        return 0
    high_lags = np.flatnonzero(correlation[dip_lags[0] :] > REPEAT_CORRELATION) + dip_lags[0]
    if not len(high_lags) or high_lags[0] < SHORTEST_PERIOD:
        return 0
    # The maximum of the first run of consecutive lags that are high enough.
    last_high_lag = high_lags[0] + int(np.argmax(np.diff(np.append(high_lags, high_lags[-1] + 2)) > 1))
    return int(high_lags[0] + np.argmax(correlation[high_lags[0] : last_high_lag + 1]))


def _compute_tolerance(command: FloatArray) -> FloatArray:
    """Compute the largest difference between samples that count as equal, (m,), as `_is_exact_repeat` does."""
    steps = np.array([find_rounding_step(column) for column in command.T])
    is_fine = steps <= ROUNDED_TOLERANCE * np.std(command, axis=0)
    return np.asarray(np.maximum(EXACT_TOLERANCE * np.abs(command).max(axis=0), np.where(is_fine, 1.5 * steps, 0.0)))


def _extend_stretch(
    command: FloatArray, bounds: tuple[int, int], period: int, tolerance: FloatArray
) -> tuple[int, int] | None:
    """Extend a repetition in both directions. bounds: first sample that is free, and a sample from which on the command
    repeats. Returns (start, stop); None where it repeats too seldom."""
    earliest, inside = bounds
    later, earlier = command[earliest + period :], command[earliest : len(command) - period]
    first = inside - earliest
    start = inside - _count_equal(later[:first][::-1], earlier[:first][::-1], tolerance)
    stop = inside + _count_equal(later[first:], earlier[first:], tolerance) + period
    is_repeat = stop - start >= FEWEST_PERIODS * period and _is_exact_repeat(
        command[start + period : stop], command[start : stop - period]
    )
    return (start, stop) if is_repeat else None


def _count_equal(later: FloatArray, earlier: FloatArray, tolerance: FloatArray) -> int:
    """Count the samples (n, m) before the first that differs, in chunks that double: most candidates differ soon."""
    count, chunk = 0, SHORTEST_DECLARED_PERIOD
    while count < len(later):
        differences = np.abs(later[count : count + chunk] - earlier[count : count + chunk])
        if len(differing := np.flatnonzero((differences > tolerance).any(axis=1))):
            return count + int(differing[0])
        count, chunk = count + len(differences), 2 * chunk
    return count


class _Recurrences:
    """Places at which a window of `SHORTEST_DECLARED_PERIOD` samples of a command (n, m) recurs. Equal windows have
    equal weighted sums; windows are compared by these sums, with fixed random weights, in logarithmic time."""

    def __init__(self, command: FloatArray) -> None:
        width = SHORTEST_DECLARED_PERIOD
        weights = np.random.default_rng(0).uniform(1.0, 2.0, (width, command.shape[1]))
        fft_length = next_fast_len(len(command), real=True)
        products = np.conj(rfft(weights, fft_length, axis=0)) * rfft(command, fft_length, axis=0)
        self._sums = irfft(products.sum(axis=1), fft_length)[: len(command) - width + 1]
        self._weight = weights.sum(axis=0)
        self._rounding = 1e-9 * float(np.abs(self._sums).max())  # of the Fourier transform, with a margin
        self._order = np.argsort(self._sums)
        self._sorted_sums = self._sums[self._order]

    def find(self, start: int, tolerance: FloatArray) -> list[int]:
        """Find the distances, rising, after which the samples from `start` on recur for a whole period at least.
        tolerance: (m,), largest difference between equal samples."""
        sums, width = self._sums, SHORTEST_DECLARED_PERIOD
        largest_difference = float(self._weight @ tolerance) + self._rounding
        low, high = np.searchsorted(
            self._sorted_sums, [sums[start] - largest_difference, sums[start] + largest_difference]
        )
        places = self._order[low:high]
        periods = np.sort(places[places >= start + SHORTEST_PERIOD]) - start
        for offset in range(width, len(sums) - start, width):
            is_compared = (periods > offset) & (start + periods + offset < len(sums))
            if not is_compared.any():
                break
            compared_sums = sums[np.where(is_compared, start + periods + offset, 0)]
            recurs = np.abs(sums[start + offset] - compared_sums) <= largest_difference
            periods = periods[~is_compared | recurs]
        return [int(period) for period in periods]


def _compute_autocorrelation(samples: FloatArray) -> FloatArray:
    """Compute (n,): autocorrelation of samples (n, m) by lag, summed over channels and normalised by the energy of both
    copies where they overlap."""
    n = len(samples)
    fft_length = 2 ** int(np.ceil(np.log2(2 * n)))
    spectrum = np.fft.rfft(samples, fft_length, axis=0)
    products = np.fft.irfft(np.sum(np.abs(spectrum) ** 2, axis=1), fft_length)[:n]
    energy = np.concatenate([[0.0], np.cumsum(np.sum(samples**2, axis=1))])
    lags = np.arange(n)
    overlap_energy = energy[n - lags] * (energy[n] - energy[lags])
    return np.asarray(products / np.sqrt(np.maximum(overlap_energy, np.finfo(np.float64).tiny)))


def _is_exact_repeat(later_period: FloatArray, earlier_period: FloatArray) -> bool:
    """Whether each channel repeats, up to rounding: to six digits, or by one step of its own resolution (1.5 as margin)
    with an rms difference of at most `ROUNDED_TOLERANCE`. Arrays (n, m); not where a sample is not finite."""
    if not np.isfinite(later_period).all() or not np.isfinite(earlier_period).all():
        return False
    for later_column, earlier_column in zip(later_period.T, earlier_period.T, strict=True):
        difference = np.abs(later_column - earlier_column)
        if difference.max() <= EXACT_TOLERANCE * np.abs(later_column).max():
            continue
        step = find_rounding_step(later_column)
        if difference.max() > 1.5 * step or np.sqrt(np.mean(difference**2)) > ROUNDED_TOLERANCE * np.std(later_column):
            return False
    return True


def _classify_segment(command: FloatArray, period: int) -> str:
    """Classify a segment: "noise" without a period, "sine" with nearly all power on one line, else "multisine"."""
    if not period:
        return "noise"
    power = np.sum(np.abs(np.fft.rfft(command[:period] - command[:period].mean(axis=0), axis=0)) ** 2, axis=1)
    return "sine" if power.max() > SINE_SHARE * power.sum() else "multisine"


def _compute_peak(command: Signal, start: int, stop: int) -> float:
    """Compute the largest magnitude of the finite samples from start to stop, over all channels; 0 without any."""
    samples = command.samples[start:stop]
    finite_samples = samples[np.isfinite(samples)]
    return float(np.abs(finite_samples).max()) if finite_samples.size else 0.0


def _describe_segments(segments: Sequence[Segment]) -> str:
    """Describe the segments, of which at least one is periodic, in a sentence."""
    periodic_segments = [segment for segment in segments if segment.period]
    periods_text = conjoin([str(period) for period in sorted({segment.period for segment in periodic_segments})])
    levels_text = conjoin([f"{level:.4g}" for level in sorted({segment.amplitude for segment in periodic_segments})])
    subject_text = (
        "The excitation"
        if len(periodic_segments) == len(segments)
        else f"In {len(periodic_segments)} of {len(segments)} parts the excitation"
    )
    fewest_periods = min((segment.stop - segment.start) // segment.period for segment in periodic_segments)
    return (
        f"{subject_text} repeats exactly, every {periods_text} samples, {fewest_periods} times or more in each part: "
        f"segments with that period were made, with command peaks of {levels_text} (SI units)."
    )
