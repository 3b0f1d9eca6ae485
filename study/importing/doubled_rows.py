"""Rows that a logger wrote twice: the same time stamp with the same values."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from study.importing.arrays.arrays import Array
from study.importing.expressions.functions import Value
from study.importing.expressions.namespace import Namespace, NoTime
from study.importing.map_format.import_map import ClockMap

IntArray = npt.NDArray[np.intp]


def without_doubled_rows(clock: ClockMap, names: Namespace) -> tuple[Namespace, str]:
    """The names without rows that repeat the one above, and a sentence that says how many; unchanged where time
    stands still otherwise, too. Raises ImportProblemError."""
    if not clock.time:
        return names, ""
    stamps: Value = names.value_of(clock.time, NoTime())
    if stamps.ndim != 1 or len(stamps) < 2:
        return names, ""
    standing = np.flatnonzero(stamps[1:] == stamps[:-1]) + 1
    rows = [array for array in names.arrays.values() if _is_row(array, len(stamps)) and not _counts(array)]
    if not len(standing) or not all(_repeats(array, standing) for array in rows):
        return names, ""
    kept = np.delete(np.arange(len(stamps)), standing)
    arrays = {name: array[kept] if _is_row(array, len(stamps)) else array for name, array in names.arrays.items()}
    count = f"{len(standing)} row{'s' if len(standing) > 1 else ''}"
    said = f"Clock '{clock.name}': {count} logged twice (the same stamp, the same values) left out."
    return replace(names, arrays=arrays), said


def _repeats(array: Array, rows: IntArray) -> bool:
    """Whether the rows are all as those above them."""
    return np.array_equal(array[rows], array[rows - 1], equal_nan=array.dtype.kind == "f")


@np.errstate(all="ignore")
def _counts(array: Array) -> bool:
    """Whether an array numbers the rows, doubled ones too."""
    return array.ndim == 1 and array.dtype.kind in "fiu" and bool((array[1:] - array[:-1] == 1).all())


def _is_row(array: Array, count: int) -> bool:
    return array.ndim >= 1 and len(array) == count
