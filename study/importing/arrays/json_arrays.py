"""Read arrays from JSON files.

Three forms are read: records (`[{"t": 0, "u": 1}, ...]`), columns (`{"t": [...], "u": [...]}`), and JSON Lines (a
record per line; https://jsonlines.org). Arrays inside an object have its name as prefix (`run1/u`), unless it is the
only object with arrays of several values. Records that hold long lists of several lengths are runs; their prefix is
their number (`data/1/u`).
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.csv_arrays import MAX_COLUMNS
from study.importing.arrays.table_cells import is_empty, is_number
from study.importing.arrays.table_layout import append_units
from study.regular_file import open_regular, read_regular
from study.store.disk.strict_json import load_json

Array = npt.NDArray[Any]
"""Array of numbers or texts, or a placeholder (an object array with one entry) for one that is not read."""
MAX_JSON_BYTES = 2**26
"""Largest size of a JSON file (bytes; 64 MiB). Chosen: parsed, it takes about twenty times as much memory."""
_MAX_OBJECTS, _MAX_VALUES = 2**21, 2**24
"""Largest number of objects and lists of a file, each of which takes hundreds of bytes of memory, and of its values, by
its commas. Chosen."""
_HAPTEQ_FORMAT_PREFIX = "hapteq"
"""Beginning of the names of the formats that hapteq writes."""
_HAPTEQ_FORMAT_PATTERN = re.compile(rb'"format"\s*:\s*"hapteq')
"""Bytes in which a document declares one of these formats."""
_SEARCHED_BYTES = 4096
"""Number of bytes at the start of a file that are searched for `_HAPTEQ_FORMAT_PATTERN`. Chosen."""
_UNIT_KEYS = ("unit", "units")
"""Keys that state the unit of the values in the same object."""
_VALUE_KEYS = ("values", "value", "data", "samples")
"""Keys of the values in an object with a unit and several lists; the first one found counts."""
_LEAST_RUN_SAMPLES = 16
"""Least length of a list that may be the signal of a run, as `surplus_arrays.LEAST_SAMPLES` of any signal."""


def read_json_arrays(path: Path) -> dict[str, Array]:
    """Read the arrays of a JSON file, by name. Raises OSError; ValueError, with the problem as text, where the file is
    no JSON, a document of hapteq, too large, or states a number next to values with a unit."""
    try:
        text = read_regular(path, MAX_JSON_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        raise ValueError(f"it is no UTF-8 text (byte {problem.start}), as JSON is; save it as UTF-8") from problem
    document = _parse_document(text)
    if isinstance(document, dict) and str(document.get("format", "")).startswith(_HAPTEQ_FORMAT_PREFIX):
        raise ValueError(f"it is a hapteq document ({document['format']}), and holds no recording")
    arrays = dict(_find_arrays(document, ()))
    parent_paths = {key_path[:-1] for key_path, array in arrays.items() if array.size > 1}
    common_path = parent_paths.pop() if len(parent_paths) == 1 else ()
    return {
        "/".join(key_path[len(common_path) :] if key_path[: len(common_path)] == common_path else key_path): array
        for key_path, array in arrays.items()
    }


def is_hapteq_document(path: Path) -> bool:
    """Whether the beginning of a JSON file declares a format that hapteq writes. Raises OSError."""
    with open_regular(path) as file:
        return _HAPTEQ_FORMAT_PATTERN.search(file.read(_SEARCHED_BYTES)) is not None


def _parse_document(text: str) -> Any:
    """Parse a JSON text to its document, or JSON Lines to a list of records. Raises ValueError for another text, or too
    much content."""
    if text.count("{") + text.count("[") > _MAX_OBJECTS or text.count(",") > _MAX_VALUES:
        raise ValueError(f"it has more than {_MAX_OBJECTS} records or {_MAX_VALUES} values; save it as .csv or .npz")
    try:
        return load_json(text, with_nan=True)
    except ValueError as json_error:
        lines = [(line_number, line) for line_number, line in enumerate(text.splitlines(), start=1) if line.strip()]
        if len(lines) < 2:
            raise ValueError(f"this is no JSON: {json_error}") from json_error
        try:
            records = [_parse_record(line_number, line) for line_number, line in lines]
        except ValueError as lines_error:
            raise ValueError(f"this is neither JSON ({json_error}) nor lines of it ({lines_error})") from lines_error
        return records


def _parse_record(line_number: int, line: str) -> Any:
    """Parse the record on one line. Raises ValueError unless it is a JSON object."""
    try:
        record = load_json(line, with_nan=True)
    except ValueError as problem:
        raise ValueError(f"line {line_number}: {problem}") from problem
    if not isinstance(record, dict):
        raise ValueError(f"line {line_number} is no record in braces")
    return record


def _find_arrays(value: Any, key_path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Array]]:
    """Find the arrays in a JSON value, each with the path of keys that leads to it; a value outside any object is
    `data`."""
    match value:
        case dict():
            yield from _find_arrays_in_object(value, key_path)
        case []:
            return
        case [dict(), *_] if all(isinstance(record, dict) for record in value) and _are_runs(value):
            for number, record in enumerate(value, start=1):
                yield from _find_arrays_in_object(record, (*key_path, str(number)))
        case [dict(), *_] if all(isinstance(record, dict) for record in value):
            yield from (((*key_path, key), _make_array(column)) for key, column in _collect_columns(value).items())
        case _:
            yield key_path or ("data",), _make_array(value)


def _find_arrays_in_object(
    value: Mapping[str, Any], key_path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Array]]:
    """Find the arrays of an object, each with its path of keys. `{"unit": "N", "values": [...]}` is one array, with the
    unit in brackets after its name."""
    units = [value[key] for key in _UNIT_KEYS if isinstance(value.get(key), str)]
    list_keys = [key for key, entry in value.items() if isinstance(entry, list)]
    values_key = list_keys[0] if len(list_keys) == 1 else next((key for key in _VALUE_KEYS if key in list_keys), "")
    if key_path and len(units) == 1 and values_key:
        for key, entry in value.items():
            if key == values_key:
                yield (*key_path[:-1], append_units([key_path[-1]], units)[0]), _make_array(entry)
            elif key not in _UNIT_KEYS:
                yield from _make_sibling_placeholder(entry, (*key_path, key))
        return
    for key, entry in value.items():
        yield from _find_arrays(entry, (*key_path, key))


def _are_runs(records: list[dict[str, Any]]) -> bool:
    """Whether each record holds a run: the lists under some key have several lengths, and so are no table, and most
    records have a long one there, unlike the contacts or events at each time in a table."""
    lengths_by_key: dict[str, list[int]] = {}
    for record in records:
        for key, entry in record.items():
            if isinstance(entry, list) and all(map(_is_number, entry)):
                lengths_by_key.setdefault(key, []).append(len(entry))
    return any(
        len(set(lengths)) > 1 and 2 * sum(length >= _LEAST_RUN_SAMPLES for length in lengths) > len(records)
        for lengths in lengths_by_key.values()
    )


def _is_number(entry: Any) -> bool:
    """Whether a JSON value is a number or a missing one."""
    return entry is None or isinstance(entry, int | float)


def _make_sibling_placeholder(entry: Any, key_path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Array]]:
    """Make the placeholder for an entry in the same object as values and their unit, such as a description. Raises
    ValueError unless the entry is null or a text that is no number: a number, such as a scale, may change the
    values."""
    if entry is not None and (not isinstance(entry, str) or is_number(entry.strip(), ".")):
        name = "/".join(key_path[:-1])
        raise ValueError(
            f"'{name}' has '{key_path[-1]}' next to its values, and whether it scales them is not stated; write the "
            "values in their unit, and remove it"
        )
    yield key_path, np.array(None, dtype=object)


def _collect_columns(records: list[dict[str, Any]]) -> dict[str, list[Any]]:
    """Collect one column for each key of any record, None where a record lacks it; objects inside a record are read one
    level deep, as `imu.x`. Raises ValueError with too many keys or values."""
    rows = [dict(_flatten_record(record)) for record in records]
    keys = dict.fromkeys(key for record in rows for key in record)
    if len(keys) > MAX_COLUMNS or len(keys) * len(rows) > _MAX_VALUES:
        raise ValueError(
            f"its {len(rows)} records have {len(keys)} keys; up to {MAX_COLUMNS} are read, and {_MAX_VALUES} values"
        )
    return {key: [record.get(key) for record in rows] for key in keys}


def _flatten_record(record: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield keys and values of a record; those of an object inside it as `key.inner`."""
    for key, value in record.items():
        if isinstance(value, dict):
            yield from ((f"{key}.{inner_key}", entry) for inner_key, entry in value.items())
        else:
            yield key, value


