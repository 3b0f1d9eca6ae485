"""A recording ready for comparison with a model: its signals, and its samples split into three sets (`split_samples`).

The sets are those of statistical learning: training (`fit`: parameters are fitted to it), validation (`choose`: among
explanations the best is chosen by it) and test (`test`: held out until the end, for an unbiased error).
`observed_parts` makes these records.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.limits import (
    CHOOSE_SHARE,
    LEVELS_TO_HOLD_ONE_BACK,
    LEVELS_TO_STRATIFY,
    LONGEST_TAIL_SHARE,
    MODEL_FLOOR,
    REST_RANGE_SHARE,
    TEST_SHARE,
)
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, find_runs


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """One recording with its signals in SI units and the three sets of samples. A sample may belong to none, such as
    one with a missing reading."""

    recording: Recording
    """As recorded, for its sample rate, hold, conditions and names."""
    command: FloatArray
    """(n, m): command of each input, in SI units."""
    measured: FloatArray
    """(n, c): channels of the response, then of the position, as measured; NaN = missing."""
    fit: Mask
    """(n,): samples that parameters are fitted to."""
    choose: Mask
    """(n,): validation samples, by which explanations are chosen."""
    test: Mask
    """(n,): held-out samples, used only in the end."""

    def release_test_samples(self, mask: Mask) -> "Observed":
        """Release the held-out samples within `mask` (n,) for fitting, in a copy: of each stretch, two thirds become
        fit samples, the last third validation samples."""
        mask = mask & self.test
        fit, choose = self.fit.copy(), self.choose.copy()
        for start, stop in find_runs(mask):
            choose_start = start + 2 * (stop - start) // 3
            fit[start:choose_start] = True
            choose[choose_start:stop] = True
        return replace(self, fit=fit, choose=choose, test=self.test & ~mask)

    def compute_longest_test_stretch(self) -> int:
        """Count the samples of the longest held-out stretch; 0 where nothing is held out."""
        return max((stop - start for start, stop in find_runs(self.test)), default=0)

    def mask_alternate_parts(self, part_count: int) -> Mask:
        """Make the mask (n,) of the first, third, fifth … part of each held-out stretch, which is divided into
        `part_count` equal parts."""
        mask = np.zeros(len(self.test), dtype=np.bool_)
        for start, stop in find_runs(self.test):
            mask[start:stop] = (np.arange(stop - start) * part_count // (stop - start)) % 2 == 0
        return mask

    def list_test_levels(self) -> list[tuple[Segment, float]]:
        """List each segment with held-out samples, and the largest magnitude of its commands."""
        segment_samples = [(segment, slice(segment.start, segment.stop)) for segment in self.recording.segments]
        return [
            (segment, float(np.abs(self.command[samples]).max(initial=0.0)))
            for segment, samples in segment_samples
            if self.test[samples].any()
        ]

    def mask_test_below(self, level: float) -> Mask:
        """Make the mask (n,) of the held-out samples in segments whose commands are all below `level` (the command's
        unit) in magnitude."""
        mask = np.zeros(len(self.test), dtype=np.bool_)
        for segment, largest_command in self.list_test_levels():
            mask[segment.start : segment.stop] = largest_command < level
        return mask & self.test

    def join_fit_and_choose(self) -> "Observed":
        """Join fit and validation samples, and use them for both."""
        return replace(self, fit=self.fit | self.choose, choose=self.fit | self.choose)

    def shorten(self) -> "Observed":
        """Cut the record after its last fit or validation sample, without a test set; `recording` itself is not cut."""
        used_length = (
            int(np.flatnonzero(self.fit | self.choose)[-1]) + 1 if (self.fit | self.choose).any() else len(self.fit)
        )
        empty_mask = np.zeros(used_length, dtype=np.bool_)
        return Observed(
            self.recording,
            self.command[:used_length],
            self.measured[:used_length],
            self.fit[:used_length],
            self.choose[:used_length],
            empty_mask,
        )


def stack_measured_signals(recording: Recording, response_count: int) -> tuple[FloatArray, Mask]:
    """Stack response and position side by side, (n, c), with the mask (n,) of samples where all are finite. A position
    whose number of channels is not `response_count` is left out."""
    signals = [recording.response.samples]
    if recording.position is not None and recording.position.samples.shape[1] == response_count:
        signals.append(recording.position.samples)
    measured = np.hstack(signals)
    is_complete: Mask = np.asarray(np.isfinite(measured).all(axis=1), dtype=np.bool_)
    return measured, is_complete


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a recording as sample indices: first sample, end of its motion, end of the part (both ends
    exclusive)."""

    start: int
    end_of_motion: int
    stop: int


