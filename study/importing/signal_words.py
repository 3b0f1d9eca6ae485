"""What a channel's name says of it: quantity and unit, as in `fx [N]`, `displacement_mm`, `motor speed (rpm)`; and what
the channels of a file are to each other."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from equalizer.signals.units import UnknownUnitError, check_quantity, parse_unit, quantity_of
from study.importing.import_map import SignalRole

_BRACKETED = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]+)[\])]\s*")
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_WORDS = {
    "force": ("force", "load", "thrust"),
    "torque": ("torque", "moment", "tau"),
    "position": ("position", "pos", "displacement", "disp", "stroke", "travel"),
    "angle": ("angle", "theta", "phi"),
    "velocity": ("velocity", "vel", "speed", "omega"),
    "acceleration": ("acceleration", "accel", "acc"),
    "voltage": ("voltage", "volt", "volts"),
    "current": ("current",),
    "temperature": ("temperature", "temp"),
}
_QUANTITY = {word: quantity for quantity, words in _WORDS.items() for word in words}
_WRITTEN_TOGETHER = {"Nm": "N m", "N_m": "N m", "mNm": "mN m", "Ncm": "N cm", "lbfin": "lbf in", "mps": "m/s"}
_DRIVES, _FEEDS = ("force", "torque"), ("current", "voltage")
_MOTIONS, _PLACES = ("acceleration", "velocity"), ("position", "angle")


@dataclass(frozen=True, slots=True)
class Named:
    """A header or an array's name, understood as far as it goes."""

    header: str
    name: str
    unit: str
    """As in the file; empty where none is stated, or none that is known here."""
    quantity: str
    """Empty where neither the unit nor a word says it."""
    sure: bool
    """False where a unit was read out of a name that no word supports (`phase_A`), or word and unit disagree."""


def unit_in(header: str) -> tuple[str, str]:
    """Name and unit in brackets; the unit is empty where the header says none."""
    match = _BRACKETED.fullmatch(header)
    return (match["name"].strip(), match["unit"].strip()) if match and match["name"].strip() else (header, "")


def named(header: str) -> Named:
    name, unit = unit_in(header)
    word = next((_QUANTITY[part.lower()] for part in _WORD.findall(name) if part.lower() in _QUANTITY), "")
    told = unit or _unit_at_end(name)
    try:
        known = parse_unit(told)
    except UnknownUnitError:
        return Named(header, name, "", word, not unit)
    by_unit = "time" if known.si == "s" else quantity_of(known.si)
    if not word:
        return Named(header, name, told, by_unit, bool(unit))
    try:
        check_quantity(word, known)
    except UnknownUnitError:
        return Named(header, name, told, by_unit, False)
    return Named(header, name, told, word, True)


def roles_of(columns: Sequence[Named]) -> list[SignalRole] | None:
    """Forces are commands, where there are none voltages and currents; accelerations and velocities are responses,
    places responses where there are no others. None where something is left open."""
    quantities = {column.quantity for column in columns}
    drives = _DRIVES if quantities & set(_DRIVES) else _FEEDS
    answers = _MOTIONS if quantities & set(_MOTIONS) else _PLACES
    if not (quantities & set(drives) and quantities & set(answers)):
        return None
    by_quantity: dict[str, SignalRole] = {"temperature": "condition"}
    by_quantity.update(dict.fromkeys(_PLACES, "position"))
    by_quantity.update(dict.fromkeys(answers, "response"))
    by_quantity.update(dict.fromkeys(drives, "command"))
    if not quantities <= set(by_quantity):
        return None
    return [by_quantity[column.quantity] for column in columns]


def _unit_at_end(name: str) -> str:
    """`displacement_mm`, `omega_rad_s`, `a_mps2`: the longest end that is a unit; empty where none is."""
    parts = name.split("_")
    for first in range(1, len(parts)):
        text = "_".join(parts[first:])
        text = re.sub(r"mps2$", "m/s^2", text)
        text = _WRITTEN_TOGETHER.get(text, text.replace("_per_", "/").replace("_", "/"))
        text = re.sub(r"(?<=[a-z])2$", "^2", text)
        try:
            parse_unit(text)
        except UnknownUnitError:
            continue
        return text if text != "1" else ""
    return ""
