"""CSV tables whose columns are the fields of a frozen dataclass, in declared order: conversion to and from text.

Booleans are `true` and `false`, None is an empty field, enumerations are their values, and floats have all digits that
are needed to read the same number again (`repr`).
"""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, fields, replace
from enum import Enum
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, TypeVar, Union, get_args, get_origin, get_type_hints

from equalizer.signals.listed_problems import ListedProblemsError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Row = TypeVar("Row", bound="DataclassInstance")

_SHOWN = 8
"""Number of problems that are listed individually; the others are counted."""


class CsvError(ListedProblemsError):
    """A table that cannot be used. `problems`: one sentence for each, with line and column where they apply."""


def columns(row_type: type[Any]) -> tuple[str, ...]:
    """Column names of a row type: the names of its fields."""
    return tuple(field.name for field in fields(row_type))


def rows_to_csv(rows: Iterable[Row], row_type: type[Row]) -> str:
    """CSV text with a header."""
    names = columns(row_type)
    lines = [csv_line(names), *(csv_line([_field_text(getattr(row, name)) for name in names]) for row in rows)]
    return "\n".join(lines) + "\n"


def rows_from_csv(text: str, row_type: type[Row]) -> tuple[Row, ...]:
    """Parse rows. Unknown columns after the known ones are ignored, no column may occur twice, and trailing columns
    with a default may be missing. Raises CsvError with all problems."""
    try:
        lines = list(csv.reader(io.StringIO(text.rstrip("\r\n")), strict=True)) or [[]]
    except csv.Error as error:
        raise CsvError((f"this is not CSV: {error}",)) from error
    names = _present_columns(tuple(lines[0]), row_type)
    if problem := header_problem(tuple(lines[0]), names) or _find_doubled_column(lines[0]):
        raise CsvError((problem,))
    hints = get_type_hints(row_type)
    found: list[Row] = []
    problems: list[str] = []
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(lines[0]):
            problems.append(f"line {number} has {len(line)} fields, but the header names {len(lines[0])}")
            continue
        values: dict[str, Any] = {}
        for name, field in zip(names, line, strict=False):
            try:
                values[name] = _read(field, hints[name])
            except ValueError as error:
                problems.append(f"line {number}, column {name}: {error}")
        if len(values) == len(names):
            found.append(row_type(**values))
    if problems:
        rest = len(problems) - _SHOWN
        raise CsvError((*problems[:_SHOWN], *([f"and {rest} more problems of this kind"] if rest > 0 else [])))
    return tuple(found)


def as_written_in(text: str, rows: Iterable[Row], row_type: type[Row]) -> tuple[Row, ...]:
    """Rows as a table of an earlier version would hold them. text: that table; in columns that it lacks, the rows get
    their defaults."""
    header = next(csv.reader(io.StringIO(text.partition("\n")[0])), [])
    absent = columns(row_type)[len(_present_columns(tuple(header), row_type)) :]
    defaults = {field.name: field.default for field in fields(row_type) if field.name in absent}
    return tuple(replace(row, **defaults) for row in rows)


def _present_columns(header: tuple[str, ...], row_type: type[Any]) -> tuple[str, ...]:
    """The columns to read; trailing columns with a default may be missing, as in tables of earlier versions."""
    names = columns(row_type)
    needed = sum(field.default is MISSING for field in fields(row_type))
    while len(names) > needed and header[: len(names)] != names:
        names = names[:-1]
    return names


def header_problem(header: tuple[str, ...], expected: tuple[str, ...]) -> str:
    """Problem with the header, in words; empty if the header begins with the expected columns."""
    if header[: len(expected)] == expected:
        return ""
    for position, name in enumerate(expected, start=1):
        if header[position - 1 : position] != (name,):
            found = f"is '{header[position - 1]}'" if position <= len(header) else "is missing"
            return f"column {position} of the header {found}; it must be '{name}' (of {', '.join(expected)})"
    return ""


def _find_doubled_column(header: Sequence[str]) -> str:
    """Problem with a header that names a column twice, in words; empty if there is none. Empty names, which
    spreadsheets leave at the end of a header, are ignored."""
    names = [name.strip() for name in header]
    doubled = next((name for place, name in enumerate(names) if name and name in names[:place]), None)
    return f"the header names the column '{doubled}' twice; only one of both can be meant" if doubled else ""


def csv_line(fields_of_row: Sequence[str]) -> str:
    """A row of CSV without the line end; fields are quoted where needed."""
    text = io.StringIO()
    # The writer quotes fields that contain a character of its line terminator: with both, a carriage return is quoted.
    csv.writer(text, lineterminator="\r\n").writerow(fields_of_row)
    return text.getvalue().removesuffix("\r\n")


def in_words(hint: Any) -> str:
    """Content of a column of this type in words, for the documentation of a table."""
    if get_origin(hint) in (Union, UnionType):
        (inner,) = (option for option in get_args(hint) if option is not NoneType)
        return f"{in_words(inner)}, or empty"
    if isinstance(hint, type) and issubclass(hint, Enum):
        return ", ".join(f"`{option.value}`" for option in hint)
    return {bool: "`true` or `false`", int: "whole number", float: "number", str: "text"}[hint]


def _field_text(value: Any) -> str:
    """A value as the text of a field."""
    match value:
        case None:
            return ""
        case bool():
            return "true" if value else "false"
        case Enum():
            return str(value.value)
        case float():
            return repr(float(value))
    return str(value)


def _read(field: str, hint: Any) -> Any:
    """The value of a field, by the type of its column. Raises ValueError with a sentence fragment."""
    if get_origin(hint) in (Union, UnionType):
        if field == "" and NoneType in get_args(hint):
            return None
        (hint,) = (option for option in get_args(hint) if option is not NoneType)
    if field == "" and hint is not str:
        raise ValueError("it is empty, but a value is needed")
    if hint is bool:
        return _truth(field)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _choice(field, hint)
    try:
        return hint(field)
    except ValueError:
        wanted = {int: "a whole number", float: "a number"}[hint]
        raise ValueError(f"'{field}' is not {wanted}") from None


def _truth(field: str) -> bool:
    if field not in ("true", "false"):
        raise ValueError(f"'{field}' is neither true nor false")
    return field == "true"


def _choice(field: str, options: type[Enum]) -> Enum:
    for option in options:
        if str(option.value) == field:
            return option
    raise ValueError(f"'{field}' is none of {', '.join(str(option.value) for option in options)}")
