"""Decide which of force and position was commanded, where names leave it open, by a test for imposed motions.

A motion that follows ramps or sines, while the force does not, was imposed (`analysis.look.imposed_motion`).
"""

from collections.abc import Mapping, Sequence
from typing import Literal

from analysis.look.imposed_motion import is_imposed
from study.importing.arrays.arrays import Array
from study.importing.map_format.import_map import SignalRole
from study.importing.map_format.signal_words import ParsedName, may_be_imposed

IMPOSED = (
    "The motion is taken for the command and the force for the response, for the motion follows ramps or sines and the "
    "force does not. If the force was commanded, import by a map with the roles the other way round: role = "
    '"command" for the force, role = "response" for the motion'
)
"""Remark where the test finds that the motion was imposed."""
NOT_IMPOSED = (
    "The force is taken for the command. If the motion was imposed and the force was measured, as on a testing "
    'machine, import by a map with the roles the other way round: role = "command" for the motion, role = "response" '
    "for the force"
)
"""Remark where the test does not find an imposed motion."""
_TURNED: dict[str, SignalRole] = {"command": "response", "response": "command", "position": "command"}
"""Role of a signal where the motion was imposed, by its role where the force is the command."""

Role = SignalRole | Literal[""]
"""Role of a signal; empty: not known yet."""


def turn_imposed(columns: Sequence[ParsedName], by_name: Mapping[str, Array], roles: Sequence[Role]) -> list[Role]:
    """The roles; where the data show that each motion was imposed, motions become commands and forces responses.
    columns: of one-dimensional arrays in by_name."""
    kept = list(roles)
    if not may_be_imposed(columns):
        return kept
    drives = [column for column in columns if column.quantity in ("force", "torque")]
    places = [column for column in columns if column.quantity in ("position", "angle")]
    arrays = [by_name[column.header] for column in (*drives, *places)]
    if len({array.shape for array in arrays}) > 1 or arrays[0].ndim != 1:
        return kept
    if not all(
        is_imposed(by_name[x.header].astype(float), by_name[f.header].astype(float)) for x in places for f in drives
    ):
        return kept
    return [
        _TURNED.get(role, role) if column in drives or column in places else role
        for column, role in zip(columns, roles, strict=True)
    ]
