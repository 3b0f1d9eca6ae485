"""Arrays that a proposed map leaves out: arrays without any number, row numbers, and repeated time columns.

The module also recognises time columns, tables whose first column is the time, and sample rates. Called by `header_map`
and `map_skeleton`.
"""

import re
from collections.abc import Mapping

import numpy as np

from equalizer.signals.units import UnknownUnitError, parse_unit
from study.importing.arrays.read_arrays import Array, Arrays
from study.importing.map_format.signal_words import FOREIGN_WORDS, split_bracketed_unit

LEAST_SAMPLES = 16
"""Arrays with fewer samples are constants."""
CLOCK_WORDS = {
    *(word for word, quantity in FOREIGN_WORDS.items() if quantity == "time"),
    "t", "time", "timestamp", "timestamps", "datetime", "zeit", "zeitstempel", "temps", "tiempo", "tempo",
    "tout", "date",
}  # fmt: skip
"""Words in the name of a time column, in lower case."""
_INDEX_NAME = re.compile(
    r"column1|#|unnamed: 0|(index|idx|i|n|nr|no|number|row|record|sample|scan|point)[ _.]?(nr|no|number|#)?\.?",
    re.IGNORECASE,
)
"""Name of a column of row numbers, or of a column without a name."""
_RATE_NAME = re.compile(
    r"((.* )?(fs|(sampl(e|es|ing)|scan|acquisition|logging) ?(rate|freq|frequency)|sampling)|rate)(( in)? ?k?hz)?"
)
"""Words in the name of a sample rate; the rate of an excitation does not match."""
_STEP_WORDS = {"ts", "dt"}
"""Names of a sampling interval."""
_USUAL_RATIOS = (1.0, 1e-6, 1e-3, 1e3, 1e6)
"""Ratios of the units of two clocks that are tried where a name states no unit."""
_MAX_STEP_SPREAD = 0.02
"""Largest range of a clock's steps, relative to their median, for them to count as even."""
SAME_CLOCK_TOLERANCE = 0.5
"""Stamps that both begin at 0 are one clock if they differ by at most this fraction of a step."""


def find_surplus_arrays(arrays: Arrays) -> Mapping[str, str]:
    """Reason for leaving an array out, as a clause, by name of the array."""
    without_numbers = {name: "holds no numbers at all" for name, array in arrays.by_name.items() if _is_empty(array)}
    without_numbers |= {
        name: "holds no numbers" for name, array in arrays.by_name.items() if array.dtype.kind in "SU" and array.ndim
    }
    has_clock = any(name in arrays.clocks or is_growing_time(name, array) for name, array in arrays.by_name.items())
    row_numbers = {
        name: "numbers the rows" for name, array in arrays.by_name.items() if has_clock and _is_index(name, array)
    }
    return (
        without_numbers
        | row_numbers
        | {name: f"is the same time as '{kept_clock}'" for name, kept_clock in find_equal_clocks(arrays).items()}
    )


@np.errstate(all="ignore")
def is_growing_time(name: str, array: Array) -> bool:
    """Whether an array is named as a time, never decreases, and grows overall; coarse stamps may repeat."""
    is_series = array.ndim == 1 and array.dtype.kind in "fiu" and array.size >= LEAST_SAMPLES
    return (
        is_series
        and bool(split_name_words(name) & CLOCK_WORDS)
        and bool((array[1:] >= array[:-1]).all() and array[-1] > array[0])
    )


def split_name_words(name: str) -> set[str]:
    """Set of the words of a name without its unit, in lower case."""
    return set(_split_words(split_bracketed_unit(name)[0]))


def _split_words(text: str) -> list[str]:
    """Words of a text in lower case, in order."""
    return "".join(letter if letter.isalnum() else " " for letter in text.lower()).split()


def _extract_last_part(name: str) -> str:
    """Last part of a name of several levels (`data.fs`, `1-of-2/fs`), without its unit."""
    return re.split(r"[./](?=\w)(?!k?Hz\b)", split_bracketed_unit(name)[0])[-1]


