"""Prepares recordings for the comparison with a model; the same for recordings from files and from arrays.

In this order: segments are found where a recording states none, commands and responses are brought into the form that a
force balance needs (only where no model says what they are), motions become force-driven, short gaps in commands are
interpolated and long ones cut out; then unsuitable recordings are refused, and constant positions are left out. Used
by `diagnose_values` and `diagnosis_input`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.find_segments import find_segments
from analysis.diagnosis.data.input_checks import require_different, require_usable_data
from analysis.diagnosis.data.measured_motion import convert_all_to_force_driven
from analysis.diagnosis.data.observed_parts import LEAST_SAMPLES, find_parts
from analysis.diagnosis.settings import BRIDGED_GAP_ERROR, LEAST_GAPLESS_SHARE
from analysis.diagnosis.types import Mask
from analysis.wording import begin_sentence, conjoin
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, find_runs

CONSTANT_RANGE = 1e-9
"""Range of a signal over its largest magnitude, below which changes are rounding errors."""


@dataclass(frozen=True, slots=True, eq=False)
class PreparedRecordings:
    """The recordings in the form that a diagnosis needs, and remarks on the changes."""

    recordings: tuple[Recording, ...]
    remarks: tuple[str, ...] = ()
    """Sentences for the user on what was changed, and on weaknesses such as few cycles."""


def prepare_recordings(
    recordings: Sequence[Recording], names: Sequence[str], without_model: bool, accept_short: bool | None = None
) -> PreparedRecordings:
    """Prepare recordings. recordings: with the same channels, units and rate, in the order of names. without_model:
    convert them to one motion per force (no model was given). accept_short: few cycles or samples are a remark instead
    of a refusal; None = the value of without_model. Raises NothingToDiagnose for unsuitable recordings."""
    segmented = [find_segments(recording) for recording in recordings]
    found_repeats = [(name, text) for name, (_, text) in zip(names, segmented, strict=True) if text]
    repeats = tuple(text if len(recordings) == 1 else f"{name}: {text}" for name, text in found_repeats)
    with_segments = tuple(recording for recording, _ in segmented)
    force_recordings: tuple[Recording, ...] = with_segments
    omission_remarks: tuple[str, ...] = ()
    if without_model:
        # Imported here: a given model says which motion each force drives.
        from analysis.diagnosis.first_model.one_motion_per_force import convert_to_driven_motions

        force_recordings, omission_remarks = convert_to_driven_motions(with_segments)
    driven, gaps = bridge_gaps(convert_all_to_force_driven(force_recordings), names)
    compared = prepare_comparison(driven, names, without_model if accept_short is None else accept_short)
    return PreparedRecordings(compared.recordings, (*repeats, *omission_remarks, *gaps, *compared.remarks))


def prepare_comparison(recordings: Sequence[Recording], names: Sequence[str], accept_short: bool) -> PreparedRecordings:
    """Only the last two steps (refusal, constant positions), for recordings that are prepared already, such as the
    trials of a session. Raises NothingToDiagnose for unsuitable recordings."""
    require_different(recordings, names)
    weaknesses = tuple(
        f"{begin_sentence(problem)}." for problem in require_usable_data(recordings, names, accept_short)
    )
    common = keep_common_signals(recordings)
    usable = _drop_constant_position(common.recordings)
    return PreparedRecordings(usable.recordings, (*weaknesses, *common.remarks, *usable.remarks))


def keep_common_signals(recordings: Sequence[Recording]) -> PreparedRecordings:
    """The recordings with their positions and conditions; where these are not the same in all, without them and with a
    remark."""
    common = _keep_common_conditions(recordings)
    kinds = {
        None if recording.position is None else (recording.position.channels, recording.position.units)
        for recording in recordings
    }
    if len(kinds) < 2:
        return common
    without_position = _remove_position(common.recordings, "Only some recordings hold the same position channels")
    return replace(without_position, remarks=(*common.remarks, *without_position.remarks))


def _keep_common_conditions(recordings: Sequence[Recording]) -> PreparedRecordings:
    """The recordings with their conditions; where these are not the same in all, without them and with a remark."""
    conditions = [
        None if recording.condition is None else (recording.condition.channels, recording.condition.units)
        for recording in recordings
    ]
    if len(set(conditions)) < 2:
        return PreparedRecordings(tuple(recordings))
    return PreparedRecordings(
        tuple(replace(recording, condition=None) for recording in recordings),
        (
            "Not all recordings hold the same conditions in the same order: no law with a dependence on them was "
            "tested.",
        ),
    )


def _drop_constant_position(recordings: Sequence[Recording]) -> PreparedRecordings:
    """The recordings, without positions where one never changes: its errors cannot be normalised to its signal."""
    positions = [position.position for position in recordings if position.position is not None]
    if not positions:
        return PreparedRecordings(tuple(recordings))
    samples = np.vstack([position.samples for position in positions])
    filled = np.where(np.isfinite(samples), samples, np.nanmedian(samples, axis=0))
    is_constant = np.ptp(filled, axis=0) <= CONSTANT_RANGE * np.abs(filled).max(axis=0)
    constant_channels = [name for name, constant in zip(positions[0].channels, is_constant, strict=True) if constant]
    if not constant_channels:
        return PreparedRecordings(tuple(recordings))
    return _remove_position(recordings, f"Position {conjoin(constant_channels)} never changes")


def _remove_position(recordings: Sequence[Recording], reason: str) -> PreparedRecordings:
    """The recordings without positions, and a remark. reason: begins the remark."""
    reduced = tuple(replace(recording, position=None) for recording in recordings)
    return PreparedRecordings(reduced, (f"{reason}: the position was left out of the comparison.",))


Stretch = tuple[int, int]
"""Start and stop (exclusive) of samples."""


def bridge_gaps(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """The recordings with gaps (NaN) in their commands interpolated or cut out, and a sentence for each that was
    changed. A recording of which less than `LEAST_GAPLESS_SHARE` of the known samples would remain is not changed."""
    bridged = [_bridge_or_cut(recording, name) for recording, name in zip(recordings, names, strict=True)]
    return tuple(changed for changed, _ in bridged), tuple(remark for _, remark in bridged if remark)


def _bridge_or_cut(recording: Recording, name: str) -> tuple[Recording, str]:
    """See `bridge_gaps`. The parts between gaps that were cut out are noted in the recording's meta data."""
    missing: Mask = np.asarray(np.isnan(recording.command.samples).any(axis=1))
    if not missing.any() or missing.all():
        return recording, ""
    gaps = find_runs(missing)
    interpolated = _interpolate(recording.command.samples)
    wide = [gap for gap in gaps if not _can_bridge(recording.command.samples, gap[1] - gap[0])]
    narrow = [gap for gap in gaps if gap not in wide]
    parts = [part for stretch in find_parts(recording) for part in _list_stretches_between(stretch, wide)]
    if sum(stop - start for start, stop in parts) < LEAST_GAPLESS_SHARE * int((~missing).sum()):
        return recording, ""
    changed_recording = replace(recording, command=replace(recording.command, samples=interpolated))
    if wide:
        stretches = [{"start": start, "stop": stop} for start, stop in parts]
        changed_recording = replace(changed_recording, meta={**recording.meta, "parts": stretches})
    texts = [
        f"{len(kind)} gap{'s' if len(kind) != 1 else ''} ({sum(end - onset for onset, end in kind)} samples) {action}"
        for kind, action in (
            (
                narrow,
                "interpolated linearly, because the command hardly deviates from a straight line over so short a time",
            ),
            (wide, f"cut out, so that {len(parts)} parts are compared separately"),
        )
        if kind
    ]
    return changed_recording, f"{name} has gaps in the command: {', '.join(texts)}."


