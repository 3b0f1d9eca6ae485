"""Convert the segments of an import map, in seconds or samples, to the segments of a recording, in samples.

A part of a recording is a file, or its arrays with one prefix.
"""

from collections.abc import Iterator
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np

from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray
from study.importing.map_format.import_map import SegmentMap
from study.importing.map_format.map_errors import ImportProblemError


def place_segments(
    segment_maps: tuple[SegmentMap, ...], part: tuple[str, str], command: FloatArray, rate_hz: float
) -> Iterator[Segment]:
    """Convert the map's segments to those of one part, in the order of the map. part: name of its file, and its prefix.
    command: (samples, channels), in the unit of the map, which amplitudes also have. Raises ImportProblemError with the
    number of the segment in the map, from 1."""
    for number, segment_map in enumerate(segment_maps, start=1):
        if is_segment_of(segment_map, part):
            try:
                yield from _place_segment(segment_map, command, rate_hz)
            except ImportProblemError as error:
                raise ImportProblemError(f"segment[{number}] in {part[0]}: {error}") from error


def is_segment_of(segment_map: SegmentMap, part: tuple[str, str]) -> bool:
    """Whether a part, by the name of its file and its prefix, matches the patterns of a segment."""
    file, prefix = part
    return fnmatchcase(file, segment_map.file) and (
        segment_map.prefix == "*" or fnmatchcase(prefix, segment_map.prefix)
    )


def _place_segment(segment_map: SegmentMap, command: FloatArray, rate_hz: float) -> Iterator[Segment]:
    """Convert one entry of the map to segments; a negative amplitude is replaced by the peak of the command in each.
    Raises ImportProblemError for bounds outside the part, and where no piece or share has samples."""
    start, stop = _find_bounds(segment_map, len(command), rate_hz)
    pieces = list(_divide_span(segment_map, start, stop))
    if not pieces:
        raise ImportProblemError(f"no piece of {segment_map.every} samples fits between {start} and {stop}")
    for (piece_start, piece_stop), role in zip(*_assign_roles(segment_map, pieces), strict=True):
        amplitude = segment_map.amplitude if segment_map.amplitude >= 0 else _find_peak(command[piece_start:piece_stop])
        yield Segment(piece_start, piece_stop, segment_map.kind, amplitude, segment_map.period, role)


def _find_bounds(segment_map: SegmentMap, sample_count: int, rate_hz: float) -> tuple[int, int]:
    """Find the first sample, and the sample after the last. Times in seconds take precedence unless 0. Negative bounds
    count from the end of the part; a stop of 0 is its end. Raises ImportProblemError for bounds outside the part."""
    start = round(segment_map.start_s * rate_hz) if segment_map.start_s else segment_map.start
    stop = round(segment_map.stop_s * rate_hz) if segment_map.stop_s else segment_map.stop
    start, stop = (start + sample_count if start < 0 else start), (stop + sample_count if stop <= 0 else stop)
    if not 0 <= start < stop <= sample_count:
        raise ImportProblemError(f"it goes from sample {start} to {stop}, but the part has {sample_count} samples")
    return start, stop


def _divide_span(segment_map: SegmentMap, start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Divide the range from start to stop (exclusive) into pieces (first, stop): with `every`, pieces of `length`
    samples (0: of `every`) that begin every `every` samples, without an incomplete last one; else one piece. Raises
    ImportProblemError for pieces that would overlap."""
    if not segment_map.every:
        yield start, stop
        return
    length = segment_map.length or segment_map.every
    if length > segment_map.every:
        raise ImportProblemError(
            f"its length, {length}, is more than one every {segment_map.every} samples leaves room for"
        )
    for piece_start in range(start, stop - length + 1, segment_map.every):
        yield piece_start, piece_start + length


def _assign_roles(segment_map: SegmentMap, ranges: list[tuple[int, int]]) -> tuple[list[tuple[int, int]], list[str]]:
    """Assign roles to ranges (start, stop). With `split`, a single range is cut in proportion to the shares, and of
    several ranges each gets the role of the share in which its middle lies (all ranges count equally); the last share
    ends at the end of the ranges. Raises ImportProblemError for a share of a single range without samples."""
    if not segment_map.split:
        return ranges, [segment_map.role] * len(ranges)
    end_shares = np.cumsum(list(segment_map.split.values()))
    roles = list(segment_map.split)
    if len(ranges) > 1:
        middles = (np.arange(len(ranges)) + 0.5) / len(ranges)
        return ranges, [roles[min(int(np.searchsorted(end_shares, middle)), len(roles) - 1)] for middle in middles]
    ((start, stop),) = ranges
    cuts = [start, *(start + round(float(end_share) * (stop - start)) for end_share in end_shares[:-1]), stop]
    pieces = list(pairwise(cuts))
    if any(piece_start >= piece_stop for piece_start, piece_stop in pieces):
        raise ImportProblemError(f"{stop - start} samples cannot be split into shares as small as these")
    return pieces, roles


def _find_peak(command: FloatArray) -> float:
    """Find the largest magnitude of the finite samples; 0 without any."""
    finite_samples = command[np.isfinite(command)]
    return float(np.max(np.abs(finite_samples))) if finite_samples.size else 0.0
