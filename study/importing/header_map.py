"""Make a map from the header of a table, or from names of arrays of equal length, that state quantities and units, as
in `time [s], force [N], displacement_mm`.

`find_header_problems` lists what the names leave open; without problems, `make_header_map` makes the map and
`describe_header_choices` reports the choices. Called by `import_recording` and `map_library`.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from study.importing.arrays.array_groups import find_runs
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
from study.importing.map_format.import_map import ChannelMap, ClockMap, CsvMap, ImportMap, PartMap
from study.importing.map_format.map_errors import ImportRefusedError
from study.importing.map_format.signal_words import (
    ParsedName,
    assign_roles,
    is_peak_value,
    list_open_roles,
    may_be_imposed_motion,
    parse_signal_name,
    propose_roles,
    split_bracketed_unit,
    split_unit_at_end,
    strip_units,
)
from study.importing.surplus_arrays import CLOCK_WORDS, LEAST_SAMPLES, find_rates, find_surplus_arrays

_TIME_NAME = re.compile(
    rf"((elapsed|running|test|total|relative|absolute|system|sample)[ _]?)?({'|'.join(sorted(CLOCK_WORDS))}|time stamp)"
    r"(_?(s|ms|us))?",
    re.IGNORECASE,
)
"""Name of a time column, with or without a unit."""
_NUMBER_PATTERN = re.compile(r"\d+")
"""A number in a prefix: prefixes that differ only by their numbers are runs of one measurement."""
_MAX_LISTED_NAMES = 3
"""Most names that a message lists."""


def read_without_map(path: Path) -> Arrays:
    """Read the arrays of a file that no map describes. Raises CannotReadError, and ImportRefusedError for an invalid
    field in a column whose name states a role, a quantity or a time, or where every column has one."""
    arrays = read_arrays(path, CsvMap())
    faulty = [name for name, array in arrays.by_name.items() if _find_fault(array)]
    columns = [parse_signal_name(header) for header in arrays.by_name] if faulty else []
    for column, role in zip(columns, propose_roles(columns), strict=True):
        is_used = role or column.quantity or _is_time(column) or len(faulty) == len(columns)
        if is_used and column.header in faulty:
            raise ImportRefusedError(path.name, _find_fault(arrays.by_name[column.header]), IMPORT_AGAIN)
    return arrays


def _find_fault(array: Array) -> str:
    """Problem of a column with an invalid field; empty for all other arrays."""
    reason = find_unread_reason(array)
    return reason if isinstance(reason, FaultyColumn) else ""


def make_header_map(arrays: Arrays) -> ImportMap | None:
    """Make the import map from the names; None where `find_header_problems` lists any problem."""
    if find_header_problems(arrays):
        return None
    table, prefixes = _select_table(arrays)
    times, columns = _split_columns(table)
    clock = (
        ClockMap(time=times[0].header, time_unit=times[0].unit) if times else ClockMap(rate=_select_rates(arrays)[0])
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
    """Sentences about what was taken from the header, what was left out, and what the names leave open."""
    table, _ = _select_table(arrays)
    channels_text = ", ".join(f"{channel.name} as {channel.role}" for channel in import_map.channel)
    parts = ", ".join(f"'{part.prefix.rstrip('/_')}'" for part in import_map.part)
    notes = [f"Put one after another, as parts of one recording: {parts}."] if parts else []
    omissions = [f"Left out: '{name}' {reason}." for name, reason in find_surplus_arrays(table).items()]
    rate_name = find_rates(arrays).get(import_map.clock[0].rate, "")
    notes += [f"The sample rate is taken from '{rate_name}'."] if rate_name else []
    single_values = [
        name
        for name, array in arrays.by_name.items()
        if not array.ndim and name != rate_name and not _find_fault(array)  # a faulty column has a separate remark
    ]
    omissions += [f"Left out: '{name}' is no column." for name in single_values]
    peak_channels = [
        f"'{channel.value}'" for channel in import_map.channel if is_peak_value(_extract_bracketed_unit(channel.value))
    ]
    notes += (
        [f"Rms or peak values by their unit, kept as they are: {', '.join(peak_channels)}."] if peak_channels else []
    )
    return (f"Taken from the header: {channels_text}.", *notes, *omissions, *_describe_direction(table, import_map))


def _extract_bracketed_unit(header: str) -> str:
    """Unit in the brackets of a header, as in the file."""
    return header.partition("[")[2].removesuffix("]") or header.partition("(")[2].removesuffix(")")


def _describe_direction(table: Arrays, import_map: ImportMap) -> tuple[str, ...]:
    """A sentence where names leave open whether the force or the motion was commanded."""
    _, columns = _split_columns(table)
    roles = {channel.value: channel.role for channel in import_map.channel}
    forces = [roles[column.header] for column in columns if column.quantity in ("force", "torque")]
    more_forces = forces.count("command") > list(roles.values()).count("response")
    if not may_be_imposed_motion(columns) and not more_forces:
        return ()
    return (f"{IMPOSED_REMARK if 'response' in forces else NOT_IMPOSED_REMARK}.",)


def _select_table(arrays: Arrays) -> tuple[Arrays, tuple[str, ...]]:
    """The columns, without single values. Of several tables of the same form, such as sheets of a workbook: the columns
    of the first, and the prefixes of all."""
    columns = {name: array for name, array in arrays.by_name.items() if array.ndim}
    groups = find_runs(columns, LEAST_SAMPLES)
    member_count = len(groups.prefixes) * len(groups.names)
    if member_count != len(columns) or not all(prefix.endswith(("/", "__")) for prefix in groups.prefixes):
        return Arrays(arrays.path, columns, arrays.clocks), ()
    first_table = {name: columns[full_name] for name, full_name in groups.names.items()}
    clocks = tuple(name for name, full_name in groups.names.items() if full_name in arrays.clocks)
    return Arrays(arrays.path, first_table, clocks), groups.prefixes


def find_header_problems(arrays: Arrays) -> tuple[str, ...]:
    """What the names leave open, as clauses that name the column; empty if `make_header_map` makes a map."""
    if not any(array.dtype.kind in "fiub" and array.ndim for array in arrays.by_name.values()):
        reasons = {name: kind for name, array in arrays.by_name.items() if (kind := find_unread_reason(array))}
        kinds = ", ".join(f"'{name}' is {kind}" for name, kind in reasons.items())
        advice = [text for name, kind in reasons.items() if (text := suggest_conversion(name, kind))][:1]
        return ("; ".join((f"it holds no arrays of numbers{f' ({kinds})' if kinds else ''}", *advice)),)
    table, prefixes = _select_table(arrays)
    if len({_NUMBER_PATTERN.sub("", prefix) for prefix in prefixes}) > 1:
        names = " and ".join(f"'{prefix.rstrip('/_')}'" for prefix in prefixes[:_MAX_LISTED_NAMES])
        sheet_advice = (
            ", or name its sheet, as in sheet = ... under [csv]" if arrays.path.suffix in WORKBOOK_ENDINGS else ""
        )
        return (
            f"its {len(prefixes)} parts are alike ({names}), but not numbered as repeats are: keep the [[part]] of one "
            f"in the map{sheet_advice}",
        )
    if len({array.shape for array in table.by_name.values()}) != 1:
        return ("its arrays have several lengths",)
    if next(iter(table.by_name.values())).ndim != 1:
        return ("its arrays are no single columns",)
    times, columns = _split_columns(table)
    duplicates = [name for name, count in Counter(column.name for column in columns).items() if count > 1]
    return (
        *_find_time_problems(times, columns, arrays),
        *(f"'{column.header}': {column.doubt}" for column in columns if column.doubt),
        *(
            f"nothing says {question}"
            for question in list_open_roles([column for column in columns if not _is_time(column)])
        ),
        *(f"several columns are called '{name}'" for name in duplicates),
    )


def _split_columns(arrays: Arrays) -> tuple[list[ParsedName], list[ParsedName]]:
    """Time columns with a unit, and all others. Arrays that `find_surplus_arrays` finds are left out."""
    surplus = find_surplus_arrays(arrays)
    columns = [parse_signal_name(header) for header in arrays.by_name if header not in surplus]
    times = [
        column
        for column in columns
        if column.header in arrays.clocks or (column.unit and _is_time(column) and column.quantity == "time")
    ]
    return times, [column for column in columns if column not in times]


def _is_time(column: ParsedName) -> bool:
    """Whether a column is named as a time, with or without a unit."""
    return bool(_TIME_NAME.fullmatch(column.name) or _TIME_NAME.fullmatch(split_unit_at_end(column.name)[0]))


def _select_rates(arrays: Arrays) -> list[str]:
    """Expressions for the sample rate (Hz): single numbers in hertz, or else the inverse of a step in seconds."""
    rate_names = find_rates(arrays)
    units = {rate: split_bracketed_unit(name)[1] or split_unit_at_end(name)[1] for rate, name in rate_names.items()}
    rates = [rate for rate, name in rate_names.items() if rate == name and units[rate] == "Hz"]
    return rates or [rate for rate, name in rate_names.items() if rate != name and units[rate] == "s"]


def _find_time_problems(times: Sequence[ParsedName], columns: Sequence[ParsedName], arrays: Arrays) -> Iterator[str]:
    """A clause where time column, unit of the time, or sample rate are missing or ambiguous."""
    rate_names, rates = find_rates(arrays), _select_rates(arrays)
    unitless = [column.header for column in columns if _is_time(column)]
    if len(times) > 1:
        yield f"which of {' and '.join(repr(column.header) for column in times)} is the time is ambiguous"
    elif unitless:
        yield f"'{unitless[0]}' does not say in which unit the time is (as in '{unitless[0]} [s]')"
    elif len(rates) > 1:
        yield f"which of {' and '.join(map(repr, rates))} is the sample rate is ambiguous"
    elif not times and not rates and rate_names:
        rate, name = next(iter(rate_names.items()))
        unit = "Hz" if rate == name else "s"
        yield f"'{name}' does not say in which unit it is (as in '{name}_{unit}')"
    elif not times and not rates:
        yield "no column is the time (as in 'time [s]'), and no number is the sample rate (as in 'rate_Hz')"
