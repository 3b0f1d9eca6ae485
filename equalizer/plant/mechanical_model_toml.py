"""Parsing and formatting of mechanical models as TOML text.

Tables: [model] (name, quantity, matrices as lists of rows), [sensor], [actuator], [[effect]] (kind, axis, parameters),
[tolerance], [provenance]. The parser collects all problems of the text before it raises an error; only a text without
any is checked for consistent values (`MechanicalModel`). Values are in SI units, or in those that [provenance] states.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, fields
from datetime import date, time
from typing import Any, TypeVar

import numpy as np

from equalizer.laws.law import Law, parse_law
from equalizer.laws.parse import LawError
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW
from equalizer.plant.mechanical_model import (
    ActuatorLimits,
    MechanicalModel,
    MechanicalModelError,
    ModelEffect,
    SensorLimits,
    Tolerance,
    suggest_word,
)
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import UnitSystem

MATRIX_KEYS = ("mass", "damping", "stiffness", "input", "output")
"""Keys of the matrices in the table [model]."""
_MODEL_KEYS = ("name", "quantity", *MATRIX_KEYS, "rotational")
_TOP_LEVEL_KEYS = ("model", "sensor", "actuator", "effect", "tolerance", "provenance", "rotational")
"""Tables of the document; `rotational`, a key of [model], is accepted at the top level as well."""
_LAW_KEYS = ("acts_on", "expression")
"""Keys of a table [[effect]] that only a discovered law has, both texts."""
_MAX_QUOTED_LENGTH = 80
"""Characters of a value that are quoted in a message."""

UNITS_KEY = "units"
"""Key of the table [provenance] for the units of force, length and time, where the model's values are not in SI
units."""

Numbers = TypeVar("Numbers", SensorLimits, ActuatorLimits, Tolerance)
"""A class whose fields are the numbers of one table."""


def parse_mechanical_model(text: str) -> MechanicalModel:
    """Parse a mechanical model. Raises MechanicalModelError with a sentence for each problem."""
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise MechanicalModelError((f"this is not TOML: {error}",)) from error
    problems: list[str] = _find_unknown_keys(document, _TOP_LEVEL_KEYS, "")
    model = _read_table(document, "model", problems)
    problems += _find_unknown_keys(model, _MODEL_KEYS, "model.")
    matrices = {name: _read_matrix(model, name, problems) for name in MATRIX_KEYS}
    texts = {name: _read_text(model, name, problems) for name in ("name", "quantity")}
    sensor = _read_number_table(document, "sensor", SensorLimits, problems)
    actuator = _read_number_table(document, "actuator", ActuatorLimits, problems)
    tolerance = _read_number_table(document, "tolerance", Tolerance, problems) if "tolerance" in document else None
    effects = _read_effects(document.get("effect", []), problems)
    rotational = model.get("rotational", document.get("rotational", False))
    if not isinstance(rotational, bool):
        problems.append(f"rotational is {_quote_value(rotational)}; it must be true or false")
    provenance = _convert_dates_to_text(_read_table(document, "provenance", problems))
    if problems:
        raise MechanicalModelError(tuple(problems))
    return MechanicalModel(
        name=texts["name"],
        quantity=texts["quantity"],
        mass=matrices["mass"],
        damping=matrices["damping"],
        stiffness=matrices["stiffness"],
        input=matrices["input"],
        output=matrices["output"],
        sensor=sensor,
        actuator=actuator,
        effects=effects,
        tolerance=tolerance,
        rotational=rotational,
        provenance=provenance,
        units=_read_units(provenance),
    )


def format_mechanical_model(model: MechanicalModel) -> str:
    """Format a model as TOML text, for `parse_mechanical_model`; None in the provenance and the units of a law are left
    out. Raises TypeError for a value of the provenance that `_format_value` does not take."""
    lines = ["[model]", f"name = {_format_value(model.name)}", f"quantity = {_format_value(model.quantity)}"]
    if model.rotational:
        lines.append("rotational = true")
    for name in MATRIX_KEYS:
        rows = [f"  {_format_value(row)}," for row in getattr(model, name).tolist()]
        lines += [f"{name} = [", *rows, "]"]
    lines += _format_section("[sensor]", asdict(model.sensor))
    lines += _format_section("[actuator]", asdict(model.actuator))
    for effect in model.effects:
        lines += _format_section(
            "[[effect]]", {"kind": effect.kind, "axis": effect.axis, **_make_law_entries(effect), **effect.parameters}
        )
    if model.tolerance is not None:
        lines += _format_section("[tolerance]", asdict(model.tolerance))
    provenance = {**model.provenance, **({} if model.units is None else {UNITS_KEY: asdict(model.units)})}
    if provenance:
        lines += _format_section("[provenance]", provenance)
    return "\n".join(lines) + "\n"


def _convert_dates_to_text(value: Any) -> Any:
    """Convert dates and times in a value to ISO 8601 text: TOML has them, JSON results with the provenance do not."""
    if isinstance(value, dict):
        return {key: _convert_dates_to_text(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_convert_dates_to_text(entry) for entry in value]
    return value.isoformat() if isinstance(value, date | time) else value


def _read_units(provenance: Mapping[str, Any]) -> UnitSystem | None:
    """Read the unit system in the provenance, as `format_mechanical_model` writes it; None, which means SI units, where
    the texts for force or length are missing. The time is in seconds where it is missing."""
    stored_units = provenance.get(UNITS_KEY)
    stored_texts = (
        {key: value for key, value in stored_units.items() if isinstance(value, str)}
        if isinstance(stored_units, dict)
        else {}
    )
    return (
        UnitSystem(stored_texts["force"], stored_texts["length"], stored_texts.get("time", "s"))
        if {"force", "length"} <= set(stored_texts)
        else None
    )


def _find_unknown_keys(table: Mapping[str, Any], allowed: tuple[str, ...], prefix: str) -> list[str]:
    """Find the keys that are not allowed, a sentence for each. prefix: path of the table, such as `model.`."""
    return [
        f"unknown key '{prefix}{key}'{suggest_word(key, allowed)}; allowed are {', '.join(allowed)}"
        for key in table
        if key not in allowed
    ]


def _read_table(document: Mapping[str, Any], name: str, problems: list[str]) -> dict[str, Any]:
    """Read a table of the document; empty where it is missing (for [model] a problem) or not a table (a problem)."""
    table = document.get(name, {})
    if not isinstance(table, dict):
        problems.append(f"{name} must be a table: [{name}]")
        return {}
    if name == "model" and not table:
        problems.append("the table [model] is missing")
    return table


def _read_text(table: Mapping[str, Any], name: str, problems: list[str]) -> Any:
    """Read a required text of [model]; an empty or other value is returned, with an entry in `problems`."""
    text = table.get(name)
    if not isinstance(text, str) or not text:
        problems.append(
            f"model.{name} {'is missing' if text is None else f'is {_quote_value(text)}'}; it must be a text"
        )
    return text


def _read_matrix(table: Mapping[str, Any], name: str, problems: list[str]) -> FloatArray:
    """Read a matrix from a list of rows; (0, 0), with an entry in `problems`, where it is not such a list."""
    rows = table.get(name)
    if rows is None:
        problems.append(f"model.{name} is missing")
    elif not (isinstance(rows, list) and rows and all(isinstance(row, list) for row in rows)):
        problems.append(f"model.{name} must be a list of rows, as in [[1, 0], [0, 1]]")
    elif len({len(row) for row in rows}) != 1:
        problems.append(f"model.{name} has rows of different lengths: {', '.join(str(len(row)) for row in rows)}")
    elif wrong_values := [value for row in rows for value in row if not _is_number(value)]:
        problems.append(f"model.{name} holds {_quote_value(wrong_values[0])}, which is not a number")
    else:
        return np.array(rows, dtype=np.float64)
    return np.empty((0, 0))


def _read_number_table(
    document: Mapping[str, Any], name: str, table_class: type[Numbers], problems: list[str]
) -> Numbers:
    """Read a table of numbers as `table_class`; other values and unknown keys are left out and added to `problems`."""
    table = _read_table(document, name, problems)
    allowed = tuple(table_field.name for table_field in fields(table_class))
    problems += _find_unknown_keys(table, allowed, f"{name}.")
    values = {key: value for key, value in table.items() if key in allowed}
    for key, value in values.items():
        if not _is_number(value):
            problems.append(f"{name}.{key} is {_quote_value(value)}; it must be a number")
    return table_class(**{key: float(value) for key, value in values.items() if _is_number(value)})


def _read_effects(entries: Any, problems: list[str]) -> tuple[ModelEffect, ...]:
    """Read the effects from the tables [[effect]]; entries other than kind, axis and those of a law must be numbers.
    Empty where `problems`, also those of earlier tables, is not empty."""
    if not (isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)):
        problems.append("effects are written as tables: [[effect]]")
        return ()
    effects = []
    for effect_number, entry in enumerate(entries, start=1):
        law = _read_law(entry, effect_number, problems) if entry.get("kind") == DISCOVERED_LAW else None
        text_keys = ("kind", "axis", *(_LAW_KEYS if entry.get("kind") == DISCOVERED_LAW else ()))
        parameters = {key: value for key, value in entry.items() if key not in text_keys}
        wrong_entries = [f"{key} = {_quote_value(value)}" for key, value in parameters.items() if not _is_number(value)]
        if wrong_entries:
            problems.append(f"effect {effect_number} holds {', '.join(wrong_entries)}; parameters are numbers")
        kind = entry.get("kind")
        if not isinstance(kind, str):
            problems.append(f"effect {effect_number} has no kind")
            continue
        if not isinstance(entry.get("axis", ""), str):
            problems.append(
                f"effect {effect_number}: axis is {_quote_value(entry['axis'])}; it must be a text, "
                "or left out for all axes"
            )
        effects.append(ModelEffect(kind, entry.get("axis") or None, parameters, law))
    return () if problems else tuple(_convert_parameters_to_float(effect) for effect in effects)


def _read_law(entry: Mapping[str, Any], effect_number: int, problems: list[str]) -> Law | None:
    """Read the law of a discovered effect; None, with an entry in `problems`, where it is incomplete or not valid."""
    missing_keys = [key for key in (*_LAW_KEYS, "axis") if not isinstance(entry.get(key), str)]
    if missing_keys:
        problems.append(f"effect {effect_number}: {DISCOVERED_LAW} lacks {', '.join(missing_keys)} (texts)")
        return None
    try:
        return parse_law(entry["expression"], entry["acts_on"], entry["axis"])
    except LawError as error:
        problems.append(f"effect {effect_number}: {error}")
        return None


def _make_law_entries(effect: ModelEffect) -> dict[str, str]:
    """Make the keys and values of a discovered law for a table [[effect]]; none for an effect of the catalogue."""
    return {} if effect.law is None else {"acts_on": effect.law.acts_on, "expression": effect.law.exact_text}


def _convert_parameters_to_float(effect: ModelEffect) -> ModelEffect:
    """Return the effect with all parameters as float; TOML integers are read as int."""
    parameters = {key: float(value) for key, value in effect.parameters.items()}
    return ModelEffect(effect.kind, effect.axis, parameters, effect.law)


def _is_number(value: Any) -> bool:
    """Whether a value is a float (also NaN or infinite) or an integer below 2^64 in magnitude. Python's parser also
    reads longer integers, which TOML does not require and a float may not represent."""
    return isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**64)


def _quote_value(value: Any) -> str:
    """Quote a value as text for an error message, cut to `_MAX_QUOTED_LENGTH`."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # Python does not print integers of more than 4300 digits
        return "a value that cannot be shown"
    return text if len(text) <= _MAX_QUOTED_LENGTH else f"{text[:_MAX_QUOTED_LENGTH]}…"


