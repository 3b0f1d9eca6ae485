"""Parse the TOML text of an import map into an `ImportMap` (`parse_map`), or report its problems.

Steps: TOML syntax, keys and types (pydantic), then contradictions between keys; only the problems of the first step
that fails are reported. docs/importing.md is made from `MAP_SCHEMA`."""

import json
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from protocols.document.schema import Node, ValuePath, describe_allowed, find_node, list_keys, resolve_reference
from protocols.document.validation_messages import describe_value, find_nearest_key, format_key_path
from study.importing.map_format.import_map import ImportMap
from study.store.disk.file_errors import UnusableFileError

KIND = "import map"
"""Kind of the document, for messages."""

_ADAPTER: TypeAdapter[ImportMap] = TypeAdapter(ImportMap)
"""Validator of a map."""
MAP_SCHEMA: Node = _ADAPTER.json_schema()
"""JSON Schema of a map."""


def parse_map(text: str, source: Path) -> ImportMap:
    """Parse the text of a map. source: its path, for messages. Raises UnusableFileError with a clause for each
    problem."""
    try:
        values = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        raise UnusableFileError(source, KIND, (f"it is not TOML: {error}",)) from error
    try:
        import_map = _ADAPTER.validate_json(json.dumps(values, default=str), strict=True)
    except ValidationError as error:
        raise UnusableFileError(source, KIND, tuple(_describe_errors(error.errors()))) from error
    except (ValueError, RecursionError) as error:  # an integer with more digits than Python converts to text
        raise UnusableFileError(source, KIND, (f"it cannot be read: {error}",)) from error
    if problems := (
        *_find_contradictions(import_map),
        *_find_segment_contradictions(import_map),
        *_find_meta_problems(import_map),
    ):
        raise UnusableFileError(source, KIND, problems)
    return import_map


def is_map(values: dict[str, Any]) -> bool:
    """Whether TOML values declare an import map: they have a list `channel`."""
    return isinstance(values.get("channel"), list)


def _describe_errors(errors: Sequence[Any]) -> Iterator[str]:
    """Describe each validation error of pydantic (`ValidationError.errors()`) in a clause."""
    for error in errors:
        location: ValuePath = error["loc"]
        if error["type"] == "json_invalid":  # such as one that is nested too deeply
            yield f"it cannot be read: {error['msg']}"
            continue
        key = format_key_path(MAP_SCHEMA, location)
        if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
            yield _describe_unknown_key(key, location)
        elif error["type"] == "missing":
            yield f"{key} is missing; it is {_describe_allowed(location)}"
        else:
            yield f"{key} is {_quote_value(error['input'])}; it must be {_describe_allowed(location)}"


def _describe_unknown_key(key: str, location: ValuePath) -> str:
    """Describe an unknown key in a clause, with the most similar known key or else all known keys of its table."""
    table = find_node(MAP_SCHEMA, location[:-1])
    known_keys = list_keys(MAP_SCHEMA, table) if table else ()
    nearest_key = find_nearest_key(str(location[-1]), known_keys)
    return f"{key} is no key of a map" + (
        f"; did you mean {nearest_key}" if nearest_key else f"; keys here are {', '.join(known_keys)}"
    )


def _quote_value(value: Any) -> str:
    """Format a value for a message; text in quotes."""
    return f'"{value}"' if isinstance(value, str) else describe_value(value)


def _describe_allowed(location: ValuePath) -> str:
    """Describe the allowed values of a key in words; for an entry of a free table, those of its entries."""
    node = find_node(MAP_SCHEMA, location)
    if node is None:
        parent = resolve_reference(MAP_SCHEMA, find_node(MAP_SCHEMA, location[:-1]) or {})
        return "a number" if parent.get("additionalProperties", {}).get("type") == "number" else "text in quotes"
    return describe_allowed_in_map(node, str(location[-1]))


def describe_allowed_in_map(node: Node, key: str) -> str:
    """Describe in words the values that the node of a key allows. key: its name, whose suffix determines the unit."""
    resolved = resolve_reference(MAP_SCHEMA, node)
    if resolved.get("type") == "object" and "properties" not in resolved:
        return "a table"
    return describe_allowed(MAP_SCHEMA, node, key)


def _find_contradictions(import_map: ImportMap) -> Iterator[str]:
    """Find contradictions among channels, clocks and parts; yields a clause for each."""
    clock_names = [clock.name for clock in import_map.clock]
    channel_keys = [(entry.role, entry.name) for entry in import_map.channel]
    channel_keys += [(entry.role, entry.name) for entry in import_map.computed]
    for role, name in sorted({channel_key for channel_key in channel_keys if channel_keys.count(channel_key) > 1}):
        yield f"{role} '{name}' is defined twice"
    for name in sorted({name for name in clock_names if clock_names.count(name) > 1}):
        yield f"clock '{name}' is defined twice"
    for channel in import_map.channel:
        if channel.clock and channel.clock not in clock_names:
            yield f"channel '{channel.name}' is on the clock '{channel.clock}', but there are {', '.join(clock_names)}"
    yield from _find_missing_roles(import_map)
    yield from _find_hold_contradictions(import_map)
    yield from _find_clock_contradictions(import_map)
    if len(import_map.csv.delimiter) > 1:
        yield f"csv.delimiter is '{import_map.csv.delimiter}'; it must be a single character"
    if import_map.part and any(clock.file for clock in import_map.clock):
        yield "clocks with `file` put files side by side, [[part]] one after another; a map does one or the other"


