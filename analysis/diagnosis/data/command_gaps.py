"""Fills short gaps in a recorded command by interpolation, and cuts the recording at long ones."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.observed_parts import LEAST_SAMPLES, parts_of
from analysis.diagnosis.settings import BRIDGED, LEAST_KEPT
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

Stretch = tuple[int, int]


def bridge_gaps(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """The recordings with gaps in their commands filled or cut out, and a sentence for each that was changed. A
    recording of which too much would be lost is not changed."""
    found = [_bridge_or_cut(recording, name) for recording, name in zip(recordings, names, strict=True)]
    return tuple(each for each, _ in found), tuple(remark for _, remark in found if remark)


def _bridge_or_cut(recording: Recording, name: str) -> tuple[Recording, str]:
    missing: Mask = np.asarray(np.isnan(recording.command.samples).any(axis=1))
    if not missing.any() or missing.all():
        return recording, ""
    edges = np.flatnonzero(np.diff(missing, prepend=False, append=False)).reshape(-1, 2)
    gaps = [(int(start), int(stop)) for start, stop in edges]
    whole = _interpolate(recording.command.samples)
    wide = [gap for gap in gaps if not _can_bridge(recording.command.samples, gap[1] - gap[0])]
    narrow = [gap for gap in gaps if gap not in wide]
    parts = [part for stretch in parts_of(recording) for part in _stretches_between(stretch, wide)]
    if sum(stop - start for start, stop in parts) < LEAST_KEPT * int((~missing).sum()):
        return recording, ""
    filled = replace(recording, command=replace(recording.command, samples=whole))
    if wide:
        stretches = [{"start": start, "stop": stop} for start, stop in parts]
        filled = replace(filled, meta={**recording.meta, "parts": stretches})
    texts = [
        f"{len(chosen)} gap{'s' if len(chosen) != 1 else ''} ({sum(b - a for a, b in chosen)} samples) {what}"
        for chosen, what in (
            (narrow, "bridged by straight lines, as they hardly differ from the command over so short a time"),
            (wide, f"cut out, so that {len(parts)} parts are compared by themselves"),
        )
        if chosen
    ]
    return filled, f"{name} misses the command in places: {', '.join(texts)}."


def _can_bridge(samples: FloatArray, gap: int) -> bool:
    """Whether straight lines over so many samples fit the command where it is known: then it changes little in a gap of
    that length."""
    before, after = (gap + 1) // 2, (gap + 2) // 2
    middle = samples[before : len(samples) - after]
    if not len(middle):
        return False
    share = after / (before + after)
    line = share * samples[: len(middle)] + (1 - share) * samples[before + after :]
    errors, spread = middle - line, np.nanstd(samples, axis=0)
    known = np.isfinite(errors).all(axis=1)
    left = np.sqrt(np.mean(errors[known] ** 2, axis=0)) if known.any() else np.full_like(spread, np.inf)
    return bool(np.all(left <= BRIDGED * spread))


def _stretches_between(stretch: Stretch, gaps: Sequence[Stretch]) -> list[Stretch]:
    """The stretches between gaps that are long enough to be compared."""
    begin, left = stretch[0], []
    for start, stop in (*gaps, (stretch[1], stretch[1])):
        left.append((begin, min(max(start, begin), stretch[1])))
        begin = max(stop, begin)
    return [(start, stop) for start, stop in left if stop - start >= LEAST_SAMPLES]


def _interpolate(samples: FloatArray) -> FloatArray:
    whole, places = np.array(samples), np.arange(len(samples))
    for column in whole.T:
        known = np.isfinite(column)
        if known.any():
            column[:] = np.interp(places, places[known], column[known])
    return whole
