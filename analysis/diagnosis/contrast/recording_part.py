"""Split recordings at long gaps into parts: arrays without missing values, in which a fault can be undone (`fault`)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.measured_motion import fill_gaps
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import cut_part
from analysis.diagnosis.limits import PART_LEAST_SAMPLES, PART_MOST_SAMPLES
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording, find_parts
from equalizer.signals.signal import FloatArray, Signal


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One part of a recording without long gaps; missing samples are interpolated."""

    recording: Recording
    """The part as recorded, for its sample rate, hold and channel names."""
    command: FloatArray
    """(n, m): commands, in SI units."""
    response: FloatArray
    """(n, p): responses, in SI units."""
    position: FloatArray | None
    """(n, d): measured positions, in SI units; None where none were measured."""
    known: Mask
    """(n,): samples at which all channels of response and position were recorded, not interpolated; interpolated
    commands do not count."""
    start: int
    """Index of the part's first sample in its file, because a drift and a clock error continue between the parts."""
    file_length: int
    """Number of samples of the file."""

    @property
    def elapsed_share(self) -> FloatArray:
        """(n,): elapsed share of the file's duration, 0 at its first sample, 1 at its last."""
        return np.linspace(self.start, self.start + len(self.known) - 1, len(self.known)) / max(self.file_length - 1, 1)

    @property
    def rate_hz(self) -> float:
        """Sample rate in Hz."""
        return self.recording.sample_rate_hz

    def to_observed(self) -> Observed:
        """Convert to the record that the force balance reads: known samples are fitted, none are held out."""
        recording = replace(
            self.recording,
            command=replace(self.recording.command, samples=self.command),
            response=replace(self.recording.response, samples=self.response),
            position=_replace_samples(self.recording.position, self.position),
        )
        empty_mask = np.zeros(len(self.known), dtype=np.bool_)
        return Observed(recording, self.command, self.response, self.known, empty_mask, empty_mask)


def split_into_parts(recordings: Sequence[Recording]) -> tuple[Part, ...]:
    """Split recordings into parts, each from its first to its last known sample. Only the last `PART_MOST_SAMPLES`
    samples of a recording are used; parts shorter than `PART_LEAST_SAMPLES` are left out."""
    parts: list[Part] = []
    for recording in recordings:
        for start, stop in find_parts(recording):
            first_sample = max(start, len(recording) - PART_MOST_SAMPLES)
            if first_sample >= stop:
                continue
            known_indices = np.flatnonzero(_mask_finite_samples(cut_part(recording, first_sample, stop)))
            if len(known_indices) and known_indices[-1] - known_indices[0] + 1 >= PART_LEAST_SAMPLES:
                parts.append(
                    _cut_filled_part(
                        recording, first_sample + int(known_indices[0]), first_sample + int(known_indices[-1]) + 1
                    )
                )
    return tuple(parts)


def _mask_finite_samples(part: Recording) -> Mask:
    """Mask (n,) of the samples at which all channels of response and position are finite."""
    signals = [part.response.samples, *([] if part.position is None else [part.position.samples])]
    return np.asarray(np.isfinite(np.hstack(signals)).all(axis=1), dtype=np.bool_)


def _cut_filled_part(recording: Recording, start: int, stop: int) -> Part:
    """Cut the samples from `start` to before `stop`, with missing ones interpolated (`fill_gaps`)."""
    part = cut_part(recording, start, stop)
    position = None if part.position is None else fill_gaps(part.position.samples)
    return Part(
        part,
        fill_gaps(part.command.samples),
        fill_gaps(part.response.samples),
        position,
        _mask_finite_samples(part),
        start,
        len(recording),
    )


def _replace_samples(signal: Signal | None, samples: FloatArray | None) -> Signal | None:
    """Replace the samples of a signal; None where either is None."""
    return None if signal is None or samples is None else replace(signal, samples=samples)
