"""Decide which of force and position was commanded, where names leave it open, by a test for imposed motions.

A motion that follows ramps or sines, while the force does not, was imposed (`analysis.look.imposed_motion`).
"""

from collections.abc import Mapping, Sequence
from typing import Literal

from analysis.look.imposed_motion import is_imposed
from study.importing.arrays.arrays import Array
from study.importing.map_format.import_map import SignalRole
from study.importing.map_format.signal_words import ParsedName, may_be_imposed_motion

IMPOSED_REMARK = (
    "The motion is taken for the command and the force for the response, for the motion follows ramps or sines and the "
    "force does not. If the force was commanded, import by a map with the roles the other way round: role = "
    '"command" for the force, role = "response" for the motion'
)
"""Remark where the test finds that the motion was imposed."""
NOT_IMPOSED_REMARK = (
    "The force is taken for the command. If the motion was imposed and the force was measured, as on a testing "
    'machine, import by a map with the roles the other way round: role = "command" for the motion, role = "response" '
    "for the force"
)
"""Remark where the test does not find an imposed motion."""
_ROLE_IF_IMPOSED: dict[str, SignalRole] = {"command": "response", "response": "command", "position": "command"}
"""Role of a signal where the motion was imposed, by its role where the force is the command."""

Role = SignalRole | Literal[""]
"""Role of a signal; empty: not known yet."""


def swap_imposed_roles(
    columns: Sequence[ParsedName], by_name: Mapping[str, Array], roles: Sequence[Role]
) -> list[Role]:
    """The roles; where the data show that each motion was imposed, motions become commands and forces responses. roles:
    one per column. by_name: arrays by header; roles are unchanged unless the arrays are one-dimensional and of equal
    length."""
    unchanged = list(roles)
    if not may_be_imposed_motion(columns):
        return unchanged
    forces = [column for column in columns if column.quantity in ("force", "torque")]
    positions = [column for column in columns if column.quantity in ("position", "angle")]
    arrays = [by_name[column.header] for column in (*forces, *positions)]
    if len({array.shape for array in arrays}) > 1 or arrays[0].ndim != 1:
        return unchanged
    if not all(
        is_imposed(by_name[position.header].astype(float), by_name[force.header].astype(float))
        for position in positions
        for force in forces
    ):
        return unchanged
    return [
        _ROLE_IF_IMPOSED.get(role, role) if column in forces or column in positions else role
        for column, role in zip(columns, roles, strict=True)
    ]
