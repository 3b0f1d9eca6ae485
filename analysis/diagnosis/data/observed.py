"""A recording ready for comparison: its signals, and which samples serve to fit, to choose and to test by."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.settings import (
    AT_REST,
    CHOOSE_SHARE,
    LEVELS_TO_HOLD_ONE_BACK,
    LEVELS_TO_STRATIFY,
    LONGEST_TAIL,
    MODEL_FLOOR,
    TEST_SHARE,
)
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, runs_of


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """One recording. Channels are the response's, then the position's."""

    recording: Recording
    command: FloatArray
    """(n, m)"""
    measured: FloatArray
    """(n, c)"""
    fit: Mask
    """(n,): samples that parameters are fitted to."""
    choose: Mask
    """(n,): validation samples, by which explanations are chosen."""
    test: Mask
    """(n,): held-out samples, used only in the end."""

    def unseal(self, opened: Mask) -> "Observed":
        """Copy in which the held-out samples of `opened` are used too: two thirds of each stretch to fit, the last
        third to choose by."""
        opened = opened & self.test
        fit, choose = self.fit.copy(), self.choose.copy()
        for start, stop in runs_of(opened):
            chosen = start + 2 * (stop - start) // 3
            fit[start:chosen] = True
            choose[chosen:stop] = True
        return replace(self, fit=fit, choose=choose, test=self.test & ~opened)

    def longest_held_out(self) -> int:
        """Samples of the longest held-out stretch; 0 where nothing is held out."""
        return max((stop - start for start, stop in runs_of(self.test)), default=0)

    def every_other_part(self, parts: int) -> Mask:
        """(n,): the first, third … of so many equal parts of each held-out stretch."""
        found = np.zeros(len(self.test), dtype=np.bool_)
        for start, stop in runs_of(self.test):
            found[start:stop] = (np.arange(stop - start) * parts // (stop - start)) % 2 == 0
        return found

    def held_out_levels(self) -> list[tuple[Segment, float]]:
        """Each segment of which something is held out, with its largest command."""
        parts = [(segment, slice(segment.start, segment.stop)) for segment in self.recording.segments]
        return [
            (segment, float(np.abs(self.command[part]).max(initial=0.0)))
            for segment, part in parts
            if self.test[part].any()
        ]

    def held_out_below(self, level: float) -> Mask:
        """(n,): held-out samples of segments whose commands stay below a level."""
        found = np.zeros(len(self.test), dtype=np.bool_)
        for segment, largest in self.held_out_levels():
            found[segment.start : segment.stop] = largest < level
        return found & self.test

    def fit_to_all(self) -> "Observed":
        """The record with the validation samples added to the fit samples, for explanations chosen by other means."""
        return replace(self, fit=self.fit | self.choose, choose=self.fit | self.choose)

    def shorten(self) -> "Observed":
        """The record without the samples after the last one to fit or to choose by; its recording is not cut."""
        end = int(np.flatnonzero(self.fit | self.choose)[-1]) + 1 if (self.fit | self.choose).any() else len(self.fit)
        no_test = np.zeros(end, dtype=np.bool_)
        return Observed(
            self.recording, self.command[:end], self.measured[:end], self.fit[:end], self.choose[:end], no_test
        )


def observe(recording: Recording, responses: int) -> Observed:
    """A recording with its samples' roles. responses: number of the model's outputs; a position with another number of
    channels is left out."""
    measured, known = stack_measured_signals(recording, responses)
    fit, choose, test = (mask & known for mask in roles(recording.segments, len(recording)))
    return Observed(recording, recording.command.samples, measured, fit, choose, test)


def stack_measured_signals(recording: Recording, responses: int) -> tuple[FloatArray, Mask]:
    """Response and, where it has as many channels, position (n, c), and the mask of samples where all are known."""
    signals = [recording.response.samples]
    if recording.position is not None and recording.position.samples.shape[1] == responses:
        signals.append(recording.position.samples)
    measured = np.hstack(signals)
    known: Mask = np.asarray(np.isfinite(measured).all(axis=1), dtype=np.bool_)
    return measured, known


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a recording: its first sample, the end of its motion, and its end (both exclusive)."""

    start: int
    end_of_motion: int
    stop: int


def find_moving_spans(response: FloatArray, parts: Sequence[tuple[int, int]]) -> tuple[Span, ...]:
    """Parts with the end of their motion: the last sample at which any channel differs from its rest at the part's end
    by more than `AT_REST` of its range. response: (n, p)."""
    return tuple(Span(start, start + _end_of_motion(response[start:stop]), stop) for start, stop in parts)


