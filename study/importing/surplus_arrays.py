"""Recognise the arrays of a file that a proposed map omits: arrays without numbers, row numbers and repeated times.

Time columns, tables whose first row or column is the time, and sample rates are recognised as well. The limits below
were chosen by hand.
"""

import re
from collections.abc import Mapping

import numpy as np

from equalizer.signals.units import UnknownUnitError, parse_unit
from study.importing.arrays.read_arrays import Array, Arrays
from study.importing.expressions.expression import quote_name
from study.importing.map_format.signal_words import FOREIGN_WORDS, split_bracketed_unit, split_unit_at_end

LEAST_SAMPLES = 16
"""Least number of samples of a signal; arrays with fewer are taken as constants."""
CLOCK_WORDS = {
    *(word for word, quantity in FOREIGN_WORDS.items() if quantity == "time"),
    "t", "time", "timestamp", "timestamps", "datetime", "zeit", "zeitstempel", "temps", "tiempo", "tempo",
    "tout", "date",
}  # fmt: skip
"""Words in the name of a time column, in lower case."""
_FIRST_UNNAMED_COLUMN = "column1"
"""Name that a table without a header gives its first column."""
_ROW_NUMBER_NAME = re.compile(
    rf"{_FIRST_UNNAMED_COLUMN}|#|unnamed: 0|(index|idx|i|n|nr|no|number|row|record|sample|scan|point)"
    r"[ _.]?(nr|no|number|#)?\.?",
    re.IGNORECASE,
)
"""Name of a column of row numbers, or of a column without a name."""
_RATE_NAME = re.compile(
    r"((.* )?(fs|(sampl(e|es|ing)|scan|acquisition|logging) ?(rate|freq|frequency)|sampling)|rate)(( in)? ?k?hz)?"
)
"""Name of a sample rate, in lower case without punctuation; "excitation rate" does not match."""
_SAMPLING_INTERVAL_WORDS = {"ts", "dt"}
"""Words in the name of a sampling interval."""
_USUAL_UNIT_RATIOS = (1.0, 1e-6, 1e-3, 1e3, 1e6)
"""Ratios of the units of two time columns that are tried where a name states no unit."""
_MAX_STEP_RANGE = 0.02
"""Largest range (maximum minus minimum) of the steps of a time, relative to their median, that counts as even."""
SAME_CLOCK_TOLERANCE = 0.5
"""Largest difference, in median steps, between two time columns shifted to begin at 0 that count as the same clock."""


def find_surplus_arrays(arrays: Arrays) -> Mapping[str, str]:
    """Find the arrays to omit; returns the reason, as a clause, by name of the array. Row numbers are omitted only
    where a time column exists."""
    non_numeric = {name: "holds no numbers at all" for name, array in arrays.by_name.items() if _is_all_nan(array)}
    non_numeric |= {
        name: "holds no numbers" for name, array in arrays.by_name.items() if array.dtype.kind in "SU" and array.ndim
    }
    has_clock = any(name in arrays.clocks or is_growing_time(name, array) for name, array in arrays.by_name.items())
    row_number_columns = {
        name: "numbers the rows" for name, array in arrays.by_name.items() if has_clock and _is_row_number(name, array)
    }
    return (
        non_numeric
        | row_number_columns
        | {name: f"is the same time as '{kept_clock}'" for name, kept_clock in find_equal_clocks(arrays).items()}
    )


@np.errstate(all="ignore")
def is_growing_time(name: str, array: Array) -> bool:
    """Whether a numeric array (n,), n >= `LEAST_SAMPLES`, never decreases, ends above its start, and either has a word
    of `CLOCK_WORDS` in its name (coarse stamps may repeat), or is the first column of a table without a header and has
    even steps other than those of row numbers. False with NaN."""
    is_series = array.ndim == 1 and array.dtype.kind in "fiu" and array.size >= LEAST_SAMPLES
    if not is_series or not bool((array[1:] >= array[:-1]).all() and array[-1] > array[0]):
        return False
    is_unnamed_time = name == _FIRST_UNNAMED_COLUMN and _has_even_steps(array) and not _is_row_number(name, array)
    return bool(split_name_words(name) & CLOCK_WORDS) or is_unnamed_time


def split_name_words(name: str) -> set[str]:
    """Split a name, without its unit in brackets, into the set of its words in lower case."""
    return set(_split_words(split_bracketed_unit(name)[0]))


def _split_words(text: str) -> list[str]:
    """Split a text at all but letters and digits into its words in lower case, in order."""
    return "".join(character if character.isalnum() else " " for character in text.lower()).split()


def _extract_last_part(name: str) -> str:
    """Extract the last part of a name of several levels (`data.fs`, `1-of-2/fs`), without its unit in brackets."""
    return re.split(r"[./](?=\w)(?!k?Hz\b)", split_bracketed_unit(name)[0])[-1]


