"""Split a real recording into an intact half and one that carries a fault, and measure how visible the fault is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.contrast.bases import bases_of
from analysis.diagnosis.contrast.compared_base import Base
from analysis.diagnosis.contrast.joint_products import weights_of
from analysis.diagnosis.contrast.part import Part, split_into_parts
from analysis.diagnosis.data.observed_parts import part_of, parts_of
from equalizer.signals.joining import concatenate, concatenate_if_all
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal

MOST_SAMPLES = 5_000
"""Longest half, and longest lead before it (samples)."""
SHORTEST = 0.6
"""Shortest half as a fraction of the longest possible."""
PARTS = 4
"""From this number of parts on, halves may also be drawn from parts."""


def drawn_halves(recording: Recording, random: np.random.Generator) -> tuple[Recording, Recording]:
    """Two random stretches of the recording, or random sets of its parts; which one stays intact is also random.
    Both are without roles: the fit samples are drawn anew in each."""
    plain = replace(recording, segments=tuple(replace(segment, role="") for segment in recording.segments))
    parts = parts_of(plain)
    if len(parts) >= PARTS and random.random() < 0.5:
        order = random.permutation(len(parts))
        picked = [sorted(order[: len(parts) // 2]), sorted(order[len(parts) // 2 :])]
        first, second = (_of_parts(plain, [parts[k] for k in each]) for each in picked)
    else:
        half = int(min(len(recording) // 2, MOST_SAMPLES) * random.uniform(SHORTEST, 1.0))
        start = int(random.integers(len(recording) - 2 * half + 1))
        first, second = (
            _half_with_lead(plain, start, start + half),
            _half_with_lead(plain, start + half, start + 2 * half),
        )
    return (first, second) if random.random() < 0.5 else (second, first)


def _of_parts(recording: Recording, parts: Sequence[tuple[int, int]]) -> Recording:
    """Concatenate parts up to the length of a half; the last one may be cut."""
    pieces: list[Recording] = []
    left = MOST_SAMPLES
    for start, stop in parts:
        if left > 0:
            pieces.append(part_of(recording, start, min(stop, start + left)))
            left -= len(pieces[-1])
    stops = np.cumsum([len(piece) for piece in pieces])
    starts = stops - [len(piece) for piece in pieces]
    segments = [
        replace(segment, start=segment.start + int(at), stop=segment.stop + int(at))
        for piece, at in zip(pieces, starts, strict=True)
        for segment in piece.segments
    ]
    named = [{"start": int(start), "stop": int(stop)} for start, stop in zip(starts, stops, strict=True)]
    first = pieces[0]
    return replace(
        first,
        command=concatenate([piece.command for piece in pieces]),
        response=concatenate([piece.response for piece in pieces]),
        position=concatenate_if_all([piece.position for piece in pieces]),
        excitation=concatenate_if_all([piece.excitation for piece in pieces]),
        condition=concatenate_if_all([piece.condition for piece in pieces]),
        time_s=None,
        segments=tuple(segments) or (Segment(0, int(stops[-1]), "noise", 0.0),),
        meta={**recording.meta, "parts": named},
    )


def _half_with_lead(recording: Recording, start: int, stop: int) -> Recording:
    """A half begins in the middle of a motion: what was recorded before it is put in front, outside all segments, so
    that a simulation can start from rest."""
    lead = min(start, MOST_SAMPLES)
    whole = part_of(recording, start - lead, stop)
    own = [replace(segment, start=max(segment.start, lead)) for segment in whole.segments if segment.stop > lead]
    parts = [
        {"start": max(begin, start - lead) - start + lead, "stop": min(end, stop) - start + lead}
        for begin, end in parts_of(recording)
        if min(end, stop) > max(begin, start - lead)
    ]
    meta = {key: value for key, value in recording.meta.items() if key != "parts"}
    return replace(
        whole,
        segments=tuple(own) or (Segment(lead, len(whole), "noise", 0.0),),
        meta={**meta, "parts": parts} if len(parts) > 1 else meta,
    )


def without_lead(recording: Recording) -> Recording:
    """The recording whose lead keeps only the command; the responses there are NaN."""
    lead = min((segment.start for segment in recording.segments), default=0)
    position = None if recording.position is None else _blank_lead(recording.position, lead)
    return replace(recording, response=_blank_lead(recording.response, lead), position=position)


def _blank_lead(signal: Signal, lead: int) -> Signal:
    """The signal with NaN in the lead."""
    samples = signal.samples.copy()
    samples[:lead] = np.nan
    return replace(signal, samples=samples)


def held_out_change(intact: Recording, rest: Recording, spoiled: Recording) -> float | None:
    """Visibility of a fault: ratio of the prediction error on the half with the fault to that on the same half without
    it, for a model fitted to the intact half; in the axis or channel where it is largest. None where no model can be
    fitted.

    The model is the baseline of a comparison: forces along the motion where they balance, otherwise an autoregression
    of each reading. It contains no faults.
    """
    before, after, clean = (split_into_parts([each]) for each in (rest, spoiled, intact))
    if not before or not after or not clean:
        return None
    try:
        bases = next(bases_of(clean, ()))[0]
        found = [_error(base, clean, after) / max(_error(base, clean, before), 1e-300) for base in bases]
    except (np.linalg.LinAlgError, ValueError):
        return None
    return max(found, key=lambda times: abs(np.log(max(times, 1e-12))))


def _error(base: Base, clean: tuple[Part, ...], other: tuple[Part, ...]) -> float:
    """Rms residual on the other parts of a base model fitted to the clean ones."""
    known, asked = _rows(base, clean), _rows(base, other)
    size = np.sqrt(np.mean(known**2, axis=0))
    size = np.where(size > 0, size, 1.0)
    weights = weights_of((known / size).T @ (known / size)) / size
    return float(np.sqrt(np.mean((asked @ weights * size[0]) ** 2)))


def _rows(base: Base, parts: tuple[Part, ...]) -> FloatArray:
    return np.vstack([part[mask] for part, mask in zip(base.rows(parts), base.valid_samples(parts), strict=True)])
