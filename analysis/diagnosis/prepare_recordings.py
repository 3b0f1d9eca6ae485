"""Prepares recordings for the comparison with a model; the same for recordings from files and from arrays.

In this order: segments are found where a recording states none, commands and responses are brought into the form that a
force balance needs (only where no model says what they are), motions become force-driven, short gaps in commands are
interpolated and long ones cut out; then unsuitable recordings are refused, and constant positions are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.found_segments import find_segments
from analysis.diagnosis.data.input_checks import require_different, require_something
from analysis.diagnosis.data.measured_motion import all_as_force_driven
from analysis.diagnosis.data.observed_parts import LEAST_SAMPLES, parts_of
from analysis.diagnosis.settings import BRIDGED, LEAST_KEPT
from analysis.diagnosis.types import Mask
from analysis.wording import begin_sentence, conjoin
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, runs_of

STILL = 1e-9
"""Range of a signal over its largest magnitude, below which changes are rounding errors."""


@dataclass(frozen=True, slots=True, eq=False)
class PreparedRecordings:
    """The recordings in the form that a diagnosis needs, and remarks on the changes."""

    recordings: tuple[Recording, ...]
    remarks: tuple[str, ...] = ()
    """Sentences for the user on what was changed, and on weaknesses such as few cycles."""


def prepare(
    recordings: Sequence[Recording], names: Sequence[str], plain: bool, short: bool | None = None
) -> PreparedRecordings:
    """The prepared recordings. recordings: alike in channels, units and rate, in the order of names. plain: convert
    them to one motion per force (no model was given). short: few cycles or samples are a remark instead of a refusal;
    None: as plain. Raises NothingToDiagnose for unsuitable recordings."""
    found = [find_segments(each) for each in recordings]
    named_repeats = [(name, text) for name, (_, text) in zip(names, found, strict=True) if text]
    repeats = tuple(text if len(recordings) == 1 else f"{name}: {text}" for name, text in named_repeats)
    read = tuple(each for each, _ in found)
    formed: tuple[Recording, ...] = read
    left_out: tuple[str, ...] = ()
    if plain:
        # Imported here: a given model says which motion each force drives.
        from analysis.diagnosis.first_model.one_motion_per_force import one_motion_per_force

        formed, left_out = one_motion_per_force(read)
    driven, gaps = bridge_gaps(all_as_force_driven(formed), names)
    kept = comparable(driven, names, plain if short is None else short)
    return PreparedRecordings(kept.recordings, (*repeats, *left_out, *gaps, *kept.remarks))


def comparable(recordings: Sequence[Recording], names: Sequence[str], short: bool) -> PreparedRecordings:
    """The last two steps only, for recordings that are prepared already, such as the trials of a session. Raises
    NothingToDiagnose for unsuitable recordings."""
    require_different(recordings, names)
    few = tuple(f"{begin_sentence(problem)}." for problem in require_something(recordings, names, short))
    alike = keep_common_signals(recordings)
    moving = _drop_constant_position(alike.recordings)
    return PreparedRecordings(moving.recordings, (*few, *alike.remarks, *moving.remarks))


def keep_common_signals(recordings: Sequence[Recording]) -> PreparedRecordings:
    """The recordings with their positions and conditions; where these are not the same in all, without them and with a
    remark."""
    alike = _keep_common_conditions(recordings)
    kinds = {None if each.position is None else (each.position.channels, each.position.units) for each in recordings}
    if len(kinds) < 2:
        return alike
    left = _without_position(alike.recordings, "Only some recordings hold the same position channels")
    return replace(left, remarks=(*alike.remarks, *left.remarks))


def _keep_common_conditions(recordings: Sequence[Recording]) -> PreparedRecordings:
    """The recordings with their conditions; where these are not the same in all, without them and with a remark."""
    held = [None if each.condition is None else (each.condition.channels, each.condition.units) for each in recordings]
    if len(set(held)) < 2:
        return PreparedRecordings(tuple(recordings))
    return PreparedRecordings(
        tuple(replace(each, condition=None) for each in recordings),
        (
            "Not all recordings hold the same conditions in the same order: no law with a dependence on them was "
            "tested.",
        ),
    )


def _drop_constant_position(recordings: Sequence[Recording]) -> PreparedRecordings:
    """The recordings, without positions where one never changes: its errors cannot be normalised to its signal."""
    positions = [each.position for each in recordings if each.position is not None]
    if not positions:
        return PreparedRecordings(tuple(recordings))
    samples = np.vstack([each.samples for each in positions])
    known = np.where(np.isfinite(samples), samples, np.nanmedian(samples, axis=0))
    still = np.ptp(known, axis=0) <= STILL * np.abs(known).max(axis=0)
    dead = [name for name, stands in zip(positions[0].channels, still, strict=True) if stands]
    if not dead:
        return PreparedRecordings(tuple(recordings))
    return _without_position(recordings, f"Position {conjoin(dead)} never changes")


def _without_position(recordings: Sequence[Recording], why: str) -> PreparedRecordings:
    """The recordings without positions, and a remark. why: begins the remark."""
    left = tuple(replace(each, position=None) for each in recordings)
    return PreparedRecordings(left, (f"{why}: the position was left out of the comparison.",))


Stretch = tuple[int, int]
"""Start and stop (exclusive) of samples."""


def bridge_gaps(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """The recordings with gaps (NaN) in their commands interpolated or cut out, and a sentence for each that was
    changed. A recording of which less than `LEAST_KEPT` of the known samples would remain is not changed."""
    found = [_bridge_or_cut(recording, name) for recording, name in zip(recordings, names, strict=True)]
    return tuple(each for each, _ in found), tuple(remark for _, remark in found if remark)


def _bridge_or_cut(recording: Recording, name: str) -> tuple[Recording, str]:
    """See `bridge_gaps`. The parts between gaps that were cut out are noted in the recording's meta data."""
    missing: Mask = np.asarray(np.isnan(recording.command.samples).any(axis=1))
    if not missing.any() or missing.all():
        return recording, ""
    gaps = runs_of(missing)
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
            (
                narrow,
                "interpolated linearly, because the command hardly deviates from a straight line over so short a time",
            ),
            (wide, f"cut out, so that {len(parts)} parts are compared separately"),
        )
        if chosen
    ]
    return filled, f"{name} has gaps in the command: {', '.join(texts)}."


def _can_bridge(samples: FloatArray, gap: int) -> bool:
    """Whether a gap of so many samples may be interpolated: straight lines over that length differ from the known
    command by at most `BRIDGED` of its standard deviation (rms)."""
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
    """Samples (n, m) with NaN replaced by linear interpolation, channel by channel."""
    whole, places = np.array(samples), np.arange(len(samples))
    for column in whole.T:
        known = np.isfinite(column)
        if known.any():
            column[:] = np.interp(places, places[known], column[known])
    return whole
