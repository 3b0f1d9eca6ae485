"""Remarks on a map, for the report of an import: what cannot be verified (`list_unit_remarks`), what names in the file
contradict (`list_name_remarks`), and segments that no part has (`list_unused_segments`)."""

from collections.abc import Iterator, Sequence

from equalizer.signals.units import NO_UNIT, UnknownUnitError, parse_unit
from study.importing.expressions.namespace import Namespace
from study.importing.map_format.import_map import ChannelMap, ClockMap, ComputedMap, ImportMap
from study.importing.map_format.map_segments import is_segment_of
from study.importing.map_format.signal_words import parse_signal_name
from study.importing.time_base import PLACEHOLDER_RATE_HZ


def list_unit_remarks(import_map: ImportMap) -> Iterator[str]:
    """List remarks on what cannot be verified: units of computed channels, channels without a unit, an unknown time."""
    for computed in (entry for entry in import_map.computed if entry.role != "helper"):
        yield f"Computed: {computed.role} '{computed.name}' = {computed.value}, in {computed.unit.strip() or NO_UNIT}."
    channels: tuple[ChannelMap | ComputedMap, ...] = (*import_map.channel, *import_map.computed)
    unitless = [
        f"{entry.role} '{entry.name}'" for entry in channels if entry.role != "helper" and not entry.unit.strip()
    ]
    if unitless:
        yield f"No unit is stated for {', '.join(unitless)}: the numbers are kept as they are (unit {NO_UNIT})."
    if any(clock.unknown for clock in import_map.clock):
        yield f"No time is known: samples are numbered, at {PLACEHOLDER_RATE_HZ:g} Hz."


def list_unused_segments(import_map: ImportMap, parts: Sequence[tuple[str, str]]) -> Iterator[str]:
    """List a sentence for each segment of a map of a single recording whose patterns no part matches. parts: file name
    and prefix of each part."""
    for number, segment in enumerate(import_map.segment, start=1):
        if not import_map.separate and not any(is_segment_of(segment, part) for part in parts):
            pattern = segment.file if segment.prefix == "*" else f"{segment.file} {segment.prefix}"
            yield f"segment[{number}] is not used: no part matches '{pattern}'."


def list_name_remarks(import_map: ImportMap, clock: ClockMap, namespace: Namespace) -> Iterator[str]:
    """List a sentence for each array whose name in the file states another unit than the map does for the time stamps
    or a channel of this clock, and for each definition with the name of an array. namespace: the arrays of the clock's
    file, as they were read. The file is not named, so that the sentence is the same for all parts."""
    for name in namespace.definitions:
        if name in namespace.arrays:
            yield f"[let] {name} is not used: the file has an array of this name, which has precedence."
    is_first = clock is import_map.clock[0]
    channels = [
        channel for channel in import_map.channel if channel.clock == clock.name or (is_first and not channel.clock)
    ]
    values_and_units = [(clock.time, clock.time_unit), *((channel.value, channel.unit) for channel in channels)]
    for value, unit in dict.fromkeys(values_and_units):
        if header := _find_contradicting_name(value, unit, namespace):
            stated_unit = parse_signal_name(header).unit
            yield f"'{header}' states {stated_unit}, but the map {unit}; the map was followed."


def _find_contradicting_name(value: str, unit: str, namespace: Namespace) -> str:
    """Find the name in the file of the array `value` that states another unit; empty if there is none, if the map
    states no unit, or for an expression."""
    array = namespace.arrays.get(value)
    names = [name for name, other_array in namespace.arrays.items() if array is not None and other_array is array]
    for parsed_name in map(parse_signal_name, names):
        try:
            if unit.strip() and parsed_name.is_certain and parse_unit(parsed_name.unit) != parse_unit(unit):
                return parsed_name.header
        except UnknownUnitError:  # none in the name; that of the map is reported elsewhere
            continue
    return ""
