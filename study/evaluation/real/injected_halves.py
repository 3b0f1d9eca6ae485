"""Split a real recording into an intact half and one that carries a fault, and measure how visible the fault is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.contrast.bases import bases_of
from analysis.diagnosis.contrast.compared_base import Base
from analysis.diagnosis.contrast.joint_products import solve_residual_weights
from analysis.diagnosis.contrast.part import Part, split_into_parts
from analysis.diagnosis.data.observed_parts import cut_part, find_parts
from equalizer.signals.joining import concatenate, concatenate_if_all
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal

MOST_SAMPLES = 5_000
"""Longest half, and longest lead before it (samples)."""
SHORTEST = 0.6
"""Shortest half as a fraction of the longest possible."""
PARTS = 4
"""From this number of parts on, halves may also be drawn from parts."""


def draw_halves(recording: Recording, random: np.random.Generator) -> tuple[Recording, Recording]:
    """Two random stretches of the recording, or random sets of its parts; which one stays intact is also random.
    Both are without roles: the fit samples are drawn anew in each."""
    without_roles = replace(recording, segments=tuple(replace(segment, role="") for segment in recording.segments))
    parts = find_parts(without_roles)
    if len(parts) >= PARTS and random.random() < 0.5:
        order = random.permutation(len(parts))
        part_sets = [sorted(order[: len(parts) // 2]), sorted(order[len(parts) // 2 :])]
        first, second = (_join_parts(without_roles, [parts[k] for k in part_numbers]) for part_numbers in part_sets)
    else:
        half = int(min(len(recording) // 2, MOST_SAMPLES) * random.uniform(SHORTEST, 1.0))
        start = int(random.integers(len(recording) - 2 * half + 1))
        first, second = (
            _half_with_lead(without_roles, start, start + half),
            _half_with_lead(without_roles, start + half, start + 2 * half),
        )
    return (first, second) if random.random() < 0.5 else (second, first)


def _join_parts(recording: Recording, parts: Sequence[tuple[int, int]]) -> Recording:
    """Concatenate parts up to the length of a half; the last one may be cut."""
    stretches: list[Recording] = []
    remaining = MOST_SAMPLES
    for start, stop in parts:
        if remaining > 0:
            stretches.append(cut_part(recording, start, min(stop, start + remaining)))
            remaining -= len(stretches[-1])
    stops = np.cumsum([len(stretch) for stretch in stretches])
    starts = stops - [len(stretch) for stretch in stretches]
    segments = [
        replace(segment, start=segment.start + int(offset), stop=segment.stop + int(offset))
        for stretch, offset in zip(stretches, starts, strict=True)
        for segment in stretch.segments
    ]
    part_bounds = [{"start": int(start), "stop": int(stop)} for start, stop in zip(starts, stops, strict=True)]
    first = stretches[0]
    return replace(
        first,
        command=concatenate([stretch.command for stretch in stretches]),
        response=concatenate([stretch.response for stretch in stretches]),
        position=concatenate_if_all([stretch.position for stretch in stretches]),
        excitation=concatenate_if_all([stretch.excitation for stretch in stretches]),
        condition=concatenate_if_all([stretch.condition for stretch in stretches]),
        time_s=None,
        segments=tuple(segments) or (Segment(0, int(stops[-1]), "noise", 0.0),),
        meta={**recording.meta, "parts": part_bounds},
    )


def _half_with_lead(recording: Recording, start: int, stop: int) -> Recording:
    """A half begins in the middle of a motion: what was recorded before it is put in front, outside all segments, so
    that a simulation can start from rest."""
    lead = min(start, MOST_SAMPLES)
    lead_and_half = cut_part(recording, start - lead, stop)
    half_segments = [
        replace(segment, start=max(segment.start, lead)) for segment in lead_and_half.segments if segment.stop > lead
    ]
    parts = [
        {"start": max(part_start, start - lead) - start + lead, "stop": min(part_stop, stop) - start + lead}
        for part_start, part_stop in find_parts(recording)
        if min(part_stop, stop) > max(part_start, start - lead)
    ]
    meta = {key: value for key, value in recording.meta.items() if key != "parts"}
    return replace(
        lead_and_half,
        segments=tuple(half_segments) or (Segment(lead, len(lead_and_half), "noise", 0.0),),
        meta={**meta, "parts": parts} if len(parts) > 1 else meta,
    )


def blank_lead_responses(recording: Recording) -> Recording:
    """The recording whose lead keeps only the command; the responses there are NaN."""
    lead = min((segment.start for segment in recording.segments), default=0)
    position = None if recording.position is None else _blank_lead(recording.position, lead)
    return replace(recording, response=_blank_lead(recording.response, lead), position=position)


def _blank_lead(signal: Signal, lead: int) -> Signal:
    """The signal with NaN in the lead."""
    samples = signal.samples.copy()
    samples[:lead] = np.nan
    return replace(signal, samples=samples)


def held_out_change(intact: Recording, faultless: Recording, faulty: Recording) -> float | None:
    """Visibility of a fault: ratio of the prediction error on the half with the fault to that on the same half without
    it, for a model fitted to the intact half; in the axis or channel where it is largest. None where no model can be
    fitted.

    The model is the baseline of a comparison: forces along the motion where they balance, otherwise an autoregression
    of each reading. It contains no faults.
    """
    faultless_parts, faulty_parts, intact_parts = (split_into_parts([half]) for half in (faultless, faulty, intact))
    if not faultless_parts or not faulty_parts or not intact_parts:
        return None
    try:
        bases = next(bases_of(intact_parts, ()))[0]
        ratios = [
            _measure_error(base, intact_parts, faulty_parts)
            / max(_measure_error(base, intact_parts, faultless_parts), 1e-300)
            for base in bases
        ]
    except (np.linalg.LinAlgError, ValueError):
        return None
    return max(ratios, key=lambda ratio: abs(np.log(max(ratio, 1e-12))))


def _measure_error(base: Base, clean_parts: tuple[Part, ...], other_parts: tuple[Part, ...]) -> float:
    """Rms residual on the other parts of a base model fitted to the clean ones."""
    clean_rows, other_rows = _stack_rows(base, clean_parts), _stack_rows(base, other_parts)
    size = np.sqrt(np.mean(clean_rows**2, axis=0))
    size = np.where(size > 0, size, 1.0)
    weights = solve_residual_weights((clean_rows / size).T @ (clean_rows / size)) / size
    return float(np.sqrt(np.mean((other_rows @ weights * size[0]) ** 2)))


def _stack_rows(base: Base, parts: tuple[Part, ...]) -> FloatArray:
    return np.vstack(
        [part[mask] for part, mask in zip(base.build_rows(parts), base.mask_valid_samples(parts), strict=True)]
    )