def _find_segment_contradictions(import_map: ImportMap) -> Iterator[str]:
    """Find invalid splits (shares, none below 0, must sum to 1 within 0.001, for rounded fractions) and limits that are
    stated both in samples and in seconds; yields a clause for each. A limit of 0 counts as not stated."""
    for number, segment in enumerate(import_map.segment, start=1):
        if set(segment.split) - {"fit", "test", ""}:
            yield f"segment[{number}].split names {', '.join(segment.split)}; roles are fit, test, or empty"
        elif (shares := segment.split.values()) and (
            segment.role or min(shares) < 0 or not 0.999 <= sum(shares) <= 1.001
        ):
            yield (
                f"segment[{number}].split must have shares that sum to 1, none below 0, and must not be combined with "
                "`role`"
            )
        if (segment.start and segment.start_s) or (segment.stop and segment.stop_s):
            yield f"segment[{number}] is stated in samples and in seconds; state one of them"


_SET_META_KEYS = ("title", "parts", "import", "provenance")
"""Keys of the metadata that the import sets."""
_SET_PART_KEYS = ("file", "prefix", "start", "stop", "clock_start_s", "clock_offsets_s")
"""Keys of the metadata of a part that the import sets."""


def _find_meta_problems(import_map: ImportMap) -> Iterator[str]:
    """Find names that the import gives to values of its own, which would replace those of the map, and numbers in the
    metadata that JSON cannot hold (NaN, infinity); yields a clause for each name, and at most one for the numbers."""
    has_time = bool(import_map.clock[0].time) or any(clock.unknown for clock in import_map.clock)
    for key in (*_SET_META_KEYS, *(("time",) if has_time else ())):
        if key in import_map.meta:
            advice = "write it at the top of the map" if key == "title" else "give it another name"
            yield f"meta.{key} is set by the import; {advice}"
    for key in _SET_PART_KEYS:
        if key in import_map.numbers:
            yield f"numbers.{key} is set by the import; give it another name"
    try:
        json.dumps(import_map.meta, allow_nan=False)
    except ValueError:
        yield "meta holds a number that is not finite; leave it out, or write it as text"


_FREE_MOTION_ADVICE = (
    '; for a device that moves freely, write a force of zero for each axis: [[computed]] with role = "command", '
    'name = "none", value = "0 * clock_s", unit = "N" ("N m" for angles)'
)
"""Advice where commands are missing."""


def _find_missing_roles(import_map: ImportMap) -> Iterator[str]:
    """Find the roles, command and response, that no channel has; yields a clause for each."""
    roles = {channel.role for channel in import_map.channel} | {channel.role for channel in import_map.computed}
    for role in ("command", "response"):
        if role not in roles:
            advice = _FREE_MOTION_ADVICE if role == "command" else ""
            yield f"there is no channel with the role '{role}'; a recording needs both command and response{advice}"


_RESAMPLE_BY_HOLD = {"zero-order": "held", "linear": "linear", "band-limited": "band-limited"}
"""Value of `resample` of a command that agrees with the `hold` of the map, by `hold`."""


def _find_hold_contradictions(import_map: ImportMap) -> Iterator[str]:
    """Find commands with a stated `resample` of which either this or the `hold` of the recording, but not both, keeps
    values constant between samples; yields a clause for each."""
    for channel in import_map.channel:
        resample_hold = {"held": "zero-order"}.get(channel.resample, channel.resample)
        if (
            channel.role == "command"
            and resample_hold
            and (resample_hold == "zero-order") != (import_map.hold == "zero-order")
        ):
            yield (
                f"command '{channel.name}' is resampled {channel.resample}, but the recording's hold is "
                f"{import_map.hold}; a command either stays between its samples (held, zero-order) or it does not: "
                f'write hold = "{resample_hold}" at the top of the map, or '
                f'resample = "{_RESAMPLE_BY_HOLD[import_map.hold]}" here'
            )


def _find_clock_contradictions(import_map: ImportMap) -> Iterator[str]:
    """Find clocks with no time, or with several or incomplete statements of time or alignment; yields a clause for
    each. The first clock must have no alignment, because the others are aligned to it."""
    for clock in import_map.clock:
        statements = [bool(clock.time), bool(clock.rate_hz), bool(clock.rate), clock.unknown]
        if sum(statements) > 1:
            yield f"clock '{clock.name}' states its time more than once; state one of time, rate_hz, rate, unknown"
        if sum(statements) == 0:
            yield (
                f"clock '{clock.name}' has no rate: give its rate_hz, its rate as an expression, or its time stamps; "
                "where no time is known, unknown = true"
            )
        if clock.time and not clock.time_unit.strip():
            yield f"clock '{clock.name}' has no time_unit; stamps need their unit, as in time_unit = \"s\""
        if bool(clock.align) != bool(clock.align_to):
            yield f"clock '{clock.name}' needs both align and align_to, or neither"
        if bool(clock.trigger) != bool(clock.reference_trigger):
            yield f"clock '{clock.name}' needs both trigger and reference_trigger, or neither"
        if clock.align and clock.trigger:
            yield f"clock '{clock.name}' is aligned twice, by a trigger and by correlation; choose one of them"
        if clock is import_map.clock[0] and (clock.align or clock.trigger or clock.offset_s):
            yield f"clock '{clock.name}' is the first, to which the others are aligned; it must have no offset"
