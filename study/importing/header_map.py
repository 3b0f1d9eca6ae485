"""A map out of a table's own header, where that names quantities and units: `time [s], fx [N], ax [m/s^2]`."""

import re
from dataclasses import dataclass

from equalizer.signals.units import UnknownUnitError, parse_unit, quantity_of
from study.importing.arrays import TABLES, Arrays
from study.importing.header_units import unit_in
from study.importing.import_map import ChannelMap, ClockMap, ImportMap, SignalRole

_TIME = re.compile(r"(t|time|zeit|temps)(_?(s|ms|us))?", re.IGNORECASE)
_COMMANDS = ("force", "torque")
_RESPONSES = ("acceleration", "velocity", "angular velocity")
_PLACES = ("position", "angle")


@dataclass(frozen=True, slots=True)
class _Column:
    header: str
    name: str
    unit: str
    quantity: str


def header_map(arrays: Arrays) -> ImportMap | None:
    """None where the header does not say every unit, or does not tell commands from responses."""
    if arrays.path.suffix.lower() not in TABLES:
        return None
    columns = [column for header in arrays.by_name if (column := _column(header))]
    if len(columns) < len(arrays.by_name):
        return None
    times = [column for column in columns if column.quantity == "time" and _TIME.fullmatch(column.name)]
    rest = [column for column in columns if column not in times]
    roles = _roles(rest)
    if len(times) != 1 or roles is None or len({column.name for column in rest}) < len(rest):
        return None
    clock = ClockMap(time=times[0].header, time_unit=times[0].unit)
    channels = tuple(
        ChannelMap(role=role, name=column.name, value=column.header, unit=column.unit)
        for column, role in zip(rest, roles, strict=True)
    )
    return ImportMap(channel=channels, device="unknown", title=arrays.path.stem, clock=(clock,))


def _column(header: str) -> _Column | None:
    name, text = unit_in(header)
    try:
        unit = parse_unit(text)
    except UnknownUnitError:
        return None
    return _Column(header, name, text, quantity_of(unit.si) if unit.si != "s" else "time")


def _roles(columns: list[_Column]) -> list[SignalRole] | None:
    """Forces are commands, accelerations and velocities responses, places responses where there are no others."""
    quantities = {column.quantity for column in columns}
    moving = bool(quantities & set(_RESPONSES))
    if not quantities & set(_COMMANDS) or not quantities & {*_RESPONSES, *_PLACES}:
        return None
    roles: list[SignalRole] = []
    for column in columns:
        if column.quantity in _COMMANDS:
            roles.append("command")
        elif column.quantity in _RESPONSES or (column.quantity in _PLACES and not moving):
            roles.append("response")
        elif column.quantity in _PLACES:
            roles.append("position")
        else:
            return None
    return roles
