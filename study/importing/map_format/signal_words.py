"""Interpret channel names: quantity and unit, as in `fx [N]`, `displacement_mm`, `motor speed (rpm)`; and derive the
roles of channels (command, response, ...) from them.

`name_signal` interprets one name; `roles_of`, `open_roles` and `propose_roles` take all names of a file.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from equalizer.signals.quantity_words import SEVERAL_MEANINGS, quantity_in, words_in
from equalizer.signals.units import (
    QUANTITY_UNITS,
    UNSTATED,
    UnknownUnitError,
    check_quantity,
    force_hint,
    parse_unit,
    plain_unit,
    quantity_of,
    suggest_unit,
)
from study.importing.map_format.import_map import SignalRole

_BRACKETED = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]+(?:\([^\[\]()]*\))?)[\])]\s*")
"""A name followed by its unit in brackets."""
_SAID_BEHIND = re.compile(r"(?<=\w)(?:\s*/\s*|\s*,\s+|\s+in\s+)(?=\S)")
"""Separator between a name and its unit without brackets (`force / N`, `force, N`, `Kraft in N`), as in standards and
in files of testing machines."""
_NO_UNITS = ("n/a", "na", "none", "-", "--")
"""Words in the place of a unit that state that there is none."""
_PEAK = re.compile(r"(?<![a-z])(peak|pk|rms)\b|(?<=[av])(peak|pk|rms)\b", re.IGNORECASE)
"""Mark of a unit whose numbers are peak or rms values."""
LONGEST_NAME = 300
"""Longest name in characters; the search for a unit takes quadratic time."""
_REMEMBERED = 2**14
"""Size of the cache of names: the headers of one file are interpreted repeatedly."""
_FOREIGN = {
    "time": ("时间", "時間", "時刻", "시간", "время", "χρόνος"),
    "force": ("载荷", "荷重", "하중", "сила", "усилие", "δύναμη"),
    "torque": ("扭矩", "转矩", "トルク", "토크", "момент", "ροπή"),
    "position": ("位移", "位置", "変位", "ストローク", "변위", "위치", "перемещение", "положение", "θέση"),
    "angle": ("角度", "转角", "각도", "угол", "γωνία"),
    "velocity": ("速度", "转速", "속도", "скорость", "ταχύτητα"),
    "acceleration": ("加速度", "가속도", "ускорение", "επιτάχυνση"),
    "voltage": ("电压", "電圧", "전압", "напряжение", "τάση"),
    "current": ("电流", "電流", "전류", "ток", "ρεύμα"),
    "temperature": ("温度", "온도", "температура", "θερμοκρασία"),
    "pressure": ("压力", "圧力", "압력", "давление", "πίεση"),
}
"""Words for a quantity in other scripts."""
FOREIGN_WORDS = {word: quantity for quantity, words in _FOREIGN.items() for word in words}
"""Quantity of each word in another script; the words are also used to detect an encoding."""
_SURE = ("rad", "mrad", "rpm", "kN", "N m", "mN m")
"""Units that are unambiguous at the end of a name, unlike `A` in `phase_A`; units with a slash are unambiguous, too."""
_WRITTEN_TOGETHER = {"Nm": "N m", "N_m": "N m", "mNm": "mN m", "Ncm": "N cm", "lbfin": "lbf in", "mps": "m/s"}
"""Units as written in names, without blanks or slashes, and their usual notation."""
_SAID: dict[str, SignalRole] = {
    **dict.fromkeys(("command", "cmd", "commanded", "comando", "mando", "befehl", "commande"), "command"),
    **dict.fromkeys(("ref", "reference", "target", "setpoint", "desired"), "helper"),
    **dict.fromkeys(("referencia", "sollwert", "consigne"), "helper"),
    **dict.fromkeys(("supply", "battery", "bus", "ambient", "setting"), "condition"),
}  # fmt: skip
"""Role that a word in a name states."""
_SHORT: dict[str, SignalRole] = {"u": "command", "y": "response"}
"""Role of the textbook names of input and output. They count only if both occur and no name is `x`: `y` would then be
an axis."""
_ALONE: dict[str, SignalRole] = {
    **dict.fromkeys(("input", "entrada", "eingang", "entrée", "entree"), "command"),
    **dict.fromkeys(("output", "salida", "ausgang", "sortie"), "response"),
}
"""Role of names of input and output, valid only as the whole name: an "output speed" is a speed."""
_Role = SignalRole | Literal[""]
"""Role of a channel; empty: not known."""
_DRIVES, _FEEDS = ("force", "torque"), ("current", "voltage")
_MOTIONS, _PLACES = ("acceleration", "velocity"), ("position", "angle")
"""Quantities of channels: forces, electrical quantities, rates of motion, and positions."""


@dataclass(frozen=True, slots=True)
class ParsedName:
    """A header or array name, interpreted as far as possible."""

    header: str
    """Name as in the file."""
    name: str
    """Name without its unit in brackets."""
    unit: str
    """Unit as in the file; empty if none is stated or known."""
    quantity: str
    """Quantity; empty if neither the unit nor a word determines it."""
    doubt: str
    """What is uncertain, as a clause: an unknown unit, a unit in a name without a word for its quantity (`phase_A`), or
    a contradiction. Otherwise empty."""

    @property
    def sure(self) -> bool:
        """Whether the interpretation is certain: there is no `doubt`."""
        return not self.doubt


def plain_names(columns: Sequence[ParsedName]) -> list[str]:
    """Names without the unit at their end (`displacement_in` becomes `displacement`, because samples are converted to
    SI), where the unit is certain and the names stay distinct."""
    plain = [_without_unit(column) for column in columns]
    return [name if plain.count(name) == 1 else column.name for name, column in zip(plain, columns, strict=True)]


def _without_unit(column: ParsedName) -> str:
    """Name without the unit at its end, where that is certain."""
    before, unit = unit_at_end(column.name)
    return before if unit and unit == column.unit and not column.doubt else column.name


@lru_cache(_REMEMBERED)
def unit_in(header: str) -> tuple[str, str]:
    """Name and bracketed unit; the unit is empty if there is none."""
    match = _BRACKETED.fullmatch(header) if len(header) <= LONGEST_NAME else None
    if not match or not match["name"].strip():
        return header, ""
    unit = match["unit"].strip()
    return match["name"].strip(), "" if unit.lower() in _NO_UNITS else plain_unit(unit)


def is_peak_value(unit: str) -> bool:
    """Whether a unit, as written in a file, states rms or peak values (`A (peak)`, `mV_rms`)."""
    return plain_unit(unit) != unit and _PEAK.search(unit) is not None


@lru_cache(_REMEMBERED)
def name_signal(header: str) -> ParsedName:
    """Interpret one header. The quantity follows from a word of the name if there is one, otherwise from the unit; a
    contradiction between both is a doubt."""
    name, unit = unit_in(header)
    foreign = max((word for word in FOREIGN_WORDS if word in name.lower()), key=len, default="")
    word = quantity_in(name) if FOREIGN_WORDS.get(foreign, "time") == "time" else FOREIGN_WORDS[foreign]
    stated = unit or unit_at_end(name)[1]
    try:
        known = parse_unit(stated)
    except UnknownUnitError:
        return ParsedName(header, name, "", word, _unknown(unit) if unit else "")
    by_unit = "time" if known.si == "s" else quantity_of(known.si)
    if by_unit == known.si != UNSTATED and word not in ("setting", *QUANTITY_UNITS):
        return ParsedName(header, name, stated, by_unit, f"what is measured in {stated} is not known")
    if not word:
        doubt = (
            ""
            if unit or stated in _SURE or "/" in stated
            else f"whether {stated} is its unit is not sure, for no word says what it is"
        )
        return ParsedName(header, name, stated, by_unit, doubt)
    try:
        check_quantity(word, known)
    except UnknownUnitError:
        if SEVERAL_MEANINGS & set(words_in(name)):
            return ParsedName(header, name, stated, by_unit, "")
        doubt = f"its name says {word}, its unit, {stated}, says {by_unit}{force_hint(word, known)}"
        return ParsedName(header, name, stated, by_unit, doubt)
    return ParsedName(header, name, stated, word, "")


def _unknown(unit: str) -> str:
    """Clause about an unknown unit."""
    near = suggest_unit(unit)
    return f"'{unit}' is not a unit known here" + (f" (did you mean '{near}'?)" if near else "")


def roles_of(columns: Sequence[ParsedName]) -> Sequence[SignalRole] | None:
    """Roles by quantity: forces are commands, or voltages or currents if there are none, or else channels named as
    commands; accelerations and velocities are responses, or positions if there are no others; other known quantities
    are conditions. None if something is open or contradicted by a name (`open_roles` says what)."""
    return None if open_roles(columns) else [role for role in _roles(columns, _find_stated_roles(columns)) if role]


def open_roles(columns: Sequence[ParsedName]) -> tuple[str, ...]:
    """What names and quantities leave open, one clause each; empty if they determine all roles."""
    every_said = _find_stated_roles(columns)
    roles = _roles(columns, every_said)
    found = []
    for column, role, stated in zip(columns, roles, every_said, strict=True):
        if role == "helper" or (role and stated not in ("", role)):
            found.append(f"whether '{column.header}' is to be compared, or is only a help to others")
        elif not role and column.quantity in _FEEDS:
            found.append(f"whether '{column.header}' is the command")
        elif not role:
            found.append(f"what '{column.header}' is")
    if found:
        return tuple(found)
    if "command" not in roles:
        found.append("what the command is (no column is a force, torque, current or voltage, or called command)")
    if "response" not in roles:
        found.append("what the response is (no column is a position, angle, speed or acceleration)")
    return tuple(found)


def propose_roles(columns: Sequence[ParsedName]) -> list[_Role]:
    """Roles by words of the names, otherwise by quantity; empty where open. A reference is a helper; so are currents
    and voltages where there is a force."""
    all_stated = _find_stated_roles(columns)
    return [stated or role for stated, role in zip(all_stated, _roles(columns, all_stated), strict=True)]


def may_be_imposed(columns: Sequence[ParsedName]) -> bool:
    """Whether there are forces (or torques) and positions (or angles), no velocities or accelerations, and no name that
    states a command, a response or a helper."""
    quantities = {column.quantity for column in columns}
    plain = not {"command", "helper", "response"} & set(_find_stated_roles(columns))
    return plain and bool(quantities & set(_DRIVES) and quantities & set(_PLACES)) and not quantities & set(_MOTIONS)


def _roles(columns: Sequence[ParsedName], stated: Sequence[_Role]) -> list[_Role]:
    """Role of each channel by quantity, with conditions and commands that names state; empty where open."""
    by_quantity = _by_quantity(columns, stated)
    return [_role(column, role, by_quantity) for column, role in zip(columns, stated, strict=True)]


def _role(column: ParsedName, stated: _Role, by_quantity: Mapping[str, SignalRole]) -> _Role:
    if stated == "condition":
        return "condition"
    if stated == "command" and column.quantity in ("", "1") and "command" not in by_quantity.values():
        return "command"
    known = column.quantity not in ("", "1", "time", *_DRIVES, *_FEEDS, *_MOTIONS, *_PLACES)
    return by_quantity.get(column.quantity, "condition" if known else "")


def _find_stated_roles(columns: Sequence[ParsedName]) -> list[_Role]:
    """Role that each name states; empty where it states none."""
    firsts = {column.name.split("_")[0].lower() for column in columns}
    short = _SHORT if {"u", "y"} <= firsts and "x" not in firsts else {}
    found: list[_Role] = []
    for column in columns:
        words = words_in(column.name)
        alone: _Role = _ALONE.get(words[0], "") if len(words) == 1 else ""
        brief = alone or (short.get(words[0], "") if words else "")
        found.append(next((_SAID[word] for word in words if word in _SAID), brief))
    return found


def _by_quantity(columns: Sequence[ParsedName], stated: Sequence[_Role]) -> dict[str, SignalRole]:
    """Role of each quantity, given which quantities occur in the file (see `roles_of`)."""
    quantities = {column.quantity for column, role in zip(columns, stated, strict=True) if role != "condition"}
    answers = _MOTIONS if quantities & set(_MOTIONS) else _PLACES
    by_quantity: dict[str, SignalRole] = {}
    if quantities & set(_DRIVES):
        by_quantity.update({**dict.fromkeys(_FEEDS, "helper"), **dict.fromkeys(_DRIVES, "command")})
    elif len(quantities & set(_FEEDS)) == 1:  # with both currents and voltages, the command cannot be identified
        by_quantity.update(dict.fromkeys(_FEEDS, "command"))
    by_quantity.update(dict.fromkeys(_PLACES, "position"))
    by_quantity.update(dict.fromkeys(answers, "response"))
    return by_quantity


@lru_cache(_REMEMBERED)
def unit_at_end(name: str) -> tuple[str, str]:
    """Name, and the unit at its end as in `displacement_mm`, `omega_rad_s`, `a_mps2`, `force / N` (the longest ending
    that is a unit). Without such a unit: the whole name, and an empty unit."""
    if len(name) > LONGEST_NAME:
        return name, ""
    parts = name.split("_")
    ends = [("_".join(parts[:first]), _join_unit(parts[first:])) for first in range(1, len(parts))]
    ends += [(name[: mark.start()], name[mark.end() :]) for mark in _SAID_BEHIND.finditer(name)]
    for before, text in ends:
        unit = plain_unit(text)
        try:
            parse_unit(unit)
        except UnknownUnitError:
            continue
        return (before, unit) if unit != "1" else (name, "")
    return name, ""


def _join_unit(parts: Sequence[str]) -> str:
    """A unit in usual notation, from the parts of a name between underscores."""
    text = "_".join(parts)
    text = re.sub(r"mps2$", "m/s^2", text)
    text = _WRITTEN_TOGETHER.get(text, text.replace("_per_", "/").replace("_", "/"))
    return re.sub(r"(?<=[a-z])2$", "^2", text)