def find_rates(arrays: Arrays) -> Mapping[str, str]:
    """Single numbers named as a sample rate or sampling interval: name by the expression for the rate; rates come
    first."""
    single_values = [name for name, array in arrays.by_name.items() if array.size == 1 and array.dtype.kind in "fiu"]
    rates = {
        name: name for name in single_values if _RATE_NAME.fullmatch(" ".join(_split_words(_extract_last_part(name))))
    }
    steps = {f"1 / {quote_name(name)}": name for name in single_values if split_name_words(name) & _STEP_WORDS}
    return {**rates, **steps}


def quote_name(name: str) -> str:
    """Expression for an array by its name."""
    return name if name.isidentifier() else f"array('{name}')"


def _is_empty(array: Array) -> bool:
    """Whether all values of an array are NaN."""
    return array.dtype.kind == "f" and array.size >= LEAST_SAMPLES and bool(np.isnan(array).all())


@np.errstate(all="ignore")
def _is_index(name: str, array: Array) -> bool:
    """Whether an array has no name or one of a row number, and counts the rows."""
    is_column = array.ndim == 1 and array.dtype.kind in "fiu" and array.size >= LEAST_SAMPLES
    return is_column and bool(_INDEX_NAME.fullmatch(name)) and bool((np.diff(array.astype(float)) == 1).all())


def find_equal_clocks(arrays: Arrays) -> Mapping[str, str]:
    """Time columns that repeat another: name of the column that is kept, by name of the repetition. Of equal columns,
    one with a unit of time is kept, then one that the file itself calls a clock."""
    kept_clocks: list[str] = []
    repeated_clocks = {}
    clocks = [name for name, array in arrays.by_name.items() if name in arrays.clocks or is_growing_time(name, array)]
    for name in sorted(clocks, key=lambda name: (_read_unit_s(name) is None, name not in arrays.clocks)):
        equal_clock = next(
            (kept_clock for kept_clock in kept_clocks if _is_same_clock(arrays.by_name, kept_clock, name)), None
        )
        if equal_clock is None:
            kept_clocks.append(name)
        else:
            repeated_clocks[name] = equal_clock
    return repeated_clocks


@np.errstate(all="ignore")
def has_time_line(array: Array) -> bool:
    """Whether a table has the form [time, value ...]: its first line along the longer side increases, and either has
    even steps or is the only line that increases."""
    if array.ndim != 2 or array.dtype.kind not in "fiu" or max(array.shape) < LEAST_SAMPLES:
        return False
    lines = array if array.shape[0] < array.shape[1] else array.T
    is_growing = [bool((line[1:] > line[:-1]).all()) for line in lines]
    steps = np.diff(lines[0].astype(float))
    has_even_steps = bool(
        np.ptp(steps) <= _MAX_STEP_SPREAD * abs(np.median(steps))
    )  # even where the values increase, too
    return len(lines) > 1 and is_growing[0] and (has_even_steps or not all(is_growing))


@np.errstate(all="ignore")
def _is_same_clock(by_name: Mapping[str, Array], first: str, second: str) -> bool:
    """Whether two time columns are equal, apart from their starts and from the ratio of their units. Where a name
    states no unit, usual ratios are tried."""
    first_times, second_times = (by_name[name].astype(float) for name in (first, second))
    if (
        first_times.shape != second_times.shape
        or first_times.ndim != 1
        or not np.isfinite([first_times[[0, -1]], second_times[[0, -1]]]).all()
    ):
        return False
    first_times, second_times = first_times - first_times[0], second_times - second_times[0]
    units = _read_unit_s(first), _read_unit_s(second)
    ratios = _USUAL_RATIOS if None in units else ((units[1] or 1) / (units[0] or 1),)
    ratio = min(ratios, key=lambda ratio: abs(second_times[-1] * ratio - first_times[-1]))
    step = float(np.nanmedian(np.diff(first_times)))
    return bool(np.nanmax(np.abs(second_times * ratio - first_times)) <= SAME_CLOCK_TOLERANCE * step)


def _read_unit_s(name: str) -> float | None:
    """Factor from the unit in brackets to seconds; None without a unit of time."""
    try:
        unit = parse_unit(split_bracketed_unit(name)[1])
    except UnknownUnitError:
        return None
    return unit.factor if unit.si == "s" else None
