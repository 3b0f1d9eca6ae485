"""Make an incomplete import map for a file of which only the arrays are known, to be completed by the user.

Clocks, channels and runs are proposed from names, units, shapes and data; `hold` is a common choice. Other unknown
values are left empty or described in a comment.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile
from textwrap import wrap

from protocols.document.dumping import format_toml_text
from study.importing.array_groups import RunGroups, find_runs
from study.importing.arrays.csv_arrays import FaultyColumn
from study.importing.arrays.mat_arrays import CELL_ENTRY_PREFIX, suggest_conversion
from study.importing.arrays.read_arrays import Array, Arrays, find_unread_reason
from study.importing.expressions.expression import quote_name
from study.importing.imposed_roles import IMPOSED_REMARK, NOT_IMPOSED_REMARK, swap_imposed_roles
from study.importing.map_format.signal_words import (
    may_be_imposed_motion,
    parse_signal_name,
    propose_roles,
    split_bracketed_unit,
)
from study.importing.surplus_arrays import (
    LEAST_SAMPLES,
    find_equal_clocks,
    find_rates,
    find_surplus_arrays,
    has_time_line,
    is_growing_time,
)

_FORCE_QUANTITIES = ("force", "torque")
"""Quantities of forces: in rotation, torques."""
_MAX_LISTED_RUNS = 4
"""Largest number of arrays of further runs that a comment of the map names; dots stand for the rest. Chosen."""
_ROLE_SUFFIX = re.compile(r"(?i)_(test|tst|train|trn|est|estimation|fit|val|vad|valid|validation)(?=_|$)")
"""Parts of a name that state the role of the data, as in `u_test`."""
_CONTROL_CHARACTER = re.compile(r"(?!^\n)[\x00-\x1f\x7f]")
"""A control character of a name in a comment; not the line feed with which a line may begin."""
_TIME_UNITS = ("s", "ms", "us", "min")
"""Units of time stamps, by the last part of a name."""


def make_map_skeleton(arrays: Arrays) -> str:
    """Make the map as TOML text. The device, and an unknown role or unit of time, are empty texts, with which an import
    fails and names the key; an empty unit of a channel stands for a plain number."""
    return "\n".join(_CONTROL_CHARACTER.sub(" ", line) for line in _write_lines(arrays)) + "\n"


def _write_lines(all_arrays: Arrays) -> Iterator[str]:
    """Write the lines of the map: head, clocks, channels, parts, segment."""
    run_groups = find_runs(all_arrays.by_name, LEAST_SAMPLES)
    ungrouped_names = _find_ungrouped_runs(all_arrays, run_groups)
    arrays = _select_first_run(all_arrays, run_groups, ungrouped_names)
    surplus_reasons = find_surplus_arrays(arrays)
    all_clocks = [
        name for name, array in arrays.by_name.items() if name in arrays.clocks or is_growing_time(name, array)
    ]
    kept_clocks = [name for name in all_clocks if name not in surplus_reasons]
    roles = _propose_array_roles(arrays, [*all_clocks, *surplus_reasons])
    yield f"# A map for {arrays.name}. Keys and examples: docs/importing.md."
    yield 'device = ""               # what was recorded'
    yield 'hold = "zero-order"       # how the command moves between samples: zero-order, band-limited, linear'
    yield from _write_clocks(arrays, kept_clocks)
    yield from _write_direction(roles)
    for name, array in arrays.by_name.items():
        clock = _match_clock(name, arrays, all_clocks) if len(kept_clocks) > 1 else ""
        is_numeric = array.dtype.kind in "fiub" and array.size >= LEAST_SAMPLES
        if name in surplus_reasons:
            yield f"\n# {name} {surplus_reasons[name]}"
        elif name in kept_clocks:
            continue
        elif array.ndim == 1 and is_numeric:
            yield from _write_channel(
                (_strip_value_suffix(name), name, _strip_value_suffix(name)),
                _describe_shape(array.shape),
                clock,
                roles.get(name, ""),
            )
        elif array.ndim == 2 and is_numeric:
            yield from _write_table(name, array, clock, roles.get(name, ""))
        else:
            yield from _describe_excluded_array(name, array)
    yield from _write_parts(run_groups.prefixes)
    yield from _write_ungrouped_runs(ungrouped_names, run_groups)
    yield ""
    yield "# Without segments, periods that repeat are found, and a diagnosis is tested on the end of each part."
    yield "# [[segment]]"
    yield '# kind = "noise"          # multisine, sweep, sine, slow, noise, binary, step, impact, free, rest'
    yield "# split = { fit = 0.5, test = 0.5 }"


def _find_ungrouped_runs(all_arrays: Arrays, run_groups: RunGroups) -> list[str]:
    """Find the arrays of runs in cells that belong to no group; empty without any group. Arrays of fewer than
    `LEAST_SAMPLES` hold constants and do not count."""
    long_cell_arrays = [
        name
        for name, array in all_arrays.by_name.items()
        if CELL_ENTRY_PREFIX.match(name) and array.size >= LEAST_SAMPLES
    ]
    return (
        [name for name in long_cell_arrays if not name.startswith(run_groups.prefixes)] if run_groups.prefixes else []
    )


def _select_first_run(all_arrays: Arrays, run_groups: RunGroups, ungrouped_names: Sequence[str]) -> Arrays:
    """Select the arrays of the first of several runs and those that belong to no run, except `ungrouped_names`; the
    times of tables [time, value ...] are added as separate arrays."""
    run_names = (
        [name for name in all_arrays.by_name if name.startswith(run_groups.prefixes)] if run_groups.prefixes else []
    )
    common_arrays = {
        name: array for name, array in all_arrays.by_name.items() if name not in (*run_names, *ungrouped_names)
    }
    first_arrays = {
        **{name: all_arrays.by_name[full_name] for name, full_name in run_groups.names.items()},
        **common_arrays,
    }
    times_by_expression = {
        _format_line_expression(name, array, 0): _select_first_line(array)
        for name, array in first_arrays.items()
        if has_time_line(array)
    }
    return Arrays(all_arrays.path, {**first_arrays, **times_by_expression}, (*all_arrays.clocks, *times_by_expression))


def _match_clock(name: str, arrays: Arrays, clocks: Sequence[str]) -> str:
    """Find the clock with the same number of samples whose name has the longest common prefix; of equal clocks, the one
    that is kept. Empty without a clock of this length."""
    matching_clocks = [
        clock for clock in clocks if len(arrays.by_name[clock]) == max(arrays.by_name[name].shape, default=0)
    ]

    def count_common_letters(clock: str) -> int:
        """Count the letters of the common prefix of the clock's name and the array's."""
        return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(name, clock, strict=False)))

    best_clock = max(matching_clocks, key=count_common_letters, default="")
    return find_equal_clocks(arrays).get(best_clock, best_clock)


def _write_direction(roles: Mapping[str, str]) -> Iterator[str]:
    """Write a comment that says whether the force or the motion is taken for the command; nothing where names and
    quantities determine it."""
    parsed_names = [parse_signal_name(_strip_value_suffix(name)) for name in roles]
    if may_be_imposed_motion(parsed_names):
        force_roles = [
            roles[name]
            for name, parsed_name in zip(roles, parsed_names, strict=True)
            if parsed_name.quantity in _FORCE_QUANTITIES
        ]
        yield from (
            "",
            *wrap(
                IMPOSED_REMARK if "response" in force_roles else NOT_IMPOSED_REMARK,
                110,
                initial_indent="# ",
                subsequent_indent="# ",
            ),
        )


def _describe_excluded_array(name: str, array: Array) -> Iterator[str]:
    """Describe, in a comment, an array that is no channel: invalid, not numeric, constant, of over two dimensions."""
    reason = find_unread_reason(array)
    if isinstance(reason, FaultyColumn):
        yield f"\n# Left out: {reason}"
    elif array.dtype.kind not in "fiub":
        yield f"\n# {name} holds no numbers" + (f": it is {reason}" if reason else "")
        yield from (f"# {advice}" for advice in (suggest_conversion(name, reason),) if advice)
    elif array.size < LEAST_SAMPLES:
        yield f"\n# {name}: {_describe_shape(array.shape)}, a constant for expressions"
    else:
        indices = ", ".join(":" if k == array.shape.index(max(array.shape)) else "0" for k in range(array.ndim))
        yield f"\n# {name}: {_describe_shape(array.shape)}; a channel is one line: {quote_name(name)}[{indices}]"


def _strip_value_suffix(name: str) -> str:
    """Strip the ending of a name under which Simulink stores the values of a signal: `force` for
    `force.signals.values`."""
    for suffix in (".signals.values", ".values", ".Data", ".data"):
        name = name.removesuffix(suffix)
    return name


def _format_line_expression(name: str, array: Array, line_index: int) -> str:
    """Format the expression for a row or column of a table: the line with this index, from 0, along its longer side."""
    return (
        f"{quote_name(name)}[{line_index}]"
        if array.shape[0] < array.shape[1]
        else f"{quote_name(name)}[:, {line_index}]"
    )


def _select_first_line(array: Array) -> Array:
    """Select the first row or column of a table, whichever is longer; the column where both are equal."""
    return array[0] if array.shape[0] < array.shape[1] else array[:, 0]


def _propose_array_roles(arrays: Arrays, excluded_names: list[str]) -> dict[str, str]:
    """Propose roles by the name of the array, where names, units and data determine them. excluded_names: arrays that
    are not channels."""
    channels = [
        name for name, array in arrays.by_name.items() if array.size >= LEAST_SAMPLES and name not in excluded_names
    ]
    columns = [replace(parse_signal_name(_strip_value_suffix(name)), header=name) for name in channels]
    return dict(zip(channels, swap_imposed_roles(columns, arrays.by_name, propose_roles(columns)), strict=True))


def _write_parts(prefixes: tuple[str, ...]) -> Iterator[str]:
    """Write a [[part]] for each run."""
    if prefixes:
        yield "\n# Several runs are in the file: their arrays are named without the prefix above."
    for prefix in prefixes:
        yield "\n[[part]]"
        yield f"prefix = {format_toml_text(prefix)}"


def _write_ungrouped_runs(ungrouped_names: Sequence[str], run_groups: RunGroups) -> Iterator[str]:
    """Write comments on runs in cells of another length, and on how to add the last of them whose names identify the
    arrays."""
    if ungrouped_names:
        names_text = ", ".join(ungrouped_names[:_MAX_LISTED_RUNS]) + (
            " ..." if ungrouped_names[_MAX_LISTED_RUNS:] else ""
        )
        yield f"\n# Also in the file, in cells of another length: {names_text}"
    name_by_stem = {_ROLE_SUFFIX.sub("", name): name for name in run_groups.names if name.isidentifier()}
    definitions_by_run: dict[str, list[str]] = {}
    for prefix, slash, name in (full_name.partition("/") for full_name in ungrouped_names):
        if (stem := _ROLE_SUFFIX.sub("", name)) in name_by_stem:
            definitions_by_run.setdefault(prefix + slash, []).append(
                f"{name_by_stem[stem]} = {format_toml_text(quote_name(name))}"
            )
    for prefix, definitions in list(definitions_by_run.items())[-1:]:
        yield f'# Such a run is added by [[part]] with prefix = "{prefix}" and let = {{ {", ".join(definitions)} }}'


def _write_clocks(arrays: Arrays, clocks: list[str]) -> Iterator[str]:
    """Write a [[clock]] for each time column; without one, a clock with the rate of the file, or with a comment."""
    for name in clocks:
        stem, unit = (
            split_bracketed_unit(name)
            if name in arrays.by_name and parse_signal_name(name).quantity == "time"
            else (name, "")
        )
        suffix = stem.rpartition("_")[2]
        yield "\n[[clock]]"
        if len(clocks) > 1:
            yield f"name = {format_toml_text(name)}"
        yield f"time = {format_toml_text(name)}"
        unit_text = format_toml_text(unit or (suffix if suffix in _TIME_UNITS else ""))
        yield f'time_unit = {unit_text}            # "s", "ms"'
    if clocks:
        return
    yield "\n[[clock]]"
    rates = find_rates(arrays)
    for rate, name in list(rates.items())[:1]:
        remark = f", {name} in seconds" if rate.startswith("1 / ") else ""
        yield f"rate = {format_toml_text(rate)}           # in hertz{remark}"
    if not rates:
        yield "# rate_hz = 1000, or unknown = true"


def _write_table(name: str, array: Array, clock: str, role: str) -> Iterator[str]:
    """Write a channel per line of a table, except its line of times; a table [time, value] gives one channel, with the
    name and role of the table."""
    has_time = has_time_line(array)
    for line_index in range(int(has_time), min(array.shape)):
        is_single = has_time and min(array.shape) == 2
        channel_name = name if is_single else f"{name}{line_index + (not has_time)}"
        yield from _write_channel(
            (channel_name, _format_line_expression(name, array, line_index), name),
            _describe_shape(array.shape),
            clock if has_time else "",
            role if is_single else "",
        )


def _write_channel(names: tuple[str, str, str], shape: str, clock: str, role: str) -> Iterator[str]:
    """Write a [[channel]]. names: of the channel, of its value (an expression), and of the array."""
    name, value, header = names
    parsed_name = parse_signal_name(header)
    yield ""
    yield f"[[channel]]               # {header}: {shape}"
    yield f"role = {format_toml_text(role):20s} # command, response, position, excitation, condition, helper"
    yield f"name = {format_toml_text(parsed_name.name if name == header else name)}"
    yield f"value = {format_toml_text(value)}"
    unit, doubt = parsed_name.unit, f"{parsed_name.doubt}; " if parsed_name.doubt else ""
    unit_text = format_toml_text(unit)
    yield f'unit = {unit_text:20s} # {doubt}as in the file: "N", "m/s^2", "deg", "in", "V"; empty = not known'
    if clock:
        yield f"clock = {format_toml_text(clock)}"


def _describe_shape(shape: tuple[int, ...]) -> str:
    """Describe the shape of an array in words."""
    return f"{' x '.join(str(count) for count in shape)} samples" if shape else "one number"
