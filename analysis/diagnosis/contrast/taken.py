"""What was measured, part by part, as arrays that a fault can be undone in."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.measured_motion import filled_gaps
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import part_of, parts_of
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal

LEAST_SAMPLES = 64
"""Of a part."""
MOST_SAMPLES = 40_000
"""Of a recording, its last: enough to tell a fault that is worth it, and no more time than that needs."""


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """One part without gaps; what was missing inside is interpolated, and not `known`."""

    recording: Recording
    """Of the part: rate, hold, names."""
    command: FloatArray
    """(n, m)"""
    response: FloatArray
    """(n, p)"""
    position: FloatArray | None
    """(n, d)"""
    known: Mask
    """(n,)"""

    @property
    def rate_hz(self) -> float:
        return self.recording.sample_rate_hz

    def observed(self) -> Observed:
        """As the force balance reads it, all of it to be fitted to."""
        recording = replace(
            self.recording,
            command=replace(self.recording.command, samples=self.command),
            response=replace(self.recording.response, samples=self.response),
            position=_with(self.recording.position, self.position),
        )
        none = np.zeros(len(self.known), dtype=np.bool_)
        return Observed(recording, self.command, self.response, self.known, none, none)


def taken_of(recordings: Sequence[Recording]) -> tuple[Taken, ...]:
    """Each part from its first known response to its last."""
    found: list[Taken] = []
    for recording in recordings:
        for start, stop in parts_of(recording):
            part = _trimmed(part_of(recording, max(start, len(recording) - MOST_SAMPLES), stop))
            if part is not None and len(part) >= LEAST_SAMPLES:
                found.append(_taken(part))
    return tuple(found)


def _trimmed(part: Recording) -> Recording | None:
    known = np.flatnonzero(_known(part))
    return part_of(part, int(known[0]), int(known[-1]) + 1) if len(known) else None


def _known(part: Recording) -> Mask:
    signals = [part.response.samples, *([] if part.position is None else [part.position.samples])]
    return np.asarray(np.isfinite(np.hstack(signals)).all(axis=1), dtype=np.bool_)


def _taken(part: Recording) -> Taken:
    position = None if part.position is None else filled_gaps(part.position.samples)
    return Taken(part, filled_gaps(part.command.samples), filled_gaps(part.response.samples), position, _known(part))


def _with(signal: Signal | None, samples: FloatArray | None) -> Signal | None:
    return None if signal is None or samples is None else replace(signal, samples=samples)
