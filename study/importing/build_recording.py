"""Build one recording in SI units from files and a map, with a report of every conversion.

For each part (one file, or one run in it): arrays are read, the clocks of its loggers aligned, and its channels put
onto one time grid (`resample_part`). The parts are then concatenated and converted to SI units; where the map states no
segments, they are found if the excitation repeats. Begin at `build_recording`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.diagnosis.data.find_segments import find_segments
from analysis.look.clock import describe_implausible_rate
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.recording_checks import check_recording, find_duplicates
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.units import NO_UNIT, UnknownUnitError, check_quantity, find_quantity, parse_unit
from study.importing.alignment import Logger, align_signals
from study.importing.arrays.read_arrays import Arrays, read_arrays
from study.importing.expressions.budget import Budget
from study.importing.expressions.namespace import make_namespace
from study.importing.map_format.import_map import ChannelMap, ComputedMap, ImportMap
from study.importing.map_format.map_errors import ImportProblemError, ImportRefusedError
from study.importing.map_format.map_files import PartFiles, assign_files
from study.importing.map_format.map_segments import place_segments
from study.importing.map_remarks import list_name_remarks, list_unit_remarks, list_unused_segments
from study.importing.part_signals import ChannelKey, PartSignals, resample_part
from study.importing.time_base import drop_doubled_rows, make_time_base

_MAX_LISTED_PARTS = 3
"""Largest number of parts that a sentence names. Chosen."""


class ImportNotes:
    """Sentences about an import, each reported once: a sentence that holds for all parts is not repeated for each."""

    def __init__(self) -> None:
        self._parts_by_sentence: dict[str, list[str]] = {}

    def add(self, part: str, sentence: str) -> None:
        """Add a sentence about a part, by its label; a repeated sentence counts once."""
        parts = self._parts_by_sentence.setdefault(sentence, [])
        if part not in parts:  # channels of the same name, with several roles
            parts.append(part)

    def list_sentences(self, all_parts: Sequence[str]) -> tuple[str, ...]:
        """List all sentences; one that does not hold for all parts begins with its parts. all_parts: labels of all
        parts."""
        return tuple(
            sentence if len(parts) == len(all_parts) else f"{_abbreviate_list(parts)}: {sentence}"
            for sentence, parts in self._parts_by_sentence.items()
        )


def _abbreviate_list(part_labels: Sequence[str]) -> str:
    """Join the first parts, and the number of further ones."""
    listed_parts = ", ".join(part_labels[:_MAX_LISTED_PARTS])
    return listed_parts + (
        f" and {len(part_labels) - _MAX_LISTED_PARTS} more" if len(part_labels) > _MAX_LISTED_PARTS else ""
    )


@dataclass(frozen=True, slots=True, eq=False)
class BuiltRecording:
    """A recording built from imported files, in memory."""

    recording: Recording
    notes: tuple[str, ...]
    """Sentences: how signals were resampled, which clock was shifted, which samples are missing."""


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """Signals of one part, and the facts about it for the metadata of the recording."""

    signals: PartSignals
    facts: dict[str, Any]
    """File, prefix, start (s) and clock offsets (s) of the part, and the numbers of the map."""


def build_recording(
    import_map: ImportMap, files: Sequence[Path], on_progress: Callable[[float], None] = lambda share: None
) -> BuiltRecording:
    """Build the recording: read, align, resample and convert. on_progress: called with the fraction done, 0 to 1.
    Raises CannotReadError; ImportRefusedError where map and files do not agree or the recording is invalid."""
    subject = files[0].name if len(files) == 1 else f"{files[0].name} with {len(files) - 1} more"
    import_notes = ImportNotes()
    try:
        units = _parse_units(import_map)
        planned_parts = assign_files(import_map, files)
        step_count = len(planned_parts) * (len(import_map.channel) + len(import_map.computed))
        parts = []
        budget = Budget()
        for number, part in enumerate(planned_parts):
            counter = _ProgressCounter(number * step_count / len(planned_parts), step_count, on_progress)
            parts.append(_build_part(import_map, part, import_notes, counter, budget))
        recording, repetition_remark = find_segments(_concatenate(import_map, parts, units))
    except ImportProblemError as error:
        raise ImportRefusedError(subject, str(error)) from error
    if problems := check_recording(recording):
        raise ImportRefusedError(subject, "; ".join(problems))
    labels = [part.label for part in planned_parts]
    notes = import_notes.list_sentences(labels)
    measured_roles = ("command", "response")
    samples = [[part.signals.columns[key] for key in units if key[0] in measured_roles] for part in parts]
    return BuiltRecording(
        recording,
        (
            *notes,
            *list_unit_remarks(import_map),
            *list_unused_segments(import_map, [(part.file.name, part.part.prefix) for part in planned_parts]),
            *(f"{duplicate}." for duplicate in find_duplicates(samples, labels)),
            *filter(None, (_describe_rate_problem(recording), repetition_remark)),
        ),
    )


class _ProgressCounter:
    """Progress of the import: number of finished channels of all parts, out of all."""

    def __init__(self, done_count: float, step_count: int, on_progress: Callable[[float], None]) -> None:
        self.done_count = done_count
        self.step_count = step_count
        self.on_progress = on_progress

    def count_step(self) -> None:
        """Count a channel as done, and report the fraction of all."""
        self.done_count += 1
        self.on_progress(min(1.0, self.done_count / self.step_count))


def _build_part(
    import_map: ImportMap, files: PartFiles, import_notes: ImportNotes, counter: _ProgressCounter, budget: Budget
) -> _Part:
    """Read one part, and put its channels onto its time grid. Raises ImportProblemError, ImportRefusedError,
    CannotReadError."""
    arrays_by_path: dict[Path, Arrays] = {}
    loggers = []
    notes: list[str] = []
    for clock in import_map.clock:
        path = files.by_clock[clock.name]
        arrays_by_path[path] = arrays_by_path.get(path) or read_arrays(path, import_map.csv)
        namespace = make_namespace(
            arrays_by_path[path], {**import_map.let, **files.part.let}, files.part.prefix, budget
        )
        reduced_namespace, remark = drop_doubled_rows(clock, namespace)
        notes += [*list_name_remarks(import_map, clock, namespace), *filter(None, (remark,))]
        loggers.append(Logger(clock, reduced_namespace, make_time_base(clock, reduced_namespace)))

    def report_sentence(sentence: str) -> None:
        """Add a sentence about this part to the notes."""
        import_notes.add(files.label, sentence)

    for note in dict.fromkeys((*(note for arrays in arrays_by_path.values() for note in arrays.notes), *notes)):
        report_sentence(note)
    aligned_loggers = align_signals(tuple(loggers), report_sentence)
    signals = resample_part(import_map, files.part, aligned_loggers, report_sentence, counter.count_step)
    map_numbers = {name: aligned_loggers[0].namespace.compute_number(text) for name, text in import_map.numbers.items()}
    facts = {"file": files.file.name, "prefix": files.part.prefix, "clock_start_s": signals.grid.start_s, **map_numbers}
    offsets = {logger.clock.name: logger.base.offset_s for logger in aligned_loggers[1:]}
    return _Part(signals, {**facts, **({"clock_offsets_s": offsets} if offsets else {})})


@dataclass(frozen=True, slots=True)
class _ChannelUnit:
    """Conversion of a channel to SI: value * factor + offset, in the unit `si`; and its quantity."""

    si: str
    factor: float
    offset: float
    quantity: str


def _parse_units(import_map: ImportMap) -> dict[ChannelKey, _ChannelUnit]:
    """Parse the units of all channels; helpers are not written and need none. Raises ImportProblemError."""
    channels: tuple[ChannelMap | ComputedMap, ...] = (*import_map.channel, *import_map.computed)
    return {
        (channel.role, channel.name): _parse_channel_unit(channel) for channel in channels if channel.role != "helper"
    }


def _parse_channel_unit(channel: ChannelMap | ComputedMap) -> _ChannelUnit:
    """Parse the unit of one channel. Raises ImportProblemError where it is unknown or does not fit the quantity."""
    try:
        unit = parse_unit(channel.unit.strip() or NO_UNIT)
        check_quantity(channel.quantity, unit)
    except UnknownUnitError as error:
        raise ImportProblemError(f"channel '{channel.name}': {error}") from error
    return _ChannelUnit(unit.si, unit.factor, unit.offset, channel.quantity or find_quantity(unit.si))


def _concatenate(import_map: ImportMap, parts: Sequence[_Part], units: dict[ChannelKey, _ChannelUnit]) -> Recording:
    """Concatenate the parts to one recording. Raises ImportProblemError for different rates, or without command
    or response."""
    _require_one_rate(parts)
    command = _join_signal("command", import_map, parts, units)
    response = _join_signal("response", import_map, parts, units)
    if command is None or response is None:
        raise ImportProblemError("a recording needs both a command and a response")
    part_facts, segments = _collect_facts_and_segments(import_map, parts, units)
    return Recording(
        device=import_map.device,
        command=command,
        response=response,
        position=_join_signal("position", import_map, parts, units),
        excitation=_join_signal("excitation", import_map, parts, units),
        condition=_join_signal("condition", import_map, parts, units),
        hold=Hold(import_map.hold),
        segments=segments,
        meta={**import_map.meta, **_describe_time_origin(import_map), "title": import_map.title, "parts": part_facts},
    )


def _describe_rate_problem(recording: Recording) -> str:
    """Describe an implausible sample rate in a sentence; empty for a plausible or unknown one."""
    return "" if recording.meta.get("time") == "unknown" else describe_implausible_rate(recording.sample_rate_hz)


def _describe_time_origin(import_map: ImportMap) -> dict[str, str]:
    """Describe the origin of the times, for the metadata: `unknown`, `stamps`, or nothing for a stated rate."""
    if any(clock.unknown for clock in import_map.clock):
        return {"time": "unknown"}
    return {"time": "stamps"} if import_map.clock[0].time else {}


def _require_one_rate(parts: Sequence[_Part]) -> None:
    """Raise ImportProblemError where parts have different sample rates."""
    first_part = parts[0]
    for part in parts[1:]:
        if part.signals.grid.rate_hz != first_part.signals.grid.rate_hz:
            raise ImportProblemError(
                f"{part.facts['file']} is at {part.signals.grid.rate_hz:g} Hz, but {first_part.facts['file']} at "
                f"{first_part.signals.grid.rate_hz:g} Hz; state the rate_hz of the recording, and resample of each "
                "channel"
            )


def _join_signal(
    role: str, import_map: ImportMap, parts: Sequence[_Part], units: dict[ChannelKey, _ChannelUnit]
) -> Signal | None:
    """Join all channels of a role in SI units, with parts concatenated; None without a channel of the role."""
    channels: tuple[ChannelMap | ComputedMap, ...] = (*import_map.channel, *import_map.computed)
    names = tuple(channel.name for channel in channels if channel.role == role)
    if not names:
        return None
    channel_units = [units[role, name] for name in names]
    columns = [
        np.concatenate([part.signals.columns[role, name] for part in parts]) * unit.factor + unit.offset
        for name, unit in zip(names, channel_units, strict=True)
    ]
    return Signal(
        samples=np.column_stack(columns),
        sample_rate_hz=parts[0].signals.grid.rate_hz,
        quantity=tuple(unit.quantity for unit in channel_units),
        unit=tuple(unit.si for unit in channel_units),
        channels=names,
    )


def _collect_facts_and_segments(
    import_map: ImportMap, parts: Sequence[_Part], units: dict[ChannelKey, _ChannelUnit]
) -> tuple[list[dict[str, Any]], tuple[Segment, ...]]:
    """Collect the facts of each part with its range of samples, and the segments of all parts by samples of the
    recording. Amplitudes are converted to SI. Raises ImportProblemError for an amplitude where commands have different
    factors."""
    channels: tuple[ChannelMap | ComputedMap, ...] = (*import_map.channel, *import_map.computed)
    commands = [(channel.role, channel.name) for channel in channels if channel.role == "command"]
    factors = {units[key].factor for key in commands}
    if len(factors) > 1 and any(segment.amplitude > 0 for segment in import_map.segment):
        raise ImportProblemError(
            "a segment states its amplitude, but the commands have units of different size; leave amplitude out, so "
            "that it is measured, or give the commands in SI units"
        )
    common_factor = factors.pop() if len(factors) == 1 else 1.0
    part_facts, segments, start = [], [], 0
    for part in parts:
        grid = part.signals.grid
        command: FloatArray = np.column_stack(
            [part.signals.columns[key] * (units[key].factor / common_factor) for key in commands]
        )
        label = (str(part.facts["file"]), str(part.facts["prefix"]))
        for segment in place_segments(import_map.segment, label, command, grid.rate_hz):
            shifted_segment = replace(segment, start=segment.start + start, stop=segment.stop + start)
            segments.append(replace(shifted_segment, amplitude=segment.amplitude * common_factor))
        part_facts.append({**part.facts, "start": start, "stop": start + grid.count})
        start += grid.count
    return part_facts, tuple(segments)
