"""Segments of a part: the map's segments on its sample grid."""

from collections.abc import Iterator
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np

from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray
from study.importing.map_format.import_map import SegmentMap
from study.importing.map_format.map_errors import ImportProblemError


def segments_of(
    wanted: tuple[SegmentMap, ...], part: tuple[str, str], command: FloatArray, rate_hz: float
) -> Iterator[Segment]:
    """The map's segments that fit this part, on its sample grid. part: name of its file, and its prefix. command: (n,
    m) in the map's unit, which amplitudes also have. Raises ImportProblemError."""
    file, prefix = part
    for number, entry in enumerate(wanted, start=1):
        if fnmatchcase(file, entry.file) and (entry.prefix == "*" or fnmatchcase(prefix, entry.prefix)):
            try:
                yield from _pieces(entry, command, rate_hz)
            except ImportProblemError as error:
                raise ImportProblemError(f"segment[{number}] in {file}: {error}") from error


def _pieces(entry: SegmentMap, command: FloatArray, rate_hz: float) -> Iterator[Segment]:
    start, stop = _bounds(entry, len(command), rate_hz)
    spans = list(_spans(entry, start, stop))
    if not spans:
        raise ImportProblemError(f"no piece of {entry.every} samples fits between {start} and {stop}")
    for (begin, end), role in zip(*_with_roles(entry, spans), strict=True):
        amplitude = entry.amplitude if entry.amplitude >= 0 else _peak(command[begin:end])
        yield Segment(begin, end, entry.kind, amplitude, entry.period, role)


def _bounds(entry: SegmentMap, samples: int, rate_hz: float) -> tuple[int, int]:
    start = round(entry.start_s * rate_hz) if entry.start_s else entry.start
    stop = round(entry.stop_s * rate_hz) if entry.stop_s else entry.stop
    start, stop = (start + samples if start < 0 else start), (stop + samples if stop <= 0 else stop)
    if not 0 <= start < stop <= samples:
        raise ImportProblemError(f"it goes from sample {start} to {stop}, but the part has {samples} samples")
    return start, stop


def _spans(entry: SegmentMap, start: int, stop: int) -> Iterator[tuple[int, int]]:
    if not entry.every:
        yield start, stop
        return
    length = entry.length or entry.every
    if length > entry.every:
        raise ImportProblemError(f"its length, {length}, is more than one every {entry.every} samples leaves room for")
    for begin in range(start, stop - length + 1, entry.every):
        yield begin, begin + length


def _with_roles(entry: SegmentMap, spans: list[tuple[int, int]]) -> tuple[list[tuple[int, int]], list[str]]:
    """Assign roles: one span is cut into its shares; of several, each gets the share in which its middle lies."""
    if not entry.split:
        return spans, [entry.role] * len(spans)
    ends = np.cumsum(list(entry.split.values()))
    roles = list(entry.split)
    if len(spans) > 1:
        middles = (np.arange(len(spans)) + 0.5) / len(spans)
        return spans, [roles[min(int(np.searchsorted(ends, middle)), len(roles) - 1)] for middle in middles]
    ((start, stop),) = spans
    cuts = [start, *(start + round(float(end) * (stop - start)) for end in ends[:-1]), stop]
    pieces = list(pairwise(cuts))
    if any(begin >= end for begin, end in pieces):
        raise ImportProblemError(f"{stop - start} samples cannot be split into shares as small as these")
    return pieces, roles


def _peak(command: FloatArray) -> float:
    finite = command[np.isfinite(command)]
    return float(np.max(np.abs(finite))) if finite.size else 0.0
