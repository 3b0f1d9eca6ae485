"""Selects the segments of a record in which one axis is driven.

The first fit of an effect with impacts uses only these segments: they contain the information about that axis, and cost
less simulation time than the whole record (`search.impacts`).
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import part_of
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from equalizer.signals.recording import Segment

EXCITED_SHARE = 0.5
"""Least rms command of the axis, relative to that of the strongest axis in a segment."""
LONGEST_S = 6.0
"""Longest part of a segment that is used (s)."""


def select_excited_segments(measure: FreeSimulation, axis: int) -> FreeSimulation:
    """The measure on the segments that excite an axis, each simulated from rest; unchanged where there are none."""
    parts = tuple(
        _cut_record(record, segment)
        for record in measure.records
        for segment in record.recording.segments
        if segment.kind != "rest" and segment.stop <= len(record.command) and _is_excited(record, segment, axis)
    )
    kept = tuple(part for part in parts if (part.fit | part.choose).any())
    return replace(measure, records=kept) if kept else measure


def _is_excited(record: Observed, segment: Segment, axis: int) -> bool:
    """Whether the axis is driven in the segment with at least `EXCITED_SHARE` of the strongest axis's command."""
    power = np.sum(record.command[segment.start : segment.stop] ** 2, axis=0)
    return bool(power[axis] >= EXCITED_SHARE**2 * power.max() > 0)


def _cut_record(record: Observed, segment: Segment) -> Observed:
    """The record of a segment alone, at most `LONGEST_S` of it, rounded to whole periods where it has a period."""
    longest = int(LONGEST_S * record.recording.sample_rate_hz)
    if segment.period:
        longest = max(longest // segment.period, 1) * segment.period
    first, last = segment.start, min(segment.stop, segment.start + longest)
    kept = slice(first, last)
    return Observed(
        part_of(record.recording, first, last), record.command[kept], record.measured[kept],
        record.fit[kept], record.choose[kept], record.test[kept],
    )  # fmt: skip
