"""Prepare recordings for the comparison with a model, whether they come from files or from arrays.

In this order: isolated samples that no motion can have are interpolated; segments are found where a recording states
none; commands and responses are brought into the form that a force balance needs (only where no model was given);
recordings with an imposed motion become force-driven; short gaps in commands are interpolated and long ones cut out;
unsuitable recordings are refused; positions and conditions that not all recordings contain are removed, then constant
positions.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.find_segments import find_segments
from analysis.diagnosis.data.input_checks import require_usable_data
from analysis.diagnosis.data.measured_motion import convert_all_to_force_driven, fill_gaps
from analysis.diagnosis.limits import BRIDGED_GAP_ERROR, LEAST_GAPLESS_SHARE
from analysis.diagnosis.types import Mask
from analysis.wording import begin_sentence, conjoin
from equalizer.signals.recording import LEAST_PART_SAMPLES, Recording, find_parts
from equalizer.signals.signal import FloatArray, find_runs

CONSTANT_RANGE = 1e-9
"""Range of a signal over its largest magnitude, up to which changes count as rounding errors. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class PreparedRecordings:
    """The recordings in the form that a diagnosis needs, and remarks on the changes."""

    recordings: tuple[Recording, ...]
    remarks: tuple[str, ...] = ()
    """Sentences for the user on what was changed, and on weaknesses such as few cycles."""


def prepare_recordings(
    recordings: Sequence[Recording], names: Sequence[str], without_model: bool, accept_short: bool | None = None
) -> PreparedRecordings:
    """Prepare recordings by all steps of the module docstring. recordings: with the same channels, units and rate, in
    the order of names. without_model: whether to convert them to one motion per force (no model was given).
    accept_short: whether few cycles or samples are a remark instead of a refusal; None = the value of without_model.
    Raises NothingToDiagnoseError for unsuitable recordings."""
    # Imported on demand: trials of a session are not changed.
    from equalizer.signals.isolated_samples import interpolate_all

    interpolated, interpolation_remarks = interpolate_all(recordings, names)
    segment_results = [find_segments(recording) for recording in interpolated]
    repeat_remarks = _prefix_names(names, [text for _, text in segment_results])
    segmented_recordings = tuple(recording for recording, _ in segment_results)
    force_recordings: tuple[Recording, ...] = segmented_recordings
    omission_remarks: tuple[str, ...] = ()
    if without_model:
        # Imported here: a given model says which motion each force drives.
        from analysis.diagnosis.first_model.one_motion_per_force import convert_to_driven_motions

        force_recordings, omission_remarks = convert_to_driven_motions(segmented_recordings)
    force_driven, gap_remarks = bridge_gaps(convert_all_to_force_driven(force_recordings), names)
    prepared = prepare_comparison(force_driven, names, without_model if accept_short is None else accept_short)
    return PreparedRecordings(
        prepared.recordings,
        (*interpolation_remarks, *repeat_remarks, *omission_remarks, *gap_remarks, *prepared.remarks),
    )


def _prefix_names(names: Sequence[str], texts: Sequence[str]) -> tuple[str, ...]:
    """Prefix sentences, one per recording, with its name where there are several; without the empty ones."""
    return tuple(
        text if len(names) == 1 else f"{name}: {text}" for name, text in zip(names, texts, strict=True) if text
    )


def prepare_comparison(recordings: Sequence[Recording], names: Sequence[str], accept_short: bool) -> PreparedRecordings:
    """Prepare recordings by the last steps only (from the refusal on), for recordings that are prepared already, such
    as the trials of a session. Raises NothingToDiagnoseError for unsuitable recordings."""
    weakness_remarks = tuple(
        f"{begin_sentence(problem)}." for problem in require_usable_data(recordings, names, accept_short)
    )
    with_common_signals = keep_common_signals(recordings)
    with_varying_position = _drop_constant_position(with_common_signals.recordings)
    return PreparedRecordings(
        with_varying_position.recordings,
        (*weakness_remarks, *with_common_signals.remarks, *with_varying_position.remarks),
    )


def keep_common_signals(recordings: Sequence[Recording]) -> PreparedRecordings:
    """Remove positions, or conditions, whose channels or units are not the same in all recordings, with a remark."""
    with_common_conditions = _keep_common_conditions(recordings)
    position_kinds = {
        None if recording.position is None else (recording.position.channels, recording.position.units)
        for recording in recordings
    }
    if len(position_kinds) < 2:
        return with_common_conditions
    without_position = _remove_position(
        with_common_conditions.recordings, "Only some recordings hold the same position channels"
    )
    return replace(without_position, remarks=(*with_common_conditions.remarks, *without_position.remarks))


def _keep_common_conditions(recordings: Sequence[Recording]) -> PreparedRecordings:
    """Remove the conditions where their channels or units are not the same in all recordings, with a remark."""
    condition_kinds = [
        None if recording.condition is None else (recording.condition.channels, recording.condition.units)
        for recording in recordings
    ]
    if len(set(condition_kinds)) < 2:
        return PreparedRecordings(tuple(recordings))
    return PreparedRecordings(
        tuple(replace(recording, condition=None) for recording in recordings),
        (
            "Not all recordings hold the same conditions in the same order: no law with a dependence on them was "
            "tested.",
        ),
    )