def _end_of_motion(samples: FloatArray) -> int:
    samples = samples[:, np.isfinite(samples).any(axis=0)]
    last = int((1 - LONGEST_TAIL) * len(samples))
    known: Mask = np.asarray(np.isfinite(samples).all(axis=1), dtype=np.bool_)
    if not known[:last].any() or not known[last:].any():
        return len(samples)
    away = np.abs(samples - np.median(samples[last:][known[last:]], axis=0)) > AT_REST * np.ptp(samples[known], axis=0)
    moves = np.flatnonzero(away.any(axis=1))
    if not len(moves) or moves[-1] >= last:
        return len(samples)
    # A step response that settles at once would leave almost no samples to fit.
    return max(int(moves[-1]) + 1, len(samples) // 2)


def roles(
    segments: tuple[Segment, ...], length: int, tested: bool = False, spans: Sequence[Span] = ()
) -> tuple[Mask, Mask, Mask]:
    """Masks (length,) of the samples to fit, to choose and to test by. tested: another recording is held out for the
    test. spans: the recording's parts; empty = one part.

    Segments marked as test are held out. Without such marks, the end of each segment is held out, in whole periods, so
    that every level is tested; of a single level, the end of the time. Of the rest, the middle one of three or more
    levels is kept to choose by: laws differ in how they grow with the level, whereas further periods of a fitted level
    only show noise. Otherwise the last quarter of the time is kept.

    Without segments, the last quarter of each part's motion is held out; the rest period after it, which may show a
    force but no motion, is fitted.
    """
    if not segments:
        return _roles_without_segments(spans or (Span(0, length, length),), length, tested)
    inside = [s for s in segments if s.kind != "rest"]
    test = _segment_mask([s for s in inside if s.role == "test"], length)
    fitted = [s for s in inside if s.role == "fit"] or [s for s in inside if s.role != "test"]
    fit = _segment_mask(fitted, length) if fitted else ~test
    if inside and all(s.role == "test" for s in inside):
        fit[:] = False
    elif not test.any() and not tested:
        test = _segment_ends(fitted, length)
        fit &= ~test
    choose = _middle_level(fitted, length) & fit
    if not choose.any():
        places = np.flatnonzero(fit)
        choose[places[int((1 - CHOOSE_SHARE) * len(places)) :]] = True
    return fit & ~choose, choose, test


def _roles_without_segments(spans: Sequence[Span], length: int, tested: bool) -> tuple[Mask, Mask, Mask]:
    fit, choose, test = (np.zeros(length, dtype=np.bool_) for _ in range(3))
    for span in spans:
        held_out = span.stop if tested else span.start + int((1 - TEST_SHARE) * (span.end_of_motion - span.start))
        chosen = span.start + int((1 - CHOOSE_SHARE) * (held_out - span.start))
        fit[span.start : span.stop], choose[chosen:held_out] = True, True
        test[held_out : span.end_of_motion] = True
    return fit & ~choose & ~test, choose, test


def error_units(measured: FloatArray, noise: FloatArray) -> FloatArray:
    """(c,): unit of each channel's errors: its noise and, added in quadrature, the share of its rms that no model
    reaches."""
    rms = np.sqrt(np.nanmean(measured**2, axis=0))
    return np.asarray(np.sqrt(noise**2 + (MODEL_FLOOR * rms) ** 2))


def _segment_mask(segments: list[Segment], length: int) -> Mask:
    mask = np.zeros(length, dtype=np.bool_)
    for segment in segments:
        mask[segment.start : segment.stop] = True
    return mask


def _segment_ends(segments: list[Segment], length: int) -> Mask:
    """The last quarter of each segment, or of the time where there is one level or none."""
    mask = np.zeros(length, dtype=np.bool_)
    if len(_levels(segments)) < LEVELS_TO_STRATIFY:
        places = np.flatnonzero(_segment_mask(segments, length)) if segments else np.arange(length)
        mask[places[int((1 - TEST_SHARE) * len(places)) :]] = True
        return mask
    for segment in segments:
        count = segment.stop - segment.start
        kept = int((1 - TEST_SHARE) * count)
        if segment.period and count >= 2 * segment.period:
            kept = min(-(-kept // segment.period), count // segment.period - 1) * segment.period
        mask[segment.start + kept : segment.stop] = True
    return mask


def _levels(segments: list[Segment]) -> list[float]:
    return sorted({segment.amplitude for segment in segments if segment.amplitude > 0})


def _middle_level(segments: list[Segment], length: int) -> Mask:
    levels = _levels(segments)
    if len(levels) < LEVELS_TO_HOLD_ONE_BACK:
        return np.zeros(length, dtype=np.bool_)
    middle = levels[len(levels) // 2]
    return _segment_mask([segment for segment in segments if segment.amplitude == middle], length)
