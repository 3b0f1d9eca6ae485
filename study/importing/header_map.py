"""Make a map from the header of a table, or from names of arrays of equal length, that state quantities and units, as
in `time [s], force [N], displacement_mm`.

`header_problems` lists what the names leave open; without problems, `header_map` makes the map and `header_notes`
reports the choices.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from study.importing.arrays.array_groups import groups_in
from study.importing.arrays.arrays import MEND, WORKBOOKS, Array, Arrays, left_out, read_arrays
from study.importing.arrays.csv_arrays import FaultyColumn
from study.importing.arrays.mat_arrays import instead
from study.importing.imposed_roles import IMPOSED, NOT_IMPOSED, turn_imposed
from study.importing.map_format.import_map import ChannelMap, ClockMap, CsvMap, ImportMap, PartMap
from study.importing.map_format.map_errors import ImportRefusedError
from study.importing.map_format.signal_words import (
    ParsedName,
    is_peak_value,
    may_be_imposed,
    name_signal,
    open_roles,
    plain_names,
    propose_roles,
    roles_of,
    unit_at_end,
    unit_in,
)
from study.importing.surplus_arrays import CLOCK_WORDS, LEAST_SAMPLES, rates_in, surplus_arrays

_TIME = re.compile(
    rf"((elapsed|running|test|total|relative|absolute|system|sample)[ _]?)?({'|'.join(sorted(CLOCK_WORDS))}|time stamp)"
    r"(_?(s|ms|us))?",
    re.IGNORECASE,
)
"""Name of a time column, with or without a unit."""
_NUMBER = re.compile(r"\d+")
"""A number in a prefix: prefixes that differ only by their numbers are runs of one measurement."""
_NAMED = 3
"""Most names that a message lists."""


def read_without_map(path: Path) -> Arrays:
    """Read the arrays of a file that no map describes. Raises CannotReadError, and ImportRefusedError for an invalid
    field in a column whose name states a role, a quantity or a time, or where every column has one."""
    arrays = read_arrays(path, CsvMap())
    faulty = [name for name, array in arrays.by_name.items() if _find_fault(array)]
    columns = [name_signal(header) for header in arrays.by_name] if faulty else []
    for column, role in zip(columns, propose_roles(columns), strict=True):
        used = role or column.quantity or _is_time(column) or len(faulty) == len(columns)
        if used and column.header in faulty:
            raise ImportRefusedError(path.name, _find_fault(arrays.by_name[column.header]), MEND)
    return arrays


def _find_fault(array: Array) -> str:
    """Problem of a column with an invalid field; empty for all other arrays."""
    reason = left_out(array)
    return reason if isinstance(reason, FaultyColumn) else ""


def header_map(arrays: Arrays) -> ImportMap | None:
    """The map; None where `header_problems` lists any problem."""
    if header_problems(arrays):
        return None
    table, prefixes = _table(arrays)
    times, rest = _columns(table)
    clock = ClockMap(time=times[0].header, time_unit=times[0].unit) if times else ClockMap(rate=_rates(arrays)[0])
    roles = turn_imposed(rest, table.by_name, roles_of(rest) or ())
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
    parts = tuple(PartMap(prefix=prefix) for prefix in prefixes)
    return ImportMap(channel=channels, device="unknown", title=arrays.path.stem, clock=(clock,), part=parts)


def header_notes(arrays: Arrays, wanted: ImportMap) -> tuple[str, ...]:
    """Sentences about what was taken from the header, what was left out, and what the names leave open."""
    table, _ = _table(arrays)
    text = ", ".join(f"{channel.name} as {channel.role}" for channel in wanted.channel)
    parts = ", ".join(f"'{part.prefix.rstrip('/_')}'" for part in wanted.part)
    joined = [f"Put one after another, as parts of one recording: {parts}."] if parts else []
    left_out = [f"Left out: '{name}' {why}." for name, why in surplus_arrays(table).items()]
    rate = rates_in(arrays).get(wanted.clock[0].rate, "")
    joined += [f"The sample rate is taken from '{rate}'."] if rate else []
    others = [
        name
        for name, array in arrays.by_name.items()
        if not array.ndim and name != rate and not _find_fault(array)  # a faulty column has a separate remark
    ]
    left_out += [f"Left out: '{name}' is no column." for name in others]
    peaks = [f"'{channel.value}'" for channel in wanted.channel if is_peak_value(_text_in_brackets(channel.value))]
    joined += [f"Rms or peak values by their unit, kept as they are: {', '.join(peaks)}."] if peaks else []
    return (f"Taken from the header: {text}.", *joined, *left_out, *_direction_notes(table, wanted))


def _text_in_brackets(header: str) -> str:
    """Unit in the brackets of a header, as in the file."""
    return header.partition("[")[2].removesuffix("]") or header.partition("(")[2].removesuffix(")")


def _direction_notes(table: Arrays, wanted: ImportMap) -> tuple[str, ...]:
    """A sentence where names leave open whether the force or the motion was commanded."""
    _, rest = _columns(table)
    roles = {channel.value: channel.role for channel in wanted.channel}
    forces = [roles[column.header] for column in rest if column.quantity in ("force", "torque")]
    more_forces = forces.count("command") > list(roles.values()).count("response")
    if not may_be_imposed(rest) and not more_forces:
        return ()
    return (f"{IMPOSED if 'response' in forces else NOT_IMPOSED}.",)


def _table(arrays: Arrays) -> tuple[Arrays, tuple[str, ...]]:
    """The columns, without single values. Of several tables of the same form, such as sheets of a workbook: the columns
    of the first, and the prefixes of all."""
    columns = {name: array for name, array in arrays.by_name.items() if array.ndim}
    groups = groups_in(columns, LEAST_SAMPLES)
    members = len(groups.prefixes) * len(groups.names)
    if members != len(columns) or not all(prefix.endswith(("/", "__")) for prefix in groups.prefixes):
        return Arrays(arrays.path, columns, arrays.clocks), ()
    first = {name: columns[full] for name, full in groups.names.items()}
    clocks = tuple(name for name, full in groups.names.items() if full in arrays.clocks)
    return Arrays(arrays.path, first, clocks), groups.prefixes


def header_problems(arrays: Arrays) -> tuple[str, ...]:
    """What the names leave open, as clauses that name the column; empty if `header_map` gives a map."""
    if not any(array.dtype.kind in "fiub" and array.ndim for array in arrays.by_name.values()):
        reasons = {name: what for name, array in arrays.by_name.items() if (what := left_out(array))}
        kinds = ", ".join(f"'{name}' is {what}" for name, what in reasons.items())
        mends = [mend for name, what in reasons.items() if (mend := instead(name, what))][:1]
        return ("; ".join((f"it holds no arrays of numbers{f' ({kinds})' if kinds else ''}", *mends)),)
    table, prefixes = _table(arrays)
    if len({_NUMBER.sub("", prefix) for prefix in prefixes}) > 1:
        names = " and ".join(f"'{prefix.rstrip('/_')}'" for prefix in prefixes[:_NAMED])
        sheet = ", or name its sheet, as in sheet = ... under [csv]" if arrays.path.suffix in WORKBOOKS else ""
        return (
            f"its {len(prefixes)} parts are alike ({names}), but not numbered as repeats are: keep the [[part]] of one "
            f"in the map{sheet}",
        )
    if len({array.shape for array in table.by_name.values()}) != 1:
        return ("its arrays have several lengths",)
    if next(iter(table.by_name.values())).ndim != 1:
        return ("its arrays are no single columns",)
    times, rest = _columns(table)
    twice = [name for name, count in Counter(column.name for column in rest).items() if count > 1]
    return (
        *_open_time(times, rest, arrays),
        *(f"'{column.header}': {column.doubt}" for column in rest if column.doubt),
        *(f"nothing says {what}" for what in open_roles([column for column in rest if not _is_time(column)])),
        *(f"several columns are called '{name}'" for name in twice),
    )


def _columns(arrays: Arrays) -> tuple[list[ParsedName], list[ParsedName]]:
    """Time columns with a unit, and all others. Arrays that `surplus_arrays` finds are left out."""
    surplus = surplus_arrays(arrays)
    columns = [name_signal(header) for header in arrays.by_name if header not in surplus]
    times = [
        column
        for column in columns
        if column.header in arrays.clocks or (column.unit and _is_time(column) and column.quantity == "time")
    ]
    return times, [column for column in columns if column not in times]


def _is_time(column: ParsedName) -> bool:
    """Whether a column is named as a time, with or without a unit."""
    return bool(_TIME.fullmatch(column.name) or _TIME.fullmatch(unit_at_end(column.name)[0]))


def _rates(arrays: Arrays) -> list[str]:
    """Expressions for the sample rate (Hz): single numbers in hertz, or else the inverse of a step in seconds."""
    found = rates_in(arrays)
    stated = {rate: unit_in(name)[1] or unit_at_end(name)[1] for rate, name in found.items()}
    rates = [rate for rate, name in found.items() if rate == name and stated[rate] == "Hz"]
    return rates or [rate for rate, name in found.items() if rate != name and stated[rate] == "s"]


def _open_time(times: Sequence[ParsedName], rest: Sequence[ParsedName], arrays: Arrays) -> Iterator[str]:
    """A clause where time column, unit of the time, or sample rate are missing or ambiguous."""
    single, rates = rates_in(arrays), _rates(arrays)
    bare = [column.header for column in rest if _is_time(column)]
    if len(times) > 1:
        yield f"which of {' and '.join(repr(column.header) for column in times)} is the time is ambiguous"
    elif bare:
        yield f"'{bare[0]}' does not say in which unit the time is (as in '{bare[0]} [s]')"
    elif len(rates) > 1:
        yield f"which of {' and '.join(map(repr, rates))} is the sample rate is ambiguous"
    elif not times and not rates and single:
        rate, name = next(iter(single.items()))
        unit = "Hz" if rate == name else "s"
        yield f"'{name}' does not say in which unit it is (as in '{name}_{unit}')"
    elif not times and not rates:
        yield "no column is the time (as in 'time [s]'), and no number is the sample rate (as in 'rate_Hz')"
