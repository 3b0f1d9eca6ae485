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
"""Dataclass of the rows of a table."""

_LISTED_PROBLEM_LIMIT = 8
"""Number of problems that are listed individually; the others are only counted. Chosen: the message fits a screen."""


class CsvError(ListedProblemsError):
    """A table that cannot be used. `problems`: a clause for each, with line and column where they apply."""


def list_columns(row_type: type[Any]) -> tuple[str, ...]:
    """List the column names of a row type: the names of its fields, in declared order."""
    return tuple(field.name for field in fields(row_type))


def format_csv_table(rows: Iterable[Row], row_type: type[Row]) -> str:
    """Format rows as CSV text with a header line; lines end with a line feed."""
    columns = list_columns(row_type)
    lines = [
        format_csv_line(columns),
        *(format_csv_line([_format_field(getattr(row, name)) for name in columns]) for row in rows),
    ]
    return "\n".join(lines) + "\n"


def parse_csv_table(text: str, row_type: type[Row]) -> tuple[Row, ...]:
    """Parse CSV text with a header into rows. Unknown columns after the known ones are ignored, no column may occur
    twice, and trailing columns with a default may be missing. Raises CsvError for text that is not CSV, with the
    problem of the header, or with the first `_LISTED_PROBLEM_LIMIT` problems of the rows and the number of the
    others."""
    try:
        csv_rows = list(csv.reader(io.StringIO(text.rstrip("\r\n")), strict=True)) or [[]]
    except csv.Error as error:
        raise CsvError((f"this is not CSV: {error}",)) from error
    columns = _select_present_columns(tuple(csv_rows[0]), row_type)
    if problem := find_header_problem(tuple(csv_rows[0]), columns) or _find_duplicate_column(csv_rows[0]):
        raise CsvError((problem,))
    column_types = get_type_hints(row_type)
    rows: list[Row] = []
    problems: list[str] = []
    for line_number, row_fields in enumerate(csv_rows[1:], start=2):
        if len(row_fields) != len(csv_rows[0]):
            problems.append(f"line {line_number} has {len(row_fields)} fields, but the header names {len(csv_rows[0])}")
            continue
        values: dict[str, Any] = {}
        for column, field_text in zip(columns, row_fields, strict=False):
            try:
                values[column] = _parse_field(field_text, column_types[column])
            except ValueError as error:
                problems.append(f"line {line_number}, column {column}: {error}")
        if len(values) == len(columns):
            rows.append(row_type(**values))
    if problems:
        unlisted_count = len(problems) - _LISTED_PROBLEM_LIMIT
        raise CsvError(
            (
                *problems[:_LISTED_PROBLEM_LIMIT],
                *([f"and {unlisted_count} more problems of this kind"] if unlisted_count > 0 else []),
            )
        )
    return tuple(rows)


def drop_absent_columns(text: str, rows: Iterable[Row], row_type: type[Row]) -> tuple[Row, ...]:
    """Return the rows as a table of an earlier version would hold them. text: that table; the trailing columns that it
    lacks have their defaults in the returned rows."""
    header = next(csv.reader(io.StringIO(text.partition("\n")[0])), [])
    absent_columns = list_columns(row_type)[len(_select_present_columns(tuple(header), row_type)) :]
    defaults = {field.name: field.default for field in fields(row_type) if field.name in absent_columns}
    return tuple(replace(row, **defaults) for row in rows)


def _select_present_columns(header: tuple[str, ...], row_type: type[Any]) -> tuple[str, ...]:
    """Select the columns to read: all of the row type, without the trailing ones with a default that the header lacks,
    as in tables of earlier versions."""
    columns = list_columns(row_type)
    required_count = sum(field.default is MISSING for field in fields(row_type))
    while len(columns) > required_count and header[: len(columns)] != columns:
        columns = columns[:-1]
    return columns


def find_header_problem(header: tuple[str, ...], expected: tuple[str, ...]) -> str:
    """Describe the first problem of the header; empty if the header begins with the expected columns."""
    if header[: len(expected)] == expected:
        return ""
    for position, name in enumerate(expected, start=1):
        if header[position - 1 : position] != (name,):
            actual_text = f"is '{header[position - 1]}'" if position <= len(header) else "is missing"
            return f"column {position} of the header {actual_text}; it must be '{name}' (of {', '.join(expected)})"
    return ""


def _find_duplicate_column(header: Sequence[str]) -> str:
    """Find a column that the header names twice, and describe the problem; empty if there is none. Empty names, which
    spreadsheets leave at the end of a header, are ignored."""
    names = [name.strip() for name in header]
    duplicate = next((name for index, name in enumerate(names) if name and name in names[:index]), None)
    return f"the header names the column '{duplicate}' twice; only one of both can be meant" if duplicate else ""


def format_csv_line(row_fields: Sequence[str]) -> str:
    """Format a row of CSV without the line end; fields are quoted where needed."""
    buffer = io.StringIO()
    # The writer quotes fields that contain a character of its line terminator: with both, a carriage return is quoted.
    csv.writer(buffer, lineterminator="\r\n").writerow(row_fields)
    return buffer.getvalue().removesuffix("\r\n")


def describe_type(column_type: Any) -> str:
    """Describe the content of a column in words, for the documentation of a table. column_type: bool, int, float, str,
    an enumeration, or one of these or None."""
    if get_origin(column_type) in (Union, UnionType):
        (option_type,) = (option for option in get_args(column_type) if option is not NoneType)
        return f"{describe_type(option_type)}, or empty"
    if isinstance(column_type, type) and issubclass(column_type, Enum):
        return ", ".join(f"`{option.value}`" for option in column_type)
    return {bool: "`true` or `false`", int: "whole number", float: "number", str: "text"}[column_type]


def _format_field(value: Any) -> str:
    """Format a value as the text of a field; None gives an empty field."""
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


def _parse_field(field_text: str, column_type: Any) -> Any:
    """Convert the text of a field to the type of its column; an empty field of an optional column gives None. Raises
    ValueError with a sentence fragment."""
    if get_origin(column_type) in (Union, UnionType):
        if field_text == "" and NoneType in get_args(column_type):
            return None
        (column_type,) = (option for option in get_args(column_type) if option is not NoneType)
    if field_text == "" and column_type is not str:
        raise ValueError("it is empty, but a value is needed")
    if column_type is bool:
        return _parse_bool(field_text)
    if isinstance(column_type, type) and issubclass(column_type, Enum):
        return _parse_enum(field_text, column_type)
    try:
        return column_type(field_text)
    except ValueError:
        expected_text = {int: "a whole number", float: "a number"}[column_type]
        raise ValueError(f"'{field_text}' is not {expected_text}") from None


def _parse_bool(field_text: str) -> bool:
    """Convert `true` or `false` to a Boolean. Raises ValueError with a sentence fragment."""
    if field_text not in ("true", "false"):
        raise ValueError(f"'{field_text}' is neither true nor false")
    return field_text == "true"


def _parse_enum(field_text: str, enum_type: type[Enum]) -> Enum:
    """Find the member of `enum_type` whose value the field contains. Raises ValueError with a sentence fragment."""
    for member in enum_type:
        if str(member.value) == field_text:
            return member
    raise ValueError(f"'{field_text}' is none of {', '.join(str(member.value) for member in enum_type)}")