def _can_bridge(samples: FloatArray, gap: int) -> bool:
    """Whether a gap of so many samples may be interpolated: straight lines over that length differ from the known
    command by at most `BRIDGED_GAP_ERROR` of its standard deviation (rms)."""
    lead_samples, lag_samples = (gap + 1) // 2, (gap + 2) // 2
    middle = samples[lead_samples : len(samples) - lag_samples]
    if not len(middle):
        return False
    share = lag_samples / (lead_samples + lag_samples)
    straight_line = share * samples[: len(middle)] + (1 - share) * samples[lead_samples + lag_samples :]
    errors, spread = middle - straight_line, np.nanstd(samples, axis=0)
    is_known = np.isfinite(errors).all(axis=1)
    rms_errors = np.sqrt(np.mean(errors[is_known] ** 2, axis=0)) if is_known.any() else np.full_like(spread, np.inf)
    return bool(np.all(rms_errors <= BRIDGED_GAP_ERROR * spread))


def _list_stretches_between(stretch: Stretch, gaps: Sequence[Stretch]) -> list[Stretch]:
    """The stretches between gaps that are long enough to be compared."""
    position, stretches = stretch[0], []
    for start, stop in (*gaps, (stretch[1], stretch[1])):
        stretches.append((position, min(max(start, position), stretch[1])))
        position = max(stop, position)
    return [(start, stop) for start, stop in stretches if stop - start >= LEAST_SAMPLES]


def _interpolate(samples: FloatArray) -> FloatArray:
    """Samples (n, m) with NaN replaced by linear interpolation, channel by channel."""
    interpolated, indices = np.array(samples), np.arange(len(samples))
    for column in interpolated.T:
        is_known = np.isfinite(column)
        if is_known.any():
            column[:] = np.interp(indices, indices[is_known], column[is_known])
    return interpolated
