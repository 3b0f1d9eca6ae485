"""Parts of recordings without long gaps, as arrays in which a fault can be undone by replacing samples (`fault`).

`rank_faults` and `compare_with_reference` split the faulty and the clean recordings into parts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.measured_motion import fill_gaps
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import cut_part, find_parts
from analysis.diagnosis.settings import PART_LEAST_SAMPLES, PART_MOST_SAMPLES
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One part without long gaps; missing samples are interpolated, and not `known`."""

    recording: Recording
    """The part as recorded, for its rate, hold and names."""
    command: FloatArray
    """(n, m): commands, in SI units."""
    response: FloatArray
    """(n, p): responses, in SI units."""
    position: FloatArray | None
    """(n, d): measured positions, in SI units; None where none were measured."""
    known: Mask
    """(n,): samples of response and position that were recorded, not interpolated."""
    start: int
    """Index of the part's first sample in its file, because drifts and clocks also run between the parts."""
    file_length: int
    """Number of samples of the file."""

    @property
    def elapsed_share(self) -> FloatArray:
        """(n,): elapsed share of the file's duration, 0 to 1."""
        return np.linspace(self.start, self.start + len(self.known) - 1, len(self.known)) / max(self.file_length - 1, 1)

    @property
    def rate_hz(self) -> float:
        """Sample rate in Hz."""
        return self.recording.sample_rate_hz

    def to_observed(self) -> Observed:
        """The part in the form that the force balance reads; all known samples are to fit, none are held out."""
        recording = replace(
            self.recording,
            command=replace(self.recording.command, samples=self.command),
            response=replace(self.recording.response, samples=self.response),
            position=_replace_samples(self.recording.position, self.position),
        )
        no_samples = np.zeros(len(self.known), dtype=np.bool_)
        return Observed(recording, self.command, self.response, self.known, no_samples, no_samples)


def split_into_parts(recordings: Sequence[Recording]) -> tuple[Part, ...]:
    """The parts of recordings, each from its first to its last known sample. Only the last `PART_MOST_SAMPLES` samples
    of a recording are used, and parts shorter than `PART_LEAST_SAMPLES` are left out."""
    parts: list[Part] = []
    for recording in recordings:
        for start, stop in find_parts(recording):
            first_used = max(start, len(recording) - PART_MOST_SAMPLES)
            if first_used >= stop:
                continue
            known_indices = np.flatnonzero(_mask_finite_samples(cut_part(recording, first_used, stop)))
            if len(known_indices) and known_indices[-1] - known_indices[0] + 1 >= PART_LEAST_SAMPLES:
                parts.append(
                    _fill_part(recording, first_used + int(known_indices[0]), first_used + int(known_indices[-1]) + 1)
                )
    return tuple(parts)


def _mask_finite_samples(part: Recording) -> Mask:
    """(n,): samples at which all channels of response and position were recorded."""
    signals = [part.response.samples, *([] if part.position is None else [part.position.samples])]
    return np.asarray(np.isfinite(np.hstack(signals)).all(axis=1), dtype=np.bool_)


def _fill_part(recording: Recording, start: int, stop: int) -> Part:
    """The samples from `start` to before `stop`, with missing ones interpolated (`fill_gaps`)."""
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
    """The signal with these samples; None where either is None."""
    return None if signal is None or samples is None else replace(signal, samples=samples)