def _make_array(value: Any) -> Array:
    """Convert an entry to an array: numbers, NaN where a value is missing; texts, which may be dates, where any value
    is not a number; a placeholder where there is no rectangular array of numbers."""
    if isinstance(value, list) and value and all(_is_scalar(entry) for entry in value):
        if all(isinstance(entry, str) or entry is None for entry in value):
            return _convert_texts(["" if entry is None else entry.strip() for entry in value])
        if all(not isinstance(entry, str) or is_empty(entry) for entry in value):
            return np.array([np.nan if entry is None or isinstance(entry, str) else float(entry) for entry in value])
        return np.array([str(entry) for entry in value])
    try:
        array = np.asarray(value)
    except ValueError:  # lists of several lengths
        return np.array(None, dtype=object)
    return array if array.dtype.kind in "fiub" else np.array(None, dtype=object)


def _convert_texts(texts: list[str]) -> Array:
    """Convert texts to numbers (NaN where missing) if each is a number or missing; otherwise to an array of texts."""
    if all(is_number(text, ".") for text in texts):
        return np.array([np.nan if is_empty(text) else float(text) for text in texts])
    return np.array(texts)


def _is_scalar(entry: Any) -> bool:
    """Whether a JSON value is neither a list nor an object."""
    return entry is None or isinstance(entry, bool | int | float | str)
