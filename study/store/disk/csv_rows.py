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

_LISTED_PROBLEMS = 8
"""Number of problems that are listed individually; the others are counted."""


class CsvError(ListedProblemsError):
    """A table that cannot be used. `problems`: one sentence for each, with line and column where they apply."""


def column_names(row_type: type[Any]) -> tuple[str, ...]:
    """Column names of a row type: the names of its fields."""
    return tuple(field.name for field in fields(row_type))


def rows_to_csv(rows: Iterable[Row], row_type: type[Row]) -> str:
    """CSV text with a header."""
    names = column_names(row_type)
    lines = [
        format_csv_line(names),
        *(format_csv_line([_format_field(getattr(row, name)) for name in names]) for row in rows),
    ]
    return "\n".join(lines) + "\n"


def rows_from_csv(text: str, row_type: type[Row]) -> tuple[Row, ...]:
    """Parse rows. Unknown columns after the known ones are ignored, no column may occur twice, and trailing columns
    with a default may be missing. Raises CsvError with all problems."""
    try:
        lines = list(csv.reader(io.StringIO(text.rstrip("\r\n")), strict=True)) or [[]]
    except csv.Error as error:
        raise CsvError((f"this is not CSV: {error}",)) from error
    names = _present_columns(tuple(lines[0]), row_type)
    if problem := find_header_problem(tuple(lines[0]), names) or _find_duplicate_column(lines[0]):
        raise CsvError((problem,))
    hints = get_type_hints(row_type)
    rows: list[Row] = []
    problems: list[str] = []
    for line_number, row_fields in enumerate(lines[1:], start=2):
        if len(row_fields) != len(lines[0]):
            problems.append(f"line {line_number} has {len(row_fields)} fields, but the header names {len(lines[0])}")
            continue
        values: dict[str, Any] = {}
        for name, field in zip(names, row_fields, strict=False):
            try:
                values[name] = _parse_field(field, hints[name])
            except ValueError as error:
                problems.append(f"line {line_number}, column {name}: {error}")
        if len(values) == len(names):
            rows.append(row_type(**values))
    if problems:
        unlisted = len(problems) - _LISTED_PROBLEMS
        raise CsvError(
            (*problems[:_LISTED_PROBLEMS], *([f"and {unlisted} more problems of this kind"] if unlisted > 0 else []))
        )
    return tuple(rows)


def drop_absent_columns(text: str, rows: Iterable[Row], row_type: type[Row]) -> tuple[Row, ...]:
    """Rows as a table of an earlier version would hold them. text: that table; in columns that it lacks, the rows get
    their defaults."""
    header = next(csv.reader(io.StringIO(text.partition("\n")[0])), [])
    absent = column_names(row_type)[len(_present_columns(tuple(header), row_type)) :]
    defaults = {field.name: field.default for field in fields(row_type) if field.name in absent}
    return tuple(replace(row, **defaults) for row in rows)


def _present_columns(header: tuple[str, ...], row_type: type[Any]) -> tuple[str, ...]:
    """The columns to read; trailing columns with a default may be missing, as in tables of earlier versions."""
    names = column_names(row_type)
    required_count = sum(field.default is MISSING for field in fields(row_type))
    while len(names) > required_count and header[: len(names)] != names:
        names = names[:-1]
    return names


def find_header_problem(header: tuple[str, ...], expected: tuple[str, ...]) -> str:
    """Problem with the header, in words; empty if the header begins with the expected columns."""
    if header[: len(expected)] == expected:
        return ""
    for position, name in enumerate(expected, start=1):
        if header[position - 1 : position] != (name,):
            actual = f"is '{header[position - 1]}'" if position <= len(header) else "is missing"
            return f"column {position} of the header {actual}; it must be '{name}' (of {', '.join(expected)})"
    return ""


def _find_duplicate_column(header: Sequence[str]) -> str:
    """Problem with a header that names a column twice, in words; empty if there is none. Empty names, which
    spreadsheets leave at the end of a header, are ignored."""
    names = [name.strip() for name in header]
    duplicate = next((name for index, name in enumerate(names) if name and name in names[:index]), None)
    return f"the header names the column '{duplicate}' twice; only one of both can be meant" if duplicate else ""


def format_csv_line(fields_of_row: Sequence[str]) -> str:
    """A row of CSV without the line end; fields are quoted where needed."""
    text = io.StringIO()
    # The writer quotes fields that contain a character of its line terminator: with both, a carriage return is quoted.
    csv.writer(text, lineterminator="\r\n").writerow(fields_of_row)
    return text.getvalue().removesuffix("\r\n")


def describe_type(hint: Any) -> str:
    """Content of a column of this type in words, for the documentation of a table."""
    if get_origin(hint) in (Union, UnionType):
        (option_type,) = (option for option in get_args(hint) if option is not NoneType)
        return f"{describe_type(option_type)}, or empty"
    if isinstance(hint, type) and issubclass(hint, Enum):
        return ", ".join(f"`{option.value}`" for option in hint)
    return {bool: "`true` or `false`", int: "whole number", float: "number", str: "text"}[hint]


def _format_field(value: Any) -> str:
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


def _parse_field(field: str, hint: Any) -> Any:
    """The value of a field, by the type of its column. Raises ValueError with a sentence fragment."""
    if get_origin(hint) in (Union, UnionType):
        if field == "" and NoneType in get_args(hint):
            return None
        (hint,) = (option for option in get_args(hint) if option is not NoneType)
    if field == "" and hint is not str:
        raise ValueError("it is empty, but a value is needed")
    if hint is bool:
        return _parse_bool(field)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _parse_enum(field, hint)
    try:
        return hint(field)
    except ValueError:
        expected = {int: "a whole number", float: "a number"}[hint]
        raise ValueError(f"'{field}' is not {expected}") from None


def _parse_bool(field: str) -> bool:
    """The Boolean of a field. Raises ValueError with a sentence fragment."""
    if field not in ("true", "false"):
        raise ValueError(f"'{field}' is neither true nor false")
    return field == "true"


def _parse_enum(field: str, options: type[Enum]) -> Enum:
    """The member of `options` whose value a field contains. Raises ValueError with a sentence fragment."""
    for option in options:
        if str(option.value) == field:
            return option
    raise ValueError(f"'{field}' is none of {', '.join(str(option.value) for option in options)}")
