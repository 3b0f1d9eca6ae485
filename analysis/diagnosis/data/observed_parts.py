"""Cut recordings into their parts (continuous stretches between gaps); each part is compared with the model by itself.

The samples of each part are split into those to fit, to choose and to test by (`observed.split_samples`). Periods of a
segment after the first `MOST_PERIODS` are used for the test only. Begin at `observe_parts`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.observed import Observed, find_moving_spans, split_samples, stack_measured_signals
from analysis.diagnosis.limits import CHOOSE_SHARE
from analysis.diagnosis.types import Mask
from equalizer.signals.recording import Recording, Segment, find_parts
from equalizer.signals.signal import Signal

MOST_PERIODS = 4
"""Largest number of periods of a segment to fit and to choose by: further ones add computing time and little
information. Chosen by hand."""


def observe_parts(recordings: Sequence[Recording], response_count: int) -> tuple[Observed, ...]:
    """Cut all recordings into parts, ready for comparison. response_count: number of the model's outputs; a position
    with another number of channels is not used. Roles are those of the whole set: where a segment of any recording is
    marked as test, no other samples are held out; where all segments are marked as test, the marks are ignored."""
    roles = [segment.role for recording in recordings for segment in recording.segments]
    if roles and all(role == "test" for role in roles):
        recordings = [_clear_roles(recording) for recording in recordings]
    has_test_segment = any(segment.role == "test" for recording in recordings for segment in recording.segments)
    parts: list[Observed] = []
    for recording in recordings:
        measured, is_complete = stack_measured_signals(recording, response_count)
        spans = find_moving_spans(recording.response.samples, find_parts(recording))
        fit, choose, test = split_samples(recording.segments, len(recording), has_test_segment, spans)
        masks = (
            *_exclude_surplus_periods(fit & is_complete, choose & is_complete, ~_mask_surplus_periods(recording)),
            test & is_complete,
        )
        for start, stop in find_parts(recording):
            part_masks: tuple[Mask, ...] = tuple(mask[start:stop] for mask in masks)
            part = cut_part(recording, start, stop)
            parts.append(Observed(part, part.command.samples, measured[start:stop], *part_masks))
    return tuple(parts)


def count_fit_samples(recordings: Sequence[Recording]) -> int:
    """Count the samples to fit that have a response, and a position where its channels are as many as the responses."""
    return sum(int(record.fit.sum()) for record in observe_parts(recordings, len(recordings[0].response.channels)))


def _exclude_surplus_periods(fit: Mask, choose: Mask, is_used: Mask) -> tuple[Mask, Mask]:
    """Exclude surplus periods from the masks of fit and validation samples. Where no validation samples are left, the
    last share `CHOOSE_SHARE` of the fit samples is used. is_used: (n,), False in surplus periods."""
    if (choose & is_used).any() or not (fit & is_used).any():
        return fit & is_used, choose & is_used
    indices = np.flatnonzero(fit & is_used)
    chosen_indices = indices[int((1 - CHOOSE_SHARE) * len(indices)) :]
    chosen_mask: Mask = np.zeros(len(fit), dtype=np.bool_)
    chosen_mask[chosen_indices] = True
    return fit & is_used & ~chosen_mask, chosen_mask


def _mask_surplus_periods(recording: Recording) -> Mask:
    """Make the mask (n,) of the samples after the first `MOST_PERIODS` periods of a segment."""
    mask = np.zeros(len(recording), dtype=np.bool_)
    for segment in recording.segments:
        if segment.period > 0:
            mask[segment.start + MOST_PERIODS * segment.period : segment.stop] = True
    return mask


def cut_part(recording: Recording, start: int, stop: int) -> Recording:
    """Cut the recording to samples start to stop (exclusive), with its segments cut to this range. The metadata "parts"
    of a recording that is cut are left out, because they count the samples of the whole one."""
    if (start, stop) == (0, len(recording)):
        return recording
    segments = [
        _shift_segment(segment, start, stop)
        for segment in recording.segments
        if segment.stop > start and segment.start < stop
    ]
    return replace(
        recording,
        command=recording.command.select_samples(start, stop),
        response=recording.response.select_samples(start, stop),
        position=_cut_signal(recording.position, start, stop),
        excitation=_cut_signal(recording.excitation, start, stop),
        condition=_cut_signal(recording.condition, start, stop),
        time_s=None if recording.time_s is None else recording.time_s[start:stop],
        segments=tuple(segments),
        meta={key: value for key, value in recording.meta.items() if key != "parts"},
    )


def _cut_signal(signal: Signal | None, start: int, stop: int) -> Signal | None:
    """Cut a signal to samples start to stop (exclusive); None without a signal."""
    return None if signal is None else signal.select_samples(start, stop)


def _shift_segment(segment: Segment, start: int, stop: int) -> Segment:
    """Cut a segment to samples start to stop, counted from `start`."""
    return replace(segment, start=max(segment.start, start) - start, stop=min(segment.stop, stop) - start)


def _clear_roles(recording: Recording) -> Recording:
    """Clear the roles (fit, test) of the recording's segments."""
    return replace(recording, segments=tuple(replace(segment, role="") for segment in recording.segments))


def name_parts(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[str, ...]:
    """Name the parts in the order of `observe_parts`: the recording's name ("recording 2" where `names` is too short),
    with the part's number where there are several."""
    part_names: list[str] = []
    for recording_index, recording in enumerate(recordings):
        name = names[recording_index] if recording_index < len(names) else f"recording {recording_index + 1}"
        part_count = len(find_parts(recording))
        part_names += (
            [name] if part_count == 1 else [f"{name}, part {part_index + 1}" for part_index in range(part_count)]
        )
    return tuple(part_names)
