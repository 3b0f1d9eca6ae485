"""Compiled entry points of the simulated device. Their machine code is kept on disk for later runs.

numba checks only the file of an entry point for changes, but most of the mechanism is in other files of this folder.
Each entry point therefore captures the fingerprint of all of them (`study.devices.governor.compiling`).
"""

from pathlib import Path
from typing import Any

import numpy.typing as npt
from numba import njit, types
from numpy import uint64

from equalizer.signals.signal import FloatArray
from study.devices.governor.compiling import compute_fingerprint
from study.devices.simulated.dynamics import integrate_tick
from study.devices.simulated.linkage import solve_inverse_kinematics
from study.devices.simulated.sensors import read_sensors

_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
_RANDOM_STATE = types.uint64[::1]
"""numba's types of the arguments: vectors and matrices of floats, and the state of the random generator."""


def _compile_entry_points(sources_fingerprint: int) -> tuple[Any, Any, Any]:
    """Compile `sense`, `advance` and `solve_pose`. sources_fingerprint: captured so that a change of a source
    invalidates numba's cache."""

    @njit(types.void(_VECTOR, _VECTOR, _RANDOM_STATE, _VECTOR), cache=True, nogil=True)
    def sense(state: FloatArray, parameters: FloatArray, noise: npt.NDArray[uint64], reading: FloatArray) -> None:
        """Fill the reading of a tick; see `sensors.read_sensors`."""
        _ = sources_fingerprint
        read_sensors(state, parameters, noise, reading)

    @njit(types.void(_VECTOR, _VECTOR, _VECTOR), cache=True, nogil=True)
    def advance(state: FloatArray, parameters: FloatArray, force_n: FloatArray) -> None:
        """Integrate the device over a tick; see `dynamics.integrate_tick`."""
        _ = sources_fingerprint
        integrate_tick(state, parameters, force_n)

    @njit(types.void(_VECTOR, _VECTOR, _VECTOR, _MATRIX), cache=True, nogil=True)
    def solve_pose(parameters: FloatArray, position: FloatArray, angles: FloatArray, jacobian: FloatArray) -> None:
        """Fill joint angles and inverse Jacobian at a position; see `linkage.solve_inverse_kinematics`."""
        _ = sources_fingerprint
        solve_inverse_kinematics(parameters, position, angles, jacobian)

    return sense, advance, solve_pose


sense, advance, solve_pose = _compile_entry_points(
    compute_fingerprint(Path(__file__).parent, Path(__file__).parents[1] / "rig.py")
)
"""`sense` and `advance` with the arguments that `study.devices.rig.CompiledRig` states; `solve_pose`: joint
angles and inverse Jacobian at a position, see `linkage.solve_inverse_kinematics`."""