def _format_section(heading: str, table: Mapping[str, Any]) -> list[str]:
    """Format the lines of a table, after an empty line; values that are None are left out."""
    return [
        "",
        heading,
        *(f"{_format_key(key)} = {_format_value(value)}" for key, value in table.items() if value is not None),
    ]


def _format_key(key: str) -> str:
    """Format a bare TOML key where possible, else a quoted one."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _format_text(key)


def _format_text(text: str) -> str:
    """Format a TOML basic string: control characters, quotes and backslashes escaped."""
    return '"' + re.sub(r'[\x00-\x1f\x7f"\\]', lambda match: f"\\u{ord(match[0]):04x}", text) + '"'


def _format_value(value: Any) -> str:
    """Format a value in TOML syntax; entries that are None are left out. Raises TypeError for any other type."""
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return _format_text(value)
        case int():
            return str(value)
        case float():
            return repr(float(value))
        case list() | tuple():
            return f"[{', '.join(_format_value(entry) for entry in value if entry is not None)}]"
        case Mapping():
            entries = (
                f"{_format_key(key)} = {_format_value(entry)}" for key, entry in value.items() if entry is not None
            )
            return f"{{ {', '.join(entries)} }}" if value else "{}"
    raise TypeError(f"a value of type {type(value).__name__} cannot be written as TOML: {value!r}")