def find_moving_spans(response: FloatArray, parts: Sequence[tuple[int, int]]) -> tuple[Span, ...]:
    """Find the end of each part's motion: the last sample at which any channel differs from its rest value at the
    part's end by more than `REST_RANGE_SHARE` of its range. response: (n, p); parts: start and end (exclusive)."""
    return tuple(Span(start, start + _find_end_of_motion(response[start:stop]), stop) for start, stop in parts)


def _find_end_of_motion(samples: FloatArray) -> int:
    """Count the samples until the end of motion, at least half of them; all where the part does not move, or does not
    come to rest before its last `LONGEST_TAIL_SHARE`. The rest value is the median over that tail."""
    samples = samples[:, np.isfinite(samples).any(axis=0)]
    tail_start = int((1 - LONGEST_TAIL_SHARE) * len(samples))
    is_complete: Mask = np.asarray(np.isfinite(samples).all(axis=1), dtype=np.bool_)
    if not is_complete[:tail_start].any() or not is_complete[tail_start:].any():
        return len(samples)
    is_displaced = np.abs(
        samples - np.median(samples[tail_start:][is_complete[tail_start:]], axis=0)
    ) > REST_RANGE_SHARE * np.ptp(samples[is_complete], axis=0)
    moving_samples = np.flatnonzero(is_displaced.any(axis=1))
    if not len(moving_samples) or moving_samples[-1] >= tail_start:
        return len(samples)
    # A step response that settles at once would leave almost no samples to fit.
    return max(int(moving_samples[-1]) + 1, len(samples) // 2)


def split_samples(
    segments: tuple[Segment, ...], length: int, has_external_test: bool = False, spans: Sequence[Span] = ()
) -> tuple[Mask, Mask, Mask]:
    """Split samples into fit, validation and test: three masks (length,). has_external_test: whether another recording
    is held out for the test. spans: the recording's parts, used without segments; empty = one part.

    Segments marked as test are held out; of the others, those marked as fit are fitted, or all without such marks.
    Segments of rest and samples outside segments belong to no set, unless no segment remains to fit; nothing is fitted
    where all driven segments are marked as test. Without test marks and external test, the last share `TEST_SHARE` of
    each segment is held out, in whole periods, so that every level is tested; with fewer than `LEVELS_TO_STRATIFY`
    levels, that share of the time. Of the fitted segments, those of the middle level are the validation set where there
    are at least `LEVELS_TO_HOLD_ONE_BACK` levels: laws differ in how they grow with the level, whereas further periods
    of a fitted level differ by noise only. Otherwise it is the last share `CHOOSE_SHARE` of the remaining time.

    Without segments, the last share `TEST_SHARE` of each part's motion is held out; the rest period after it, which may
    show a force but no motion, is fitted."""
    if not segments:
        return _split_without_segments(spans or (Span(0, length, length),), length, has_external_test)
    driven_segments = [segment for segment in segments if segment.kind != "rest"]
    test = _mask_segments([segment for segment in driven_segments if segment.role == "test"], length)
    fitted_segments = [segment for segment in driven_segments if segment.role == "fit"] or [
        segment for segment in driven_segments if segment.role != "test"
    ]
    fit = _mask_segments(fitted_segments, length) if fitted_segments else ~test
    if driven_segments and all(segment.role == "test" for segment in driven_segments):
        fit[:] = False
    elif not test.any() and not has_external_test:
        test = _mask_segment_ends(fitted_segments, length)
        fit &= ~test
    choose = _mask_middle_level(fitted_segments, length) & fit
    if not choose.any():
        indices = np.flatnonzero(fit)
        choose[indices[int((1 - CHOOSE_SHARE) * len(indices)) :]] = True
    return fit & ~choose, choose, test


def _split_without_segments(spans: Sequence[Span], length: int, has_external_test: bool) -> tuple[Mask, Mask, Mask]:
    """Split samples by shares of each part's motion: masks (length,) of the fit, validation and test samples.
    has_external_test: whether nothing is held out here."""
    fit, choose, test = (np.zeros(length, dtype=np.bool_) for _ in range(3))
    for span in spans:
        test_start = (
            span.stop if has_external_test else span.start + int((1 - TEST_SHARE) * (span.end_of_motion - span.start))
        )
        choose_start = span.start + int((1 - CHOOSE_SHARE) * (test_start - span.start))
        fit[span.start : span.stop], choose[choose_start:test_start] = True, True
        test[test_start : span.end_of_motion] = True
    return fit & ~choose & ~test, choose, test


def compute_error_units(measured: FloatArray, noise: FloatArray) -> FloatArray:
    """Compute (c,): unit by which each channel's errors are divided, sqrt(noise^2 + (MODEL_FLOOR rms)^2), with the rms
    of the noise, and the share of the signal's rms that no model predicts. measured: (n, c), NaN = missing; noise:
    (c,), rms."""
    rms = np.sqrt(np.nanmean(measured**2, axis=0))
    return np.asarray(np.sqrt(noise**2 + (MODEL_FLOOR * rms) ** 2))


def _mask_segments(segments: list[Segment], length: int) -> Mask:
    """Make the mask (length,) of the samples in these segments."""
    mask = np.zeros(length, dtype=np.bool_)
    for segment in segments:
        mask[segment.start : segment.stop] = True
    return mask


def _mask_segment_ends(segments: list[Segment], length: int) -> Mask:
    """Make the mask (length,) of the last share `TEST_SHARE` of each segment, in whole periods and at least one of them
    where it has two or more; of that share of the time where there are fewer than `LEVELS_TO_STRATIFY` levels."""
    mask = np.zeros(length, dtype=np.bool_)
    if len(_list_levels(segments)) < LEVELS_TO_STRATIFY:
        indices = np.flatnonzero(_mask_segments(segments, length)) if segments else np.arange(length)
        mask[indices[int((1 - TEST_SHARE) * len(indices)) :]] = True
        return mask
    for segment in segments:
        segment_length = segment.stop - segment.start
        fitted_length = int((1 - TEST_SHARE) * segment_length)
        if segment.period and segment_length >= 2 * segment.period:
            fitted_length = (
                min(-(-fitted_length // segment.period), segment_length // segment.period - 1) * segment.period
            )
        mask[segment.start + fitted_length : segment.stop] = True
    return mask


def _list_levels(segments: list[Segment]) -> list[float]:
    """List the different amplitudes of the segments above 0, ascending."""
    return sorted({segment.amplitude for segment in segments if segment.amplitude > 0})


def _mask_middle_level(segments: list[Segment], length: int) -> Mask:
    """Make the mask (length,) of the segments of the middle level; all False with fewer than `LEVELS_TO_HOLD_ONE_BACK`
    levels."""
    levels = _list_levels(segments)
    if len(levels) < LEVELS_TO_HOLD_ONE_BACK:
        return np.zeros(length, dtype=np.bool_)
    middle_level = levels[len(levels) // 2]
    return _mask_segments([segment for segment in segments if segment.amplitude == middle_level], length)
