"""Make an incomplete map for a file of which only the arrays are known, to be completed by its owner."""

import json
from collections.abc import Iterator

from study.importing.arrays.array_groups import groups_in
from study.importing.arrays.arrays import Arrays
from study.importing.map_format.signal_words import name_signal, propose_roles, unit_in
from study.importing.surplus_arrays import LEAST_SAMPLES, is_growing_time, name_words, surplus_arrays

_RATE_WORDS = {"fs", "rate", "samplerate"}
_TIME_UNITS = ("s", "ms", "us", "min")


def map_skeleton(arrays: Arrays) -> str:
    """TOML. What cannot be filled in is an empty text, which an import refuses by name."""
    return "\n".join(_lines(arrays)) + "\n"


def _lines(whole: Arrays) -> Iterator[str]:
    groups = groups_in(whole.by_name, LEAST_SAMPLES)
    inside = [name for name in whole.by_name if name.startswith(groups.prefixes)] if groups.prefixes else []
    common = {name: array for name, array in whole.by_name.items() if name not in inside}
    first = {name: whole.by_name[full] for name, full in groups.names.items()}
    arrays = Arrays(whole.path, {**first, **common}, whole.clocks)
    surplus = surplus_arrays(arrays)
    clocks = [
        name
        for name, array in arrays.by_name.items()
        if name not in surplus and (name in whole.clocks or is_growing_time(name, array))
    ]
    roles = _roles(arrays, [*clocks, *surplus])
    yield f"# A map for {arrays.name}. Keys and examples: docs/importing.md."
    yield 'device = ""               # what was recorded'
    yield 'hold = "zero-order"       # how the command moves between samples: zero-order, band-limited, linear'
    yield from _clocks(arrays, clocks)
    for name, array in arrays.by_name.items():
        if name in clocks:
            continue
        if name in surplus:
            yield f"\n# {name} {surplus[name]}"
        elif array.dtype.kind not in "fiub":
            yield f"\n# {name} holds no numbers"
        elif array.size < LEAST_SAMPLES:
            yield f"\n# {name}: {_shape(array.shape)}, a constant for expressions"
        elif array.ndim == 1:
            own = [clock for clock in clocks if arrays.by_name[clock].shape == array.shape]
            clock = own[0] if own and len(clocks) > 1 else ""
            yield from _channel((name, name, name), _shape(array.shape), clock, roles.get(name, ""))
        elif array.ndim == 2:
            yield from _table(name, array.shape)
        else:
            yield f"\n# {name}: {_shape(array.shape)}; a channel is one row of it, as in {_quote(name)}[0, 0]"
    yield from _parts(groups.prefixes)
    yield ""
    yield "[[segment]]"
    yield 'kind = "noise"            # multisine, sweep, sine, slow, noise, binary, step, impact, free, rest'
    yield "split = { fit = 0.5, test = 0.5 }"


def _roles(arrays: Arrays, others: list[str]) -> dict[str, str]:
    """Roles by name, where names and units tell them; others: what is no channel."""
    channels = [name for name, array in arrays.by_name.items() if array.size >= LEAST_SAMPLES and name not in others]
    return dict(zip(channels, propose_roles([name_signal(name) for name in channels]), strict=True))


def _parts(prefixes: tuple[str, ...]) -> Iterator[str]:
    if prefixes:
        yield "\n# Several runs are in the file: their arrays are named without the prefix above."
    for prefix in prefixes:
        yield "\n[[part]]"
        yield f"prefix = {json.dumps(prefix)}"


def _clocks(arrays: Arrays, clocks: list[str]) -> Iterator[str]:
    for name in clocks:
        plain, unit = unit_in(name)
        last = plain.rpartition("_")[2]
        yield "\n[[clock]]"
        if len(clocks) > 1:
            yield f"name = {json.dumps(name)}"
        yield f"time = {json.dumps(name)}"
        yield f'time_unit = {json.dumps(unit or (last if last in _TIME_UNITS else ""))}            # "s", "ms"'
    if clocks:
        return
    yield "\n[[clock]]"
    rates = [name for name, array in arrays.by_name.items() if array.size == 1 and name_words(name) & _RATE_WORDS]
    yield f"rate = {json.dumps(rates[0])}           # in hertz" if rates else "# rate_hz = 1000, or unknown = true"


def _table(name: str, shape: tuple[int, ...]) -> Iterator[str]:
    rows_are_channels = shape[0] < shape[1]
    for number in range(min(shape)):
        index = f"[{number}]" if rows_are_channels else f"[:, {number}]"
        yield from _channel((f"{name}{number + 1}", f"{_quote(name)}{index}", name), _shape(shape), "", "")


def _channel(names: tuple[str, str, str], shape: str, clock: str, role: str) -> Iterator[str]:
    """names: of the channel, its value, the array's own."""
    name, value, header = names
    told = name_signal(header)
    yield ""
    yield f"[[channel]]               # {header}: {shape}"
    yield f"role = {json.dumps(role):20s} # command, response, position, excitation, condition, helper"
    yield f"name = {json.dumps(told.name if name == header else name)}"
    yield f"value = {json.dumps(value)}"
    why = f"{told.doubt}; " if told.doubt else ""
    yield f'unit = {json.dumps(told.unit):20s} # {why}as in the file: "N", "m/s^2", "deg", "in", "V"; empty = not known'
    if clock:
        yield f"clock = {json.dumps(clock)}"


def _quote(name: str) -> str:
    return name if name.isidentifier() else f"array('{name}')"


def _shape(shape: tuple[int, ...]) -> str:
    return f"{' x '.join(str(count) for count in shape)} samples" if shape else "one number"
