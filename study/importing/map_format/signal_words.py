"""Interpret channel names: quantity and unit, as in `fx [N]`, `displacement_mm`, `motor speed (rpm)`; and derive the
roles of channels (command, response, ...) from them.

`parse_signal_name` interprets one name; `assign_roles`, `list_open_roles` and `propose_roles` take all those of a file.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from equalizer.signals.quantity_words import WORDS_NEEDING_UNIT, detect_quantity, split_into_words
from equalizer.signals.units import (
    NO_UNIT,
    QUANTITY_UNITS,
    UnknownUnitError,
    check_quantity,
    find_quantity,
    normalise_unit,
    parse_unit,
    suggest_force_unit,
    suggest_unit,
)
from study.importing.map_format.import_map import SignalRole

_BRACKETED_UNIT = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]+(?:\([^\[\]()]*\))?)[\])]\s*")
"""A name followed by its unit in brackets."""
_UNIT_SEPARATOR = re.compile(r"(?<=\w)(?:\s*/\s*|\s*,\s+|\s+in\s+)(?=\S)")
"""Separator between a name and its unit without brackets (`force / N`, `force, N`, `Kraft in N`)."""
_NO_UNIT_WORDS = ("n/a", "na", "none", "-", "--")
"""Words, in lower case, that are written in place of a unit where there is none."""
_PEAK_MARK = re.compile(r"(?<![a-z])(peak|pk|rms)\b|(?<=[av])(peak|pk|rms)\b", re.IGNORECASE)
"""Mark, in the text of a unit, that its numbers are peak or rms values."""
LONGEST_NAME = 300
"""Longest name (characters) in which a unit is searched, chosen: the search takes quadratic time."""
_CACHE_SIZE = 2**14
"""Largest number of names whose results a function caches, as headers of a file are interpreted repeatedly. Chosen."""
_FOREIGN_WORDS = {
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
FOREIGN_WORDS = {word: quantity for quantity, words in _FOREIGN_WORDS.items() for word in words}
"""Quantity of each word in another script."""
_CERTAIN_UNITS = ("rad", "mrad", "rpm", "kN", "N m", "mN m")
"""Units that are unambiguous at the end of a name, unlike `A` in `phase_A`; units with a slash are unambiguous, too."""
_JOINED_UNITS = {"Nm": "N m", "N_m": "N m", "mNm": "mN m", "Ncm": "N cm", "lbfin": "lbf in", "mps": "m/s"}
"""Units as written in names, without blanks or slashes, and their usual notation."""
_ROLE_BY_WORD: dict[str, SignalRole] = {
    **dict.fromkeys(("command", "cmd", "commanded", "demand", "demanded"), "command"),
    **dict.fromkeys(("comando", "mando", "befehl", "commande"), "command"),
    **dict.fromkeys(("ref", "reference", "target", "setpoint", "desired"), "helper"),
    **dict.fromkeys(("referencia", "sollwert", "consigne"), "helper"),
    **dict.fromkeys(("supply", "battery", "bus", "ambient", "setting"), "condition"),
}  # fmt: skip
"""Role that a word in a name states; the first such word counts."""
_TEXTBOOK_ROLES: dict[str, SignalRole] = {"u": "command", "y": "response"}
"""Role of the textbook names of input and output. They count only if both begin names and `x` begins none: `y` would
then be an axis."""
_ROLE_BY_NAME: dict[str, SignalRole] = {
    **dict.fromkeys(("input", "entrada", "eingang", "entrée", "entree"), "command"),
    **dict.fromkeys(("output", "salida", "ausgang", "sortie"), "response"),
}
"""Role of names of input and output, valid only as the whole name: an "output speed" is a speed."""
_Role = SignalRole | Literal[""]
"""Role of a channel; empty: not known."""
_FORCES, _ELECTRICAL = ("force", "torque"), ("current", "voltage")
_RATES, _POSITIONS = ("acceleration", "velocity"), ("position", "angle")
"""Quantities of channels: forces, electrical quantities, rates of motion, and positions."""


@dataclass(frozen=True, slots=True)
class ParsedName:
    """A header or array name, interpreted as far as possible."""

    header: str
    """Name as in the file."""
    name: str
    """Name without its unit in brackets."""
    unit: str
    """Unit in the spelling of `units`; empty if none is stated or known."""
    quantity: str
    """Quantity, or the unit in SI where that has none; empty if neither the unit nor a word determines it."""
    doubt: str
    """What is uncertain, as a clause: an unknown unit, a unit without a known quantity or without a word for it in the
    name (`phase_A`), or a contradiction. Otherwise empty."""

    @property
    def is_certain(self) -> bool:
        """Whether the interpretation is certain: there is no `doubt`."""
        return not self.doubt


def strip_units(columns: Sequence[ParsedName]) -> list[str]:
    """Remove the units at the end of names (`displacement_in` becomes `displacement`, because samples are converted to
    SI), where the unit is certain and the names stay distinct."""
    stems = [_strip_unit(column) for column in columns]
    return [name if stems.count(name) == 1 else column.name for name, column in zip(stems, columns, strict=True)]


def _strip_unit(column: ParsedName) -> str:
    """Remove the unit at the end of a name where it is the unit of a certain interpretation."""
    stem, unit = split_unit_at_end(column.name)
    return stem if stem and unit and unit == column.unit and not column.doubt else column.name


@lru_cache(_CACHE_SIZE)
def split_bracketed_unit(header: str) -> tuple[str, str]:
    """Split a header into its name and its unit in brackets, which is empty if there is none."""
    match = _BRACKETED_UNIT.fullmatch(header) if len(header) <= LONGEST_NAME else None
    if not match or not match["name"].strip():
        return header, ""
    unit = match["unit"].strip()
    return match["name"].strip(), "" if unit.lower() in _NO_UNIT_WORDS else normalise_unit(unit)


def is_peak_value(unit: str) -> bool:
    """Whether a unit, as written in a file, states rms or peak values (`A (peak)`, `mV_rms`)."""
    return normalise_unit(unit) != unit and _PEAK_MARK.search(unit) is not None


@lru_cache(_CACHE_SIZE)
def parse_signal_name(header: str) -> ParsedName:
    """Interpret one header. The quantity follows from a word of the name if there is one, otherwise from the unit.
    Where they contradict each other, the quantity is that of the unit, with a doubt unless the word needs a unit."""
    name, unit = split_bracketed_unit(header)
    foreign_word = max((word for word in FOREIGN_WORDS if word in name.lower()), key=len, default="")
    stated_quantity = (
        detect_quantity(name) if FOREIGN_WORDS.get(foreign_word, "time") == "time" else FOREIGN_WORDS[foreign_word]
    )
    unit_text = unit or split_unit_at_end(name)[1]
    try:
        parsed_unit = parse_unit(unit_text)
    except UnknownUnitError:
        return ParsedName(header, name, "", stated_quantity, _describe_unknown_unit(unit) if unit else "")
    unit_quantity = "time" if parsed_unit.si == "s" else find_quantity(parsed_unit.si)
    if unit_quantity == parsed_unit.si != NO_UNIT and stated_quantity not in ("setting", *QUANTITY_UNITS):
        return ParsedName(header, name, unit_text, unit_quantity, f"what is measured in {unit_text} is not known")
    if not stated_quantity:
        doubt = (
            ""
            if unit or unit_text in _CERTAIN_UNITS or "/" in unit_text
            else f"whether {unit_text} is its unit is not sure, for no word says what it is"
        )
        return ParsedName(header, name, unit_text, unit_quantity, doubt)
    try:
        check_quantity(stated_quantity, parsed_unit)
    except UnknownUnitError:
        if WORDS_NEEDING_UNIT & set(split_into_words(name)):
            return ParsedName(header, name, unit_text, unit_quantity, "")
        unit_hint = suggest_force_unit(stated_quantity, parsed_unit)
        doubt = f"its name says {stated_quantity}, its unit, {unit_text}, says {unit_quantity}{unit_hint}"
        return ParsedName(header, name, unit_text, unit_quantity, doubt)
    return ParsedName(header, name, unit_text, stated_quantity, "")


def _describe_unknown_unit(unit: str) -> str:
    """Describe an unknown unit in a clause, with a known unit that is similar, if any."""
    nearest_unit = suggest_unit(unit)
    return f"'{unit}' is not a unit known here" + (f" (did you mean '{nearest_unit}'?)" if nearest_unit else "")


def assign_roles(columns: Sequence[ParsedName]) -> Sequence[SignalRole] | None:
    """Assign roles by quantity: forces are commands, or voltages or currents if there are none, or else channels named
    as commands; accelerations and velocities are responses, or positions if there are no others; other known
    quantities, except time, are conditions. None if something is open or contradicted by a name (`list_open_roles`)."""
    return (
        None
        if list_open_roles(columns)
        else [role for role in _compute_roles(columns, _find_stated_roles(columns)) if role]
    )


def list_open_roles(columns: Sequence[ParsedName]) -> tuple[str, ...]:
    """List what names and quantities leave open, one clause each; empty if they determine all roles."""
    stated_roles = _find_stated_roles(columns)
    roles = _compute_roles(columns, stated_roles)
    open_questions = []
    for column, role, stated_role in zip(columns, roles, stated_roles, strict=True):
        if role == "helper" or (role and stated_role not in ("", role)):
            open_questions.append(f"whether '{column.header}' is to be compared, or is only a help to others")
        elif not role and column.quantity in _ELECTRICAL:
            open_questions.append(f"whether '{column.header}' is the command")
        elif not role:
            open_questions.append(f"what '{column.header}' is")
    if open_questions:
        return tuple(open_questions)
    if "command" not in roles:
        open_questions.append(
            "what the command is (no column is a force, torque, current or voltage, or called command)"
        )
    if "response" not in roles:
        open_questions.append("what the response is (no column is a position, angle, speed or acceleration)")
    return tuple(open_questions)


def propose_roles(columns: Sequence[ParsedName]) -> list[_Role]:
    """Propose roles by words of the names, otherwise by quantity; empty where open. A reference is a helper; so are
    currents and voltages where there is a force."""
    stated_roles = _find_stated_roles(columns)
    return [
        stated_role or role_by_quantity
        for stated_role, role_by_quantity in zip(stated_roles, _compute_roles(columns, stated_roles), strict=True)
    ]


def may_be_imposed_motion(columns: Sequence[ParsedName]) -> bool:
    """Whether there are forces (or torques) and positions (or angles), no velocities or accelerations, and no name that
    states a command, a response or a helper."""
    quantities = {column.quantity for column in columns}
    has_no_stated_role = not {"command", "helper", "response"} & set(_find_stated_roles(columns))
    return (
        has_no_stated_role
        and bool(quantities & set(_FORCES) and quantities & set(_POSITIONS))
        and not quantities & set(_RATES)
    )


def _compute_roles(columns: Sequence[ParsedName], stated_roles: Sequence[_Role]) -> list[_Role]:
    """Compute the role of each channel by quantity, with the conditions and commands that names state; empty where
    open."""
    roles_by_quantity = _map_roles(columns, stated_roles)
    return [_choose_role(column, role, roles_by_quantity) for column, role in zip(columns, stated_roles, strict=True)]


def _choose_role(column: ParsedName, stated_role: _Role, roles_by_quantity: Mapping[str, SignalRole]) -> _Role:
    """Choose the role of one channel; empty where it is open."""
    if stated_role == "condition":
        return "condition"
    if stated_role == "command" and column.quantity in ("", "1") and "command" not in roles_by_quantity.values():
        return "command"
    has_other_quantity = column.quantity not in ("", "1", "time", *_FORCES, *_ELECTRICAL, *_RATES, *_POSITIONS)
    return roles_by_quantity.get(column.quantity, "condition" if has_other_quantity else "")


def _find_stated_roles(columns: Sequence[ParsedName]) -> list[_Role]:
    """Find the role that each name states; empty where it states none."""
    first_words = {column.name.split("_")[0].lower() for column in columns}
    textbook_roles = _TEXTBOOK_ROLES if {"u", "y"} <= first_words and "x" not in first_words else {}
    roles: list[_Role] = []
    for column in columns:
        words = split_into_words(column.name)
        role_of_name: _Role = _ROLE_BY_NAME.get(words[0], "") if len(words) == 1 else ""
        default_role = role_of_name or (textbook_roles.get(words[0], "") if words else "")
        roles.append(next((_ROLE_BY_WORD[word] for word in words if word in _ROLE_BY_WORD), default_role))
    return roles


def _map_roles(columns: Sequence[ParsedName], stated_roles: Sequence[_Role]) -> dict[str, SignalRole]:
    """Map each quantity to its role, given which quantities occur in the file (see `assign_roles`)."""
    quantities = {column.quantity for column, role in zip(columns, stated_roles, strict=True) if role != "condition"}
    response_quantities = _RATES if quantities & set(_RATES) else _POSITIONS
    roles_by_quantity: dict[str, SignalRole] = {}
    if quantities & set(_FORCES):
        roles_by_quantity.update({**dict.fromkeys(_ELECTRICAL, "helper"), **dict.fromkeys(_FORCES, "command")})
    elif len(quantities & set(_ELECTRICAL)) == 1:  # with both currents and voltages, the command cannot be identified
        roles_by_quantity.update(dict.fromkeys(_ELECTRICAL, "command"))
    roles_by_quantity.update(dict.fromkeys(_POSITIONS, "position"))
    roles_by_quantity.update(dict.fromkeys(response_quantities, "response"))
    return roles_by_quantity


@lru_cache(_CACHE_SIZE)
def split_unit_at_end(name: str) -> tuple[str, str]:
    """Split a name from the unit at its end, as in `displacement_mm`, `omega_rad_s`, `a_mps2`, `force / N` (the
    longest ending that is a unit). Without such a unit: the whole name, and an empty unit."""
    if len(name) > LONGEST_NAME:
        return name, ""
    parts = name.split("_")
    candidates = [
        ("_".join(parts[:split_index]), _join_unit(parts[split_index:])) for split_index in range(1, len(parts))
    ]
    candidates += [(name[: separator.start()], name[separator.end() :]) for separator in _UNIT_SEPARATOR.finditer(name)]
    for stem, unit_text in candidates:
        unit = normalise_unit(unit_text)
        try:
            parse_unit(unit)
        except UnknownUnitError:
            continue
        return (stem, unit) if unit != "1" else (name, "")
    return name, ""


def _join_unit(parts: Sequence[str]) -> str:
    """Join the parts of a name between underscores to a unit in its usual notation."""
    unit_text = "_".join(parts)
    unit_text = re.sub(r"mps2$", "m/s^2", unit_text)
    unit_text = _JOINED_UNITS.get(unit_text, unit_text.replace("_per_", "/").replace("_", "/"))
    return re.sub(r"(?<=[a-z])2$", "^2", unit_text)
