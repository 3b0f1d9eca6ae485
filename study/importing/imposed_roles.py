"""Roles (command or response) of forces and positions in a data file whose column names do not state them.

A motion that follows ramps or sines, while the force does not, was imposed and is the command
(`analysis.look.imposed_motion`). `header_map` and `map_skeleton` call this when they propose a map for an import.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

from analysis.look.imposed_motion import is_motion_imposed
from study.importing.arrays.read_arrays import Array
from study.importing.map_format.import_map import SignalRole
from study.importing.map_format.signal_words import ParsedName, may_be_imposed_motion

IMPOSED_REMARK = (
    "The motion is taken for the command and the force for the response, for the motion follows ramps or sines and the "
    "force does not. If the force was commanded, import by a map with the roles the other way round: role = "
    '"command" for the force, role = "response" for the motion'
)
"""Remark in the import's report if the test finds that the motion was imposed."""
NOT_IMPOSED_REMARK = (
    "The force is taken for the command. If the motion was imposed and the force was measured, as on a testing "
    'machine, import by a map with the roles the other way round: role = "command" for the motion, role = "response" '
    "for the force"
)
"""Remark in the import's report if the test does not find an imposed motion."""
_ROLE_IF_IMPOSED: dict[str, SignalRole] = {"command": "response", "response": "command", "position": "command"}
"""Role of a signal if the motion was imposed, by its proposed role, which assumes that the force is the command."""

Role = SignalRole | Literal[""]
"""Role of a signal; an empty text means that it is not known yet."""


def swap_imposed_roles(
    columns: Sequence[ParsedName], arrays_by_header: Mapping[str, Array], roles: Sequence[Role]
) -> list[Role]:
    """Return the roles (one per column), changed to motion = command and force = response if the data show that every
    motion was imposed.

    columns: the parsed headers. arrays_by_header: data by column header. roles: the proposed roles, in the order of
    `columns`; they are returned unchanged if the headers exclude an imposed motion (`may_be_imposed_motion`), if the
    arrays are not one-dimensional and of equal length, or if a motion does not pass the test against each force.
    """
    proposed_roles = list(roles)
    if not may_be_imposed_motion(columns):
        return proposed_roles
    forces = [column for column in columns if column.quantity in ("force", "torque")]
    positions = [column for column in columns if column.quantity in ("position", "angle")]
    arrays = [arrays_by_header[column.header] for column in (*forces, *positions)]
    if len({array.shape for array in arrays}) > 1 or arrays[0].ndim != 1:
        return proposed_roles
    if not all(
        is_motion_imposed(arrays_by_header[position.header].astype(float), arrays_by_header[force.header].astype(float))
        for position in positions
        for force in forces
    ):
        return proposed_roles
    return [
        _ROLE_IF_IMPOSED.get(role, role) if column in forces or column in positions else role
        for column, role in zip(columns, roles, strict=True)
    ]
