"""Make an incomplete map for a file of which only the arrays are known, to be completed by the owner of the file.

Clocks, channels and runs are proposed from names, units, shapes and data. What is not known is left empty or described
in a comment.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile
from textwrap import wrap

from study.importing.arrays.array_groups import Groups, groups_in
from study.importing.arrays.arrays import Array, Arrays, left_out
from study.importing.arrays.csv_arrays import FaultyColumn
from study.importing.arrays.mat_arrays import OF_CELL, instead
from study.importing.imposed_roles import IMPOSED, NOT_IMPOSED, turn_imposed
from study.importing.map_format.signal_words import may_be_imposed, name_signal, propose_roles, unit_in
from study.importing.surplus_arrays import (
    LEAST_SAMPLES,
    equal_clocks,
    is_growing_time,
    quote,
    rates_in,
    surplus_arrays,
    time_in_table,
)

_FORCES = ("force", "torque")
"""Quantities of forces: in rotation, torques."""
_NAMED = 4
"""Most further runs that a comment of the skeleton names; dots stand for the rest."""
_SHARE = re.compile(r"(?i)_(test|tst|train|trn|est|estimation|fit|val|vad|valid|validation)(?=_|$)")
"""Parts of a name that state the role of the data, as in `u_test`."""
_TIME_UNITS = ("s", "ms", "us", "min")
"""Units of time stamps, by the last part of a name."""


def map_skeleton(arrays: Arrays) -> str:
    """The map as TOML text. Unknown values are empty texts, which an import refuses with the name of the key."""
    return "\n".join(_lines(arrays)) + "\n"


def _lines(whole: Arrays) -> Iterator[str]:
    """Lines of the map: head, clocks, channels, parts, segment."""
    groups = groups_in(whole.by_name, LEAST_SAMPLES)
    beside = _runs_beside(whole, groups)
    arrays = _first_run(whole, groups, beside)
    surplus = surplus_arrays(arrays)
    every = [name for name, array in arrays.by_name.items() if name in arrays.clocks or is_growing_time(name, array)]
    clocks = [name for name in every if name not in surplus]
    roles = _roles(arrays, [*every, *surplus])
    yield f"# A map for {arrays.name}. Keys and examples: docs/importing.md."
    yield 'device = ""               # what was recorded'
    yield 'hold = "zero-order"       # how the command moves between samples: zero-order, band-limited, linear'
    yield from _clocks(arrays, clocks)
    yield from _direction(roles)
    for name, array in arrays.by_name.items():
        own = _clock_of(name, arrays, every) if len(clocks) > 1 else ""
        numbers = array.dtype.kind in "fiub" and array.size >= LEAST_SAMPLES
        if name in surplus:
            yield f"\n# {name} {surplus[name]}"
        elif name in clocks:
            continue
        elif array.ndim == 1 and numbers:
            yield from _channel((_stem(name), name, _stem(name)), _shape(array.shape), own, roles.get(name, ""))
        elif array.ndim == 2 and numbers:
            yield from _table(name, array, own, roles.get(name, ""))
        else:
            yield from _no_channel(name, array)
    yield from _parts(groups.prefixes)
    yield from _cells_beside(beside, groups)
    yield ""
    yield "[[segment]]"
    yield 'kind = "noise"            # multisine, sweep, sine, slow, noise, binary, step, impact, free, rest'
    yield "split = { fit = 0.5, test = 0.5 }"


def _runs_beside(whole: Arrays, groups: Groups) -> list[str]:
    """Arrays of runs in cells that belong to no group. Cells of single numbers hold constants and do not count."""
    long_ones = [name for name, array in whole.by_name.items() if OF_CELL.match(name) and array.size >= LEAST_SAMPLES]
    return [name for name in long_ones if not name.startswith(groups.prefixes)] if groups.prefixes else []


def _first_run(whole: Arrays, groups: Groups, beside: Sequence[str]) -> Arrays:
    """Arrays of the first of several runs and those that belong to no run, except `beside`; the times of tables [time,
    value ...] as separate arrays."""
    inside = [name for name in whole.by_name if name.startswith(groups.prefixes)] if groups.prefixes else []
    common = {name: array for name, array in whole.by_name.items() if name not in (*inside, *beside)}
    found = {**{name: whole.by_name[full] for name, full in groups.names.items()}, **common}
    times = {_line(name, array, 0): _line_0(array) for name, array in found.items() if time_in_table(array)}
    return Arrays(whole.path, {**found, **times}, (*whole.clocks, *times))


def _clock_of(name: str, arrays: Arrays, clocks: Sequence[str]) -> str:
    """The clock with the same number of samples whose name has the longest common prefix; of equal clocks, the one that
    is kept. Empty without a clock of this length."""
    fitting = [clock for clock in clocks if len(arrays.by_name[clock]) == max(arrays.by_name[name].shape, default=0)]

    def alike(clock: str) -> int:
        return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(name, clock, strict=False)))

    near = max(fitting, key=alike, default="")
    return equal_clocks(arrays).get(near, near)


def _direction(roles: Mapping[str, str]) -> Iterator[str]:
    """A comment on which of force and motion is taken for the command, where names leave it open."""
    columns = [name_signal(_stem(name)) for name in roles]
    if may_be_imposed(columns):
        forces = [roles[name] for name, column in zip(roles, columns, strict=True) if column.quantity in _FORCES]
        yield from (
            "",
            *wrap(IMPOSED if "response" in forces else NOT_IMPOSED, 110, initial_indent="# ", subsequent_indent="# "),
        )


def _no_channel(name: str, array: Array) -> Iterator[str]:
    """A comment on an array that is not a channel: invalid, without numbers, constant, or of more than two
    dimensions."""
    what = left_out(array)
    if isinstance(what, FaultyColumn):
        yield f"\n# Left out: {what}"
    elif array.dtype.kind not in "fiub":
        yield f"\n# {name} holds no numbers" + (f": it is {what}" if what else "")
        yield from (f"# {mend}" for mend in (instead(name, what),) if mend)
    elif array.size < LEAST_SAMPLES:
        yield f"\n# {name}: {_shape(array.shape)}, a constant for expressions"
    else:
        yield f"\n# {name}: {_shape(array.shape)}; a channel is one row of it, as in {quote(name)}[0, 0]"


def _stem(name: str) -> str:
    """Name without the ending under which Simulink stores the values of a signal: `force` for
    `force.signals.values`."""
    for end in (".signals.values", ".values", ".Data", ".data"):
        name = name.removesuffix(end)
    return name


def _line(name: str, array: Array, number: int) -> str:
    """Expression for one line of a table, along its longer side."""
    return f"{quote(name)}[{number}]" if array.shape[0] < array.shape[1] else f"{quote(name)}[:, {number}]"


def _line_0(array: Array) -> Array:
    """First line of a table, along its longer side."""
    return array[0] if array.shape[0] < array.shape[1] else array[:, 0]


def _roles(arrays: Arrays, others: list[str]) -> dict[str, str]:
    """Roles by name, where names, units and data determine them. others: arrays that are not channels."""
    channels = [name for name, array in arrays.by_name.items() if array.size >= LEAST_SAMPLES and name not in others]
    columns = [replace(name_signal(_stem(name)), header=name) for name in channels]
    return dict(zip(channels, turn_imposed(columns, arrays.by_name, propose_roles(columns)), strict=True))


def _parts(prefixes: tuple[str, ...]) -> Iterator[str]:
    """A [[part]] for each run."""
    if prefixes:
        yield "\n# Several runs are in the file: their arrays are named without the prefix above."
    for prefix in prefixes:
        yield "\n[[part]]"
        yield f"prefix = {json.dumps(prefix)}"


def _cells_beside(beside: Sequence[str], groups: Groups) -> Iterator[str]:
    """Comments on runs in cells of another length, and on how to add them where their names identify the arrays."""
    if beside:
        shown = ", ".join(beside[:_NAMED]) + (" ..." if beside[_NAMED:] else "")
        yield f"\n# Also in the file, in cells of another length: {shown}"
    same = {_SHARE.sub("", name): name for name in groups.names if name.isidentifier()}
    lets: dict[str, list[str]] = {}
    for prefix, slash, name in (full.partition("/") for full in beside):
        if (plain := _SHARE.sub("", name)) in same:
            lets.setdefault(prefix + slash, []).append(f"{same[plain]} = {json.dumps(quote(name))}")
    for prefix, pairs in list(lets.items())[-1:]:
        yield f'# Such a run is added by [[part]] with prefix = "{prefix}" and let = {{ {", ".join(pairs)} }}'


def _clocks(arrays: Arrays, clocks: list[str]) -> Iterator[str]:
    """A [[clock]] for each time column; without one, a clock with the rate of the file, or with a comment."""
    for name in clocks:
        plain, unit = unit_in(name) if name in arrays.by_name and name_signal(name).quantity == "time" else (name, "")
        last = plain.rpartition("_")[2]
        yield "\n[[clock]]"
        if len(clocks) > 1:
            yield f"name = {json.dumps(name)}"
        yield f"time = {json.dumps(name)}"
        yield f'time_unit = {json.dumps(unit or (last if last in _TIME_UNITS else ""))}            # "s", "ms"'
    if clocks:
        return
    yield "\n[[clock]]"
    rates = rates_in(arrays)
    for rate, name in list(rates.items())[:1]:
        yield f"rate = {json.dumps(rate)}           # in hertz{'' if rate == name else f', {name} in seconds'}"
    if not rates:
        yield "# rate_hz = 1000, or unknown = true"


def _table(name: str, array: Array, clock: str, role: str) -> Iterator[str]:
    """A channel per line of a table; a table [time, value] gives one channel, with the name and role of the table."""
    timed = time_in_table(array)
    for number in range(int(timed), min(array.shape)):
        single = timed and min(array.shape) == 2
        own = name if single else f"{name}{number + (not timed)}"
        yield from _channel(
            (own, _line(name, array, number), name), _shape(array.shape), clock if timed else "", role if single else ""
        )


def _channel(names: tuple[str, str, str], shape: str, clock: str, role: str) -> Iterator[str]:
    """A [[channel]]. names: of the channel, of its value (an expression), and of the array."""
    name, value, header = names
    parsed = name_signal(header)
    yield ""
    yield f"[[channel]]               # {header}: {shape}"
    yield f"role = {json.dumps(role):20s} # command, response, position, excitation, condition, helper"
    yield f"name = {json.dumps(parsed.name if name == header else name)}"
    yield f"value = {json.dumps(value)}"
    unit, why = parsed.unit, f"{parsed.doubt}; " if parsed.doubt else ""
    yield f'unit = {json.dumps(unit):20s} # {why}as in the file: "N", "m/s^2", "deg", "in", "V"; empty = not known'
    if clock:
        yield f"clock = {json.dumps(clock)}"


def _shape(shape: tuple[int, ...]) -> str:
    """Shape of an array in words."""
    return f"{' x '.join(str(count) for count in shape)} samples" if shape else "one number"
