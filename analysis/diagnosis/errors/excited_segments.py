"""Select the segments of a recording in which a given axis is driven.

The first fit of play (backlash) with impacts (`search.impacts`) uses these segments: they contain the information about
that axis, and simulating them takes less time than simulating the whole recording.
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import cut_part
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from equalizer.signals.recording import Segment

EXCITED_SHARE = 0.5
"""Least rms command of the axis, relative to that of the axis with the largest rms in the segment. Chosen by hand."""
LONGEST_S = 6.0
"""Longest part of a segment that is used (s); of a periodic segment at least one period. Chosen by hand."""


def select_excited_segments(measure: FreeSimulation, axis: int) -> FreeSimulation:
    """Select the segments that excite an axis, each as a record that is simulated from rest, and return the error
    measure on them. Segments of rest, or without samples for fitting (`fit`) or for choosing among effects (`choose`),
    are left out; where none remains, the measure is returned unchanged. axis: index of the command."""
    segment_records = tuple(
        _cut_record(record, segment)
        for record in measure.records
        for segment in record.recording.segments
        if segment.kind != "rest" and segment.stop <= len(record.command) and _is_excited(record, segment, axis)
    )
    usable_records = tuple(
        segment_record for segment_record in segment_records if (segment_record.fit | segment_record.choose).any()
    )
    return replace(measure, records=usable_records) if usable_records else measure


def _is_excited(record: Observed, segment: Segment, axis: int) -> bool:
    """Whether the axis is driven in the segment with at least `EXCITED_SHARE` of the strongest axis's command."""
    power = np.sum(record.command[segment.start : segment.stop] ** 2, axis=0)
    return bool(power[axis] >= EXCITED_SHARE**2 * power.max() > 0)


def _cut_record(record: Observed, segment: Segment) -> Observed:
    """Cut the first `LONGEST_S` of a segment out of a record; of a periodic segment, of as many whole periods as fit in
    this time, but at least one."""
    max_samples = int(LONGEST_S * record.recording.sample_rate_hz)
    if segment.period:
        max_samples = max(max_samples // segment.period, 1) * segment.period
    start, stop = segment.start, min(segment.stop, segment.start + max_samples)
    samples = slice(start, stop)
    return Observed(
        cut_part(record.recording, start, stop), record.command[samples], record.measured[samples],
        record.fit[samples], record.choose[samples], record.test[samples],
    )  # fmt: skip
