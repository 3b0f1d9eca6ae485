"""Split a real recording into an intact half and a half for an injected fault, and measure how visible the fault is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.contrast.bases import build_bases
from analysis.diagnosis.contrast.compared_base import Base
from analysis.diagnosis.contrast.joint_products import solve_residual_weights
from analysis.diagnosis.contrast.recording_part import Part, split_into_parts
from analysis.diagnosis.data.observed_parts import cut_part
from equalizer.signals.joining import concatenate_if_all_present, concatenate_signals
from equalizer.signals.recording import Recording, Segment, find_parts
from equalizer.signals.signal import FloatArray, Signal

MAX_SAMPLES = 5_000
"""Largest number of samples of a half, and of the lead recorded before it. Chosen: bounds the time of a diagnosis."""
MIN_LENGTH_RATIO = 0.6
"""Shortest half as a fraction of the longest possible, where halves are stretches. Chosen."""
MIN_PARTS = 4
"""Smallest number of parts from which halves may also be drawn from parts. Chosen: two in each half."""


def draw_halves(recording: Recording, random: np.random.Generator) -> tuple[Recording, Recording]:
    """Draw two adjoining stretches of the recording, or, with probability 1/2 from `MIN_PARTS` parts on, two random
    sets of its parts, each in their order of time. Returns them in random order: the first stays intact, the
    second is for the fault. Both are without roles: the fit samples are drawn anew in each."""
    recording_without_roles = replace(
        recording, segments=tuple(replace(segment, role="") for segment in recording.segments)
    )
    parts = find_parts(recording_without_roles)
    if len(parts) >= MIN_PARTS and random.random() < 0.5:
        part_order = random.permutation(len(parts))
        part_sets = [sorted(part_order[: len(parts) // 2]), sorted(part_order[len(parts) // 2 :])]
        first_half, second_half = (
            _join_parts(recording_without_roles, [parts[part_number] for part_number in part_numbers])
            for part_numbers in part_sets
        )
    else:
        half_length = int(min(len(recording) // 2, MAX_SAMPLES) * random.uniform(MIN_LENGTH_RATIO, 1.0))
        start = int(random.integers(len(recording) - 2 * half_length + 1))
        first_half, second_half = (
            _cut_half_with_lead(recording_without_roles, start, start + half_length),
            _cut_half_with_lead(recording_without_roles, start + half_length, start + 2 * half_length),
        )
    return (first_half, second_half) if random.random() < 0.5 else (second_half, first_half)


def _join_parts(recording: Recording, parts: Sequence[tuple[int, int]]) -> Recording:
    """Concatenate parts, (start, stop) in samples, up to `MAX_SAMPLES`; the last one may be cut. The meta entry "parts"
    states their bounds."""
    stretches: list[Recording] = []
    remaining_samples = MAX_SAMPLES
    for start, stop in parts:
        if remaining_samples > 0:
            stretches.append(cut_part(recording, start, min(stop, start + remaining_samples)))
            remaining_samples -= len(stretches[-1])
    stops = np.cumsum([len(stretch) for stretch in stretches])
    starts = stops - [len(stretch) for stretch in stretches]
    segments = [
        replace(segment, start=segment.start + int(offset), stop=segment.stop + int(offset))
        for stretch, offset in zip(stretches, starts, strict=True)
        for segment in stretch.segments
    ]
    part_bounds = [{"start": int(start), "stop": int(stop)} for start, stop in zip(starts, stops, strict=True)]
    first_stretch = stretches[0]
    return replace(
        first_stretch,
        command=concatenate_signals([stretch.command for stretch in stretches]),
        response=concatenate_signals([stretch.response for stretch in stretches]),
        position=concatenate_if_all_present([stretch.position for stretch in stretches]),
        excitation=concatenate_if_all_present([stretch.excitation for stretch in stretches]),
        condition=concatenate_if_all_present([stretch.condition for stretch in stretches]),
        time_s=None,
        segments=tuple(segments) or (Segment(0, int(stops[-1]), "noise", 0.0),),
        meta={**recording.meta, "parts": part_bounds},
    )


def _cut_half_with_lead(recording: Recording, start: int, stop: int) -> Recording:
    """Cut the samples start to stop, and keep up to `MAX_SAMPLES` samples before them as a lead, outside all segments:
    a half begins in the middle of a motion, and with the lead a simulation can start from rest."""
    lead_samples = min(start, MAX_SAMPLES)
    lead_and_half = cut_part(recording, start - lead_samples, stop)
    half_segments = [
        replace(segment, start=max(segment.start, lead_samples))
        for segment in lead_and_half.segments
        if segment.stop > lead_samples
    ]
    parts = [
        {
            "start": max(part_start, start - lead_samples) - start + lead_samples,
            "stop": min(part_stop, stop) - start + lead_samples,
        }
        for part_start, part_stop in find_parts(recording)
        if min(part_stop, stop) > max(part_start, start - lead_samples)
    ]
    meta = {key: value for key, value in recording.meta.items() if key != "parts"}
    return replace(
        lead_and_half,
        segments=tuple(half_segments) or (Segment(lead_samples, len(lead_and_half), "noise", 0.0),),
        meta={**meta, "parts": parts} if len(parts) > 1 else meta,
    )


def blank_lead_responses(recording: Recording) -> Recording:
    """Replace response and position by NaN in the lead, the samples before the first segment; the command there is
    kept. Returns a new recording."""
    lead_samples = min((segment.start for segment in recording.segments), default=0)
    position = None if recording.position is None else _blank_lead(recording.position, lead_samples)
    return replace(recording, response=_blank_lead(recording.response, lead_samples), position=position)


def _blank_lead(signal: Signal, lead_samples: int) -> Signal:
    """Replace the first `lead_samples` samples of all channels by NaN in a copy of the signal."""
    samples = signal.samples.copy()
    samples[:lead_samples] = np.nan
    return replace(signal, samples=samples)


def compute_held_out_change(intact: Recording, faultless: Recording, faulty: Recording) -> float | None:
    """Compute the visibility of a fault: ratio of the prediction error on the half with the fault to that on the same
    half without it, for a model fitted to the intact half; in the axis or channel where it differs most from 1, by its
    logarithm. None where no model can be fitted, or a half has no part to compare. The limits 1e-300 and 1e-12 only
    avoid a division by zero and log(0).

    The model is the baseline of a comparison: forces along the motion where they balance, otherwise an autoregression
    of each reading. It contains no faults.
    """
    faultless_parts, faulty_parts, intact_parts = (split_into_parts([half]) for half in (faultless, faulty, intact))
    if not faultless_parts or not faulty_parts or not intact_parts:
        return None
    try:
        bases = next(build_bases(intact_parts, ()))[0]
        error_ratios = [
            _measure_error(base, intact_parts, faulty_parts)
            / max(_measure_error(base, intact_parts, faultless_parts), 1e-300)
            for base in bases
        ]
    except (np.linalg.LinAlgError, ValueError):
        return None
    return max(error_ratios, key=lambda error_ratio: abs(np.log(max(error_ratio, 1e-12))))


def _measure_error(base: Base, fitted_parts: tuple[Part, ...], tested_parts: tuple[Part, ...]) -> float:
    """Compute the rms residual on the tested parts of a base model fitted to the fitted parts by least squares, in the
    unit of the model's first column."""
    fitted_rows, tested_rows = _stack_rows(base, fitted_parts), _stack_rows(base, tested_parts)
    column_rms = np.sqrt(np.mean(fitted_rows**2, axis=0))
    column_rms = np.where(column_rms > 0, column_rms, 1.0)
    weights = solve_residual_weights((fitted_rows / column_rms).T @ (fitted_rows / column_rms)) / column_rms
    return float(np.sqrt(np.mean((tested_rows @ weights * column_rms[0]) ** 2)))


def _stack_rows(base: Base, parts: tuple[Part, ...]) -> FloatArray:
    """Stack the rows (n, k) of the model's regression at the valid samples of all parts."""
    return np.vstack(
        [part[mask] for part, mask in zip(base.build_rows(parts), base.mask_valid_samples(parts), strict=True)]
    )
