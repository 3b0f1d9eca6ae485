"""Import map from the header of a table, or from names of arrays of equal length, that state quantities and units, as
in `time [s], force [N], displacement_mm`.

`find_header_problems` lists what the names do not determine; without problems, `make_header_map` makes the map and
`describe_header_choices` reports the choices.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from study.importing.array_groups import find_runs
from study.importing.arrays.csv_arrays import FaultyColumn
from study.importing.arrays.mat_arrays import suggest_conversion
from study.importing.arrays.read_arrays import (
    IMPORT_AGAIN,
    WORKBOOK_ENDINGS,
    Array,
    Arrays,
    find_unread_reason,
    read_arrays,
)
from study.importing.imposed_roles import IMPOSED_REMARK, NOT_IMPOSED_REMARK, swap_imposed_roles
from study.importing.map_format.import_map import (
    LONGEST_CHANNEL_NAME,
    ChannelMap,
    ClockMap,
    CsvMap,
    ImportMap,
    PartMap,
)
from study.importing.map_format.map_errors import ImportRefusedError
from study.importing.map_format.signal_words import (
    ParsedName,
    assign_roles,
    is_peak_value,
    list_open_roles,
    may_be_imposed_motion,
    parse_signal_name,
    propose_roles,
    split_unit_at_end,
    strip_units,
)
from study.importing.surplus_arrays import CLOCK_WORDS, LEAST_SAMPLES, find_rates, find_surplus_arrays, read_factor

_TIME_NAME = re.compile(
    rf"((elapsed|running|test|total|relative|absolute|system|sample)[ _]?)?({'|'.join(sorted(CLOCK_WORDS))}|time stamp)"
    r"(_?(s|ms|us))?",
    re.IGNORECASE,
)
"""Name of a time column, with or without a unit."""
_NUMBER_PATTERN = re.compile(r"\d+")
"""A number in a prefix: prefixes that differ only by numbers denote runs of one measurement."""
_MAX_LISTED_NAMES = 3
"""Largest number of names that a message lists. Chosen."""

HOLD_REMARK = (
    "The command is taken to keep each value until the next sample. If it was measured, as by a load cell, it changes "
    'between samples: import by a map with hold = "linear", or it seems to act half a sample late.'
)
"""Remark on what no header says. At 1 kHz, half a sample is 8 degrees at 45 Hz."""


def read_without_map(path: Path) -> Arrays:
    """Read the arrays of a file that no map describes. Raises CannotReadError where it cannot be read, and
    ImportRefusedError for an invalid field in a column whose name states a role, a quantity or a time, or where every
    column has one."""
    arrays = read_arrays(path, CsvMap())
    faulty_names = [name for name, array in arrays.by_name.items() if _find_invalid_field(array)]
    columns = [parse_signal_name(header) for header in arrays.by_name] if faulty_names else []
    for column, role in zip(columns, propose_roles(columns), strict=True):
        is_used = role or column.quantity or _is_time(column) or len(faulty_names) == len(columns)
        if is_used and column.header in faulty_names:
            raise ImportRefusedError(path.name, _find_invalid_field(arrays.by_name[column.header]), IMPORT_AGAIN)
    return arrays


def _find_invalid_field(array: Array) -> str:
    """Find the invalid field of a column, as a clause; empty for a valid column and for any other array."""
    reason = find_unread_reason(array)
    return reason if isinstance(reason, FaultyColumn) else ""


def make_header_map(arrays: Arrays) -> ImportMap | None:
    """Make the import map from the names; None where `find_header_problems` lists any problem."""
    if find_header_problems(arrays):
        return None
    table, prefixes = _select_table(arrays)
    time_columns, columns = _split_time_columns(table)
    clock = (
        ClockMap(time=time_columns[0].header, time_unit=time_columns[0].unit)
        if time_columns
        else ClockMap(rate=_select_rates(arrays)[0])
    )
    roles = swap_imposed_roles(columns, table.by_name, assign_roles(columns) or ())
    channels = tuple(
        ChannelMap(
            role=role,
            name=name,
            value=column.header,
            unit=column.unit,
            quantity="" if column.unit else column.quantity,
        )
        for column, role, name in zip(columns, roles, strip_units(columns), strict=True)
        if role
    )
    parts = tuple(PartMap(prefix=prefix) for prefix in prefixes)
    return ImportMap(channel=channels, device="unknown", title=arrays.path.stem, clock=(clock,), part=parts)


def describe_header_choices(arrays: Arrays, import_map: ImportMap) -> tuple[str, ...]:
    """Describe, in sentences, the channels of a map from `make_header_map`, the omitted arrays, and what the names do
    not determine. arrays: those that the map was made from."""
    table, _ = _select_table(arrays)
    channels_text = ", ".join(f"{channel.name} as {channel.role}" for channel in import_map.channel)
    parts_text = ", ".join(f"'{part.prefix.rstrip('/_')}'" for part in import_map.part)
    notes = [f"Put one after another, as parts of one recording: {parts_text}."] if parts_text else []
    omissions = [f"Left out: '{name}' {reason}." for name, reason in find_surplus_arrays(table).items()]
    rate_name = find_rates(arrays).get(import_map.clock[0].rate, "")
    notes += [f"The sample rate is taken from '{rate_name}'."] if rate_name else []
    single_values = [
        name
        for name, array in arrays.by_name.items()
        if not array.ndim
        and name != rate_name
        and not _find_invalid_field(array)  # a faulty column has a separate remark
    ]
    omissions += [f"Left out: '{name}' is no column." for name in single_values]
    peak_channels = [
        f"'{channel.value}'" for channel in import_map.channel if is_peak_value(_extract_bracketed_unit(channel.value))
    ]
    notes += (
        [f"Rms or peak values by their unit, kept as they are: {', '.join(peak_channels)}."] if peak_channels else []
    )
    return (
        f"Taken from the header: {channels_text}.",
        *notes,
        *omissions,
        *_describe_direction(table, import_map),
        HOLD_REMARK,
    )


def _extract_bracketed_unit(header: str) -> str:
    """Extract the unit in square or round brackets from a header; empty without any."""
    return header.partition("[")[2].removesuffix("]") or header.partition("(")[2].removesuffix(")")


def _describe_direction(table: Arrays, import_map: ImportMap) -> tuple[str, ...]:
    """Describe in a sentence that names do not determine whether force or motion was commanded; empty where they do."""
    _, columns = _split_time_columns(table)
    roles = {channel.value: channel.role for channel in import_map.channel}
    forces = [roles[column.header] for column in columns if column.quantity in ("force", "torque")]
    more_forces = forces.count("command") > list(roles.values()).count("response")
    if not may_be_imposed_motion(columns) and not more_forces:
        return ()
    return (f"{IMPOSED_REMARK if 'response' in forces else NOT_IMPOSED_REMARK}.",)


def _select_table(arrays: Arrays) -> tuple[Arrays, tuple[str, ...]]:
    """Select the columns, without single values, and no prefixes; of several tables of the same form, such as sheets of
    a workbook, the columns of the first under names without its prefix, and the prefixes of all."""
    columns = {name: array for name, array in arrays.by_name.items() if array.ndim}
    groups = find_runs(columns, LEAST_SAMPLES)
    member_count = len(groups.prefixes) * len(groups.names)
    if member_count != len(columns) or not all(prefix.endswith(("/", "__")) for prefix in groups.prefixes):
        return Arrays(arrays.path, columns, arrays.clocks), ()
    first_table = {name: columns[full_name] for name, full_name in groups.names.items()}
    clocks = tuple(name for name, full_name in groups.names.items() if full_name in arrays.clocks)
    return Arrays(arrays.path, first_table, clocks), groups.prefixes


def find_header_problems(arrays: Arrays) -> tuple[str, ...]:
    """Find what the names do not determine, as clauses that name the column; empty if `make_header_map` can make a
    map."""
    if not any(array.dtype.kind in "fiub" and array.ndim for array in arrays.by_name.values()):
        reasons = {name: reason for name, array in arrays.by_name.items() if (reason := find_unread_reason(array))}
        reasons_text = ", ".join(f"'{name}' is {reason}" for name, reason in reasons.items())
        advice = [text for name, reason in reasons.items() if (text := suggest_conversion(name, reason))][:1]
        return ("; ".join((f"it holds no arrays of numbers{f' ({reasons_text})' if reasons_text else ''}", *advice)),)
    table, prefixes = _select_table(arrays)
    if len({_NUMBER_PATTERN.sub("", prefix) for prefix in prefixes}) > 1:
        parts = " and ".join(f"'{prefix.rstrip('/_')}'" for prefix in prefixes[:_MAX_LISTED_NAMES])
        sheet_advice = (
            ", or name its sheet, as in sheet = ... under [csv]" if arrays.path.suffix in WORKBOOK_ENDINGS else ""
        )
        return (
            f"its {len(prefixes)} parts are alike ({parts}), but not numbered as repeats are: keep the [[part]] of one "
            f"in the map{sheet_advice}",
        )
    if len({array.shape for array in table.by_name.values()}) != 1:
        return ("its arrays have several lengths",)
    if next(iter(table.by_name.values())).ndim != 1:
        return ("its arrays are no single columns",)
    time_columns, columns = _split_time_columns(table)
    duplicates = [name for name, count in Counter(column.name for column in columns).items() if count > 1]
    return (
        *_find_first_time_problem(time_columns, columns, arrays),
        *(f"'{column.header}': {column.doubt}" for column in columns if column.doubt),
        *(
            f"nothing says {question}"
            for question in list_open_roles([column for column in columns if not _is_time(column)])
        ),
        *(f"several columns are called '{name}'" for name in duplicates),
        *(
            f"the name '{name}' has {len(name)} characters; that of a channel has up to {LONGEST_CHANNEL_NAME}"
            for name in strip_units(columns)
            if len(name) > LONGEST_CHANNEL_NAME
        ),
    )


def describe_header_problems(arrays: Arrays) -> str:
    """Describe, in clauses, what the names do not determine, and the columns that were left out: their names may."""
    omissions = (note.rstrip(".").replace("Left out", "left out") for note in arrays.notes if "Left out" in note)
    return "; ".join((*find_header_problems(arrays), *omissions))


def _split_time_columns(arrays: Arrays) -> tuple[list[ParsedName], list[ParsedName]]:
    """Split the columns into time columns (with a unit of time, or marked as a clock by the file) and all others, times
    without a unit included. Arrays of `find_surplus_arrays` are left out."""
    surplus = find_surplus_arrays(arrays)
    columns = [parse_signal_name(header) for header in arrays.by_name if header not in surplus]
    time_columns = [
        column
        for column in columns
        if column.header in arrays.clocks or (column.unit and _is_time(column) and column.quantity == "time")
    ]
    return time_columns, [column for column in columns if column not in time_columns]


def _is_time(column: ParsedName) -> bool:
    """Whether a column is named as a time, with or without a unit."""
    return bool(_TIME_NAME.fullmatch(column.name) or _TIME_NAME.fullmatch(split_unit_at_end(column.name)[0]))


def _select_rates(arrays: Arrays) -> list[str]:
    """Select the expressions for the sample rate (Hz): single numbers with a unit of frequency, or else the inverse of
    a step with a unit of time."""
    rate_names = find_rates(arrays)
    rates = [rate for rate, name in rate_names.items() if read_factor(name, "Hz")]
    return rates or [rate for rate, name in rate_names.items() if read_factor(name, "s")]


def _find_first_time_problem(
    time_columns: Sequence[ParsedName], columns: Sequence[ParsedName], arrays: Arrays
) -> Iterator[str]:
    """Find the first problem of the time base, as a clause: time column, its unit, or sample rate missing or
    ambiguous."""
    rate_names, rates = find_rates(arrays), _select_rates(arrays)
    unitless_times = [column.header for column in columns if _is_time(column)]
    if len(time_columns) > 1:
        yield f"which of {' and '.join(repr(column.header) for column in time_columns)} is the time is ambiguous"
    elif unitless_times:
        yield f"'{unitless_times[0]}' does not say in which unit the time is (as in '{unitless_times[0]} [s]')"
    elif len(rates) > 1:
        yield f"which of {' and '.join(map(repr, rates))} is the sample rate is ambiguous"
    elif not time_columns and not rates and rate_names:
        rate, name = next(iter(rate_names.items()))
        unit = "Hz" if rate == name else "s"
        yield f"'{name}' does not say in which unit it is (as in '{name}_{unit}')"
    elif not time_columns and not rates:
        yield "no column is the time (as in 'time [s]'), and no number is the sample rate (as in 'rate_Hz')"
