"""Parse the text of a map into an ImportMap, or into a list of all its problems."""

import json
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from protocols.document.schema import Node, Place, describe_allowed, keys_of, node_at, resolve_reference
from protocols.document.validation_messages import key_path, nearest_key, shown
from study.importing.map_format.import_map import ImportMap
from study.store.disk.file_errors import UnusableFileError

KIND = "import map"
"""What messages call a map."""

_ADAPTER: TypeAdapter[ImportMap] = TypeAdapter(ImportMap)
"""Checks a map, and makes its schema."""
MAP_SCHEMA: Node = _ADAPTER.json_schema()
"""JSON Schema of a map: docs/importing.md is made from it."""


def parse_map(text: str, source: Path) -> ImportMap:
    """Parse the text of a map. source: for messages. Raises UnusableFileError with one problem for each key."""
    try:
        values = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        raise UnusableFileError(source, KIND, (f"it is not TOML: {error}",)) from error
    try:
        found = _ADAPTER.validate_json(json.dumps(values, default=str), strict=True)
    except ValidationError as error:
        raise UnusableFileError(source, KIND, tuple(_problems(error.errors()))) from error
    except (ValueError, RecursionError) as error:  # a number of more digits than Python writes
        raise UnusableFileError(source, KIND, (f"it cannot be read: {error}",)) from error
    if problems := (*_contradictions(found), *_segment_contradictions(found), *_meta(found)):
        raise UnusableFileError(source, KIND, problems)
    return found


def is_map(values: dict[str, Any]) -> bool:
    """Whether TOML values are a map: only maps have channels."""
    return isinstance(values.get("channel"), list)


def _problems(errors: Sequence[Any]) -> Iterator[str]:
    for error in errors:
        place: Place = error["loc"]
        if error["type"] == "json_invalid":  # nested too deeply
            yield f"it cannot be read: {error['msg']}"
            continue
        key = key_path(MAP_SCHEMA, place)
        if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
            yield _report_unknown_key(key, place)
        elif error["type"] == "missing":
            yield f"{key} is missing; it is {_describe_allowed(place)}"
        else:
            yield f"{key} is {_show_value(error['input'])}; it must be {_describe_allowed(place)}"


def _report_unknown_key(key: str, place: Place) -> str:
    table = node_at(MAP_SCHEMA, place[:-1])
    known = keys_of(MAP_SCHEMA, table) if table else ()
    meant = nearest_key(str(place[-1]), known)
    return f"{key} is no key of a map" + (f"; did you mean {meant}" if meant else f"; keys here are {', '.join(known)}")


def _show_value(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else shown(value)


def _describe_allowed(place: Place) -> str:
    node = node_at(MAP_SCHEMA, place)
    if node is None:
        parent = resolve_reference(MAP_SCHEMA, node_at(MAP_SCHEMA, place[:-1]) or {})
        return "a number" if parent.get("additionalProperties", {}).get("type") == "number" else "text in quotes"
    return describe_allowed_in_map(node, str(place[-1]))


def describe_allowed_in_map(node: Node, key: str) -> str:
    """Allowed values of a key, in words."""
    whole = resolve_reference(MAP_SCHEMA, node)
    if whole.get("type") == "object" and "properties" not in whole:
        return "a table"
    return describe_allowed(MAP_SCHEMA, node, key)


def _contradictions(found: ImportMap) -> Iterator[str]:
    clocks = [clock.name for clock in found.clock]
    keys = [(entry.role, entry.name) for entry in found.channel]
    keys += [(entry.role, entry.name) for entry in found.computed]
    for role, name in sorted({key for key in keys if keys.count(key) > 1}):
        yield f"{role} '{name}' is defined twice"
    for name in sorted({name for name in clocks if clocks.count(name) > 1}):
        yield f"clock '{name}' is defined twice"
    for channel in found.channel:
        if channel.clock and channel.clock not in clocks:
            yield f"channel '{channel.name}' is on the clock '{channel.clock}', but there are {', '.join(clocks)}"
    yield from _roles(found)
    yield from _check_hold(found)
    yield from _clock_contradictions(found)
    if found.part and any(clock.file for clock in found.clock):
        yield "clocks with `file` put files side by side, [[part]] one after another; a map does one or the other"


def _segment_contradictions(found: ImportMap) -> Iterator[str]:
    for number, segment in enumerate(found.segment, start=1):
        if set(segment.split) - {"fit", "test", ""}:
            yield f"segment[{number}].split names {', '.join(segment.split)}; roles are fit, test, or empty"
        elif segment.split and (segment.role or not 0.999 <= sum(segment.split.values()) <= 1.001):
            yield f"segment[{number}].split must have shares that sum to 1, and must not be combined with `role`"
        if (segment.start and segment.start_s) or (segment.stop and segment.stop_s):
            yield f"segment[{number}] is stated in samples and in seconds; state one of them"


def _meta(found: ImportMap) -> Iterator[str]:
    try:
        json.dumps(found.meta, allow_nan=False)
    except ValueError:
        yield "meta holds a number that is not finite; leave it out, or write it as text"


_FREE = (
    '; for a device that moves freely, write a force of zero for each axis: [[computed]] with role = "command", '
    'name = "none", value = "0 * clock_s", unit = "N" ("N m" for angles)'
)
"""Advice where commands are missing."""


def _roles(found: ImportMap) -> Iterator[str]:
    roles = {channel.role for channel in found.channel} | {channel.role for channel in found.computed}
    for needed in ("command", "response"):
        if needed not in roles:
            free = _FREE if needed == "command" else ""
            yield f"there is no channel with the role '{needed}'; a recording needs both command and response{free}"


_RESAMPLED = {"zero-order": "held", "linear": "linear", "band-limited": "band-limited"}
"""How commands are resampled, by the `hold` of the map."""


def _check_hold(found: ImportMap) -> Iterator[str]:
    """The interpolation of a command between samples is stated in two places, which must agree."""
    for channel in found.channel:
        hold = {"held": "zero-order"}.get(channel.resample, channel.resample)
        if channel.role == "command" and hold and (hold == "zero-order") != (found.hold == "zero-order"):
            yield (
                f"command '{channel.name}' is resampled {channel.resample}, but the recording's hold is {found.hold}; "
                "a command either stays between its samples (held, zero-order) or it does not: "
                f'write hold = "{hold}" at the top of the map, or resample = "{_RESAMPLED[found.hold]}" here'
            )


def _clock_contradictions(found: ImportMap) -> Iterator[str]:
    for clock in found.clock:
        ways = [bool(clock.time), bool(clock.rate_hz), bool(clock.rate), clock.unknown]
        if sum(ways) > 1:
            yield f"clock '{clock.name}' states its time more than once; state one of time, rate_hz, rate, unknown"
        if sum(ways) == 0:
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
        if clock is found.clock[0] and (clock.align or clock.trigger or clock.offset_s):
            yield f"clock '{clock.name}' is the first, to which the others are aligned; it must have no offset"
