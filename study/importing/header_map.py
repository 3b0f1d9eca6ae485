"""Make a map from a table's header, or from array names of equal length, if they state quantities and units: `time
[s], force [N], displacement_mm`."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence

from study.importing.arrays.arrays import Arrays
from study.importing.imposed_roles import IMPOSED, NOT_IMPOSED, turn_imposed
from study.importing.map_format.import_map import ChannelMap, ClockMap, ImportMap
from study.importing.map_format.signal_words import (
    ParsedName,
    may_be_imposed,
    name_signal,
    open_roles,
    plain_names,
    roles_of,
)
from study.importing.surplus_arrays import CLOCK_WORDS, surplus_arrays

_TIME = re.compile(rf"({'|'.join(sorted(CLOCK_WORDS))})(_?(s|ms|us))?", re.IGNORECASE)


def header_map(arrays: Arrays) -> ImportMap | None:
    """The map; None if the header does not identify every column, or does not distinguish commands from responses."""
    if header_problems(arrays):
        return None
    times, rest = _columns(arrays)
    clock = ClockMap(time=times[0].header, time_unit=times[0].unit)
    roles = turn_imposed(rest, arrays.by_name, roles_of(rest) or ())
    channels = tuple(
        ChannelMap(
            role=role,
            name=name,
            value=column.header,
            unit=column.unit,
            quantity="" if column.unit else column.quantity,
        )
        for column, role, name in zip(rest, roles, plain_names(rest), strict=True)
        if role
    )
    return ImportMap(channel=channels, device="unknown", title=arrays.path.stem, clock=(clock,))


def direction_notes(arrays: Arrays, wanted: ImportMap) -> tuple[str, ...]:
    """A sentence where names leave open whether the force or the motion was commanded."""
    _, rest = _columns(arrays)
    told = {channel.value: channel.role for channel in wanted.channel}
    forces = [told[column.header] for column in rest if column.quantity in ("force", "torque")]
    more_forces = forces.count("command") > list(told.values()).count("response")
    if not may_be_imposed(rest) and not more_forces:
        return ()
    return (f"{IMPOSED if 'response' in forces else NOT_IMPOSED}.",)


def header_problems(arrays: Arrays) -> tuple[str, ...]:
    """What the names leave open, one clause each with the column; empty if `header_map` gives a map."""
    others = [(name, array) for name, array in arrays.by_name.items() if array.dtype.kind not in "fiub"]
    if len(others) == len(arrays.by_name):
        kinds = ", ".join(
            f"'{name}' is {array.item()}" for name, array in others if array.dtype.kind == "O" and array.item()
        )
        return (f"it holds no arrays of numbers{f' ({kinds})' if kinds else ''}",)
    if len({array.shape for array in arrays.by_name.values()}) != 1:
        return ("its arrays have several lengths",)
    if next(iter(arrays.by_name.values())).ndim != 1:
        return ("its arrays are no single columns",)
    times, rest = _columns(arrays)
    twice = [name for name, count in Counter(column.name for column in rest).items() if count > 1]
    return (
        *_open_time(times, rest),
        *(f"'{column.header}': {column.doubt}" for column in rest if column.doubt),
        *(f"nothing says {what}" for what in open_roles([column for column in rest if not _is_time(column)])),
        *(f"several columns are called '{name}'" for name in twice),
    )


def _columns(arrays: Arrays) -> tuple[list[ParsedName], list[ParsedName]]:
    """Time columns with their unit, and all others; without those that say nothing more."""
    surplus = surplus_arrays(arrays)
    columns = [name_signal(header) for header in arrays.by_name if header not in surplus]
    times = [
        column
        for column in columns
        if column.header in arrays.clocks or (column.unit and _is_time(column) and column.quantity == "time")
    ]
    return times, [column for column in columns if column not in times]


def _is_time(column: ParsedName) -> bool:
    return bool(_TIME.fullmatch(column.name))


def _open_time(times: Sequence[ParsedName], rest: Sequence[ParsedName]) -> Iterator[str]:
    bare = [column.header for column in rest if _is_time(column)]
    if len(times) > 1:
        yield f"which of {' and '.join(repr(column.header) for column in times)} is the time is open"
    elif bare:
        yield f"'{bare[0]}' does not say in which unit the time is (as in '{bare[0]} [s]')"
    elif not times:
        yield "no column is the time (as in 'time [s]')"