def find_rates(arrays: Arrays) -> Mapping[str, str]:
    """Find the single numbers that are named as a sample rate or sampling interval; returns the name of the number by
    the expression for the rate in hertz, rates first. A number without a unit is in hertz or seconds; a rate with a
    unit of time, or an interval with one of frequency, is ambiguous and left out."""
    single_values = [name for name, array in arrays.by_name.items() if array.size == 1 and array.dtype.kind in "fiu"]
    named_rates = [
        name
        for name in single_values
        if _RATE_NAME.fullmatch(" ".join(_split_words(_extract_last_part(name)))) and not read_factor(name, "s")
    ]
    intervals = [
        name
        for name in single_values
        if split_name_words(name) & _SAMPLING_INTERVAL_WORDS and not read_factor(name, "Hz")
    ]
    factors = {name: read_factor(name, "Hz") or 1.0 for name in named_rates}
    return {
        **{name if factors[name] == 1 else f"{factors[name]:.15g} * {quote_name(name)}": name for name in named_rates},
        **{f"{1 / (read_factor(name, 's') or 1.0):.15g} / {quote_name(name)}": name for name in intervals},
    }


def read_factor(name: str, si: str, in_brackets: bool = False) -> float | None:
    """Read the factor from the unit in a name, in brackets or, unless `in_brackets`, at its end, to an SI unit; None
    without such a unit."""
    try:
        unit = parse_unit(split_bracketed_unit(name)[1] or ("" if in_brackets else split_unit_at_end(name)[1]))
    except UnknownUnitError:
        return None
    return unit.factor if unit.si == si else None


def _is_all_nan(array: Array) -> bool:
    """Whether all values of a floating-point array of at least `LEAST_SAMPLES` are NaN."""
    return array.dtype.kind == "f" and array.size >= LEAST_SAMPLES and bool(np.isnan(array).all())


@np.errstate(all="ignore")
def _is_row_number(name: str, array: Array) -> bool:
    """Whether an array has no name or one of a row number, and rises by 1 from row to row."""
    is_column = array.ndim == 1 and array.dtype.kind in "fiu" and array.size >= LEAST_SAMPLES
    return is_column and bool(_ROW_NUMBER_NAME.fullmatch(name)) and bool((np.diff(array.astype(float)) == 1).all())


def find_equal_clocks(arrays: Arrays) -> Mapping[str, str]:
    """Find the time columns that repeat another; returns the name of the kept column by the name of the repetition. Of
    equal columns, one with a unit of time in brackets is kept, then one that holds dates or clock times
    (`Arrays.clocks`)."""
    kept_clocks: list[str] = []
    repeated_clocks = {}
    clocks = [name for name, array in arrays.by_name.items() if name in arrays.clocks or is_growing_time(name, array)]
    for name in sorted(clocks, key=lambda name: (read_factor(name, "s", True) is None, name not in arrays.clocks)):
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
    """Whether a table has the form [time, value ...]: the first of its lines along the longer side increases, and
    either has even steps or not all lines increase. False for fewer than `LEAST_SAMPLES` or two lines."""
    if array.ndim != 2 or array.dtype.kind not in "fiu" or max(array.shape) < LEAST_SAMPLES:
        return False
    lines = array if array.shape[0] < array.shape[1] else array.T
    is_growing = [bool((line[1:] > line[:-1]).all()) for line in lines]
    return len(lines) > 1 and is_growing[0] and (_has_even_steps(lines[0]) or not all(is_growing))


def _has_even_steps(times: Array) -> bool:
    """Whether the steps of a time (n,) differ by at most `_MAX_STEP_RANGE`."""
    steps = np.diff(times.astype(float))
    return bool(np.ptp(steps) <= _MAX_STEP_RANGE * abs(np.median(steps)))


@np.errstate(all="ignore")
def _is_same_clock(by_name: Mapping[str, Array], first_name: str, second_name: str) -> bool:
    """Whether two time columns are equal to `SAME_CLOCK_TOLERANCE`, apart from their starts and the ratio of their
    units; where a name states no unit, the ratio of `_USUAL_UNIT_RATIOS` that fits the end best. False for different
    shapes, for fewer than two times, and where a first or last value is not finite."""
    first_times, second_times = (by_name[name].astype(float) for name in (first_name, second_name))
    if (
        first_times.shape != second_times.shape
        or first_times.ndim != 1
        or len(first_times) < 2
        or not np.isfinite([first_times[[0, -1]], second_times[[0, -1]]]).all()
    ):
        return False
    first_times, second_times = first_times - first_times[0], second_times - second_times[0]
    units = read_factor(first_name, "s", True), read_factor(second_name, "s", True)
    ratios = _USUAL_UNIT_RATIOS if None in units else ((units[1] or 1) / (units[0] or 1),)
    ratio = min(ratios, key=lambda ratio: abs(second_times[-1] * ratio - first_times[-1]))
    median_step = float(np.nanmedian(np.diff(first_times)))
    return bool(np.nanmax(np.abs(second_times * ratio - first_times)) <= SAME_CLOCK_TOLERANCE * median_step)