def _drop_constant_position(recordings: Sequence[Recording]) -> PreparedRecordings:
    """Remove the positions of all recordings where a channel is constant over all of them, with a remark: its errors
    cannot be normalised to its signal. Gaps (NaN) count as the channel's median."""
    positions = [recording.position for recording in recordings if recording.position is not None]
    if not positions:
        return PreparedRecordings(tuple(recordings))
    samples = np.vstack([recording.samples for recording in positions])
    filled_samples = np.where(np.isfinite(samples), samples, np.nanmedian(samples, axis=0))
    is_constant = np.ptp(filled_samples, axis=0) <= CONSTANT_RANGE * np.abs(filled_samples).max(axis=0)
    constant_channels = [
        name
        for name, is_channel_constant in zip(positions[0].channels, is_constant, strict=True)
        if is_channel_constant
    ]
    if not constant_channels:
        return PreparedRecordings(tuple(recordings))
    return _remove_position(recordings, f"Position {conjoin(constant_channels)} never changes")


def _remove_position(recordings: Sequence[Recording], reason: str) -> PreparedRecordings:
    """Remove the positions of all recordings, with a remark. reason: begins the remark."""
    reduced_recordings = tuple(replace(recording, position=None) for recording in recordings)
    return PreparedRecordings(reduced_recordings, (f"{reason}: the position was left out of the comparison.",))


Stretch = tuple[int, int]
"""Start and stop (exclusive) of samples."""


def bridge_gaps(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Interpolate gaps (NaN) in the commands or cut them out; returns the recordings, and a sentence for each that was
    changed. A recording of which less than `LEAST_GAPLESS_SHARE` of the known samples would remain is not changed; nor
    is one without gaps or without known samples."""
    bridged_recordings = [
        _bridge_or_cut_gaps(recording, name) for recording, name in zip(recordings, names, strict=True)
    ]
    return tuple(bridged_recording for bridged_recording, _ in bridged_recordings), tuple(
        remark for _, remark in bridged_recordings if remark
    )


def _bridge_or_cut_gaps(recording: Recording, name: str) -> tuple[Recording, str]:
    """Interpolate or cut out the gaps of one recording (`bridge_gaps`); returns it, and a sentence or "". The parts
    between gaps that were cut out are stored in the recording's meta as `parts`."""
    is_missing: Mask = np.asarray(np.isnan(recording.command.samples).any(axis=1))
    if not is_missing.any() or is_missing.all():
        return recording, ""
    all_gaps = find_runs(is_missing)
    interpolated_samples = fill_gaps(recording.command.samples)
    wide_gaps = [gap for gap in all_gaps if not _can_bridge(recording.command.samples, gap[1] - gap[0])]
    narrow_gaps = [gap for gap in all_gaps if gap not in wide_gaps]
    parts = [part for stretch in find_parts(recording) for part in _list_stretches_between_gaps(stretch, wide_gaps)]
    if sum(stop - start for start, stop in parts) < LEAST_GAPLESS_SHARE * int((~is_missing).sum()):
        return recording, ""
    changed_recording = replace(recording, command=replace(recording.command, samples=interpolated_samples))
    if wide_gaps:
        part_entries = [{"start": start, "stop": stop} for start, stop in parts]
        changed_recording = replace(changed_recording, meta={**recording.meta, "parts": part_entries})
    texts = [
        f"{len(gaps)} gap{'s' if len(gaps) != 1 else ''} ({sum(end - onset for onset, end in gaps)} samples) {action}"
        for gaps, action in (
            (
                narrow_gaps,
                "interpolated linearly, because the command hardly deviates from a straight line over so short a time",
            ),
            (wide_gaps, f"cut out, so that {len(parts)} parts are compared separately"),
        )
        if gaps
    ]
    return changed_recording, f"{name} has gaps in the command: {', '.join(texts)}."


def _can_bridge(samples: FloatArray, gap_samples: int) -> bool:
    """Whether a gap of gap_samples samples may be interpolated: straight lines over that length differ from the known
    command by an rms of at most `BRIDGED_GAP_ERROR` of its standard deviation, in every channel. samples: (n, m)."""
    lead_samples, lag_samples = (gap_samples + 1) // 2, (gap_samples + 2) // 2
    middle_samples = samples[lead_samples : len(samples) - lag_samples]
    if not len(middle_samples):
        return False
    lag_share = lag_samples / (lead_samples + lag_samples)
    straight_line = lag_share * samples[: len(middle_samples)] + (1 - lag_share) * samples[lead_samples + lag_samples :]
    errors, command_deviations = middle_samples - straight_line, np.nanstd(samples, axis=0)
    is_known = np.isfinite(errors).all(axis=1)
    rms_errors = (
        np.sqrt(np.mean(errors[is_known] ** 2, axis=0)) if is_known.any() else np.full_like(command_deviations, np.inf)
    )
    return bool(np.all(rms_errors <= BRIDGED_GAP_ERROR * command_deviations))


def _list_stretches_between_gaps(stretch: Stretch, gaps: Sequence[Stretch]) -> list[Stretch]:
    """List the stretches between gaps that have at least `LEAST_PART_SAMPLES` samples."""
    stretch_start, stretches = stretch[0], []
    for start, stop in (*gaps, (stretch[1], stretch[1])):
        stretches.append((stretch_start, min(max(start, stretch_start), stretch[1])))
        stretch_start = max(stop, stretch_start)
    return [(start, stop) for start, stop in stretches if stop - start >= LEAST_PART_SAMPLES]
