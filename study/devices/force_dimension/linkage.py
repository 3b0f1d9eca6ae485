"""Kinematics and dynamics of an open device at any position, as computed by the vendor's library. Nothing moves.

For a position of the handle the library gives encoder counts, joint angles q, Jacobian J = dx/dq, inertia matrix and
gravity torques tau; the force that holds the weight is pinv(J^T) tau. The device gets no force and stays braked. The
actual position of the handle is used only in `check_frame`.
"""

import contextlib
from collections.abc import Callable, Iterator
from ctypes import byref, c_double, c_int
from typing import TypeVar

import numpy as np

from equalizer.linkage.calibration import LinkageReading
from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo
from study.devices.force_dimension.connect import CALIBRATE, device_error, load_library, open_model
from study.devices.force_dimension.handle import Handle
from study.devices.force_dimension.lab import read_lab
from study.devices.force_dimension.library import GEOMETRY_ERROR, LibraryError
from study.devices.force_dimension.models import MODELS, DeviceModel
from study.devices.force_dimension.rigs import read_info
from study.errors import DeviceError

Result = TypeVar("Result")
"""Type of a result of the library."""

JOINTS = 8
"""DHD_MAX_DOF: joints of base, wrist and gripper."""
DELTA = 0b111
"""Mask of the base's three joints."""

NEAR_M = 2e-4
"""A position is out of reach where the position computed from its encoder counts differs by more than this (m). The
encoders resolve about 10 um."""
SAME_M = 1e-3
"""Largest accepted difference (m) between the handle's reported position and that of its reported joint angles."""


class VendorLinkage:
    """Linkage of an opened device, as the vendor's library computes it. Nothing moves."""

    def __init__(self, handle: Handle, model: DeviceModel, info: DeviceInfo) -> None:
        self.info = info
        self._handle, self._model = handle, model
        self._library, self._number = handle.library, handle.number

    def at(self, position_m: FloatArray) -> LinkageReading | None:
        """Joint angles, Jacobian, inertia and holding force at a position (3,), m; None out of reach. Raises
        `DeviceError`."""
        return self._ask_library(self._read_at, position_m)

    def angles_at(self, position_m: FloatArray) -> FloatArray | None:
        """Joint angles (3,), rad, at a position (3,), m; None out of reach. Raises `DeviceError`."""
        return self._ask_library(lambda place: self._angles(self._counts(place)), position_m)

    def check_frame(self) -> None:
        """Check that the linkage functions use the axes of the reported positions. Raises `DeviceError` where the
        handle's position and its joint angles do not agree, and `LibraryError` where the joint angles cannot be
        read."""
        try:
            position_m = np.array(self._handle.position_m())
        except LibraryError as error:
            raise device_error(self._model.name, error) from error
        reading = self.at(position_m)
        reported = (c_double * JOINTS)()
        self._library.call("dhdGetJointAngles", reported, self._number)
        if reading is not None and self._moves_by(reading, np.array(reported[:3])) <= SAME_M:
            return
        raise DeviceError(
            f"The linkage of the {self._model.name} was not read",
            "Its library gives another position for the handle than its joint angles do: the handle was moved just "
            "then, or the device's base was given an angle (dhdSetDeviceAngle), which turns its axes.",
            "Leave the handle at rest, and set the base's angle to zero in other programs; then try again.",
        )

    def _moves_by(self, reading: LinkageReading, angles: FloatArray) -> float:
        """Distance (m) of the handle from the reading's position, linearized: |J (angles - q)|. A Jacobian that is not
        finite counts as zero here; it is refused later, with an error that names it."""
        jacobian = np.nan_to_num(reading.jacobian)
        return float(np.linalg.norm(jacobian @ (angles - reading.joint_angle_rad)))

    def _ask_library(
        self, read_library: Callable[[FloatArray], Result | None], position_m: FloatArray
    ) -> Result | None:
        """Call `read_library` for a position; None where the library reports it as out of reach. Raises `DeviceError`
        for other failures."""
        try:
            return read_library(position_m)
        except LibraryError as error:
            if error.code == GEOMETRY_ERROR:
                return None
            raise device_error(self._model.name, error) from error

    def _counts(self, position_m: FloatArray) -> list[c_int]:
        """Encoder counts of the base's three joints at a position (m)."""
        counts = [c_int() for _ in range(3)]
        x, y, z = (float(coordinate) for coordinate in position_m)
        self._library.call("dhdDeltaPositionToEncoder", x, y, z, *map(byref, counts), self._number)
        return counts

    def _angles(self, counts: list[c_int]) -> FloatArray:
        """Joint angles (3,), rad, of encoder counts."""
        return self._read_position("dhdDeltaEncodersToJointAngles", *counts)

    def _read_at(self, position_m: FloatArray) -> LinkageReading | None:
        """Reading at a position (3,), m; None where that of its encoder counts differs by more than `NEAR_M`."""
        counts = self._counts(position_m)
        encoder_position_m = self._read_position("dhdDeltaEncoderToPosition", *counts)
        if not float(np.linalg.norm(encoder_position_m - position_m)) <= NEAR_M:
            return None
        angles = self._angles(counts)
        jacobian, inertia = (c_double * 9)(), (c_double * 36)()
        self._library.call("dhdDeltaJointAnglesToJacobian", *(float(angle) for angle in angles), jacobian, self._number)
        # The joints of a wrist, which follow the base's three, keep their present angles.
        joints, torques = (c_double * JOINTS)(), (c_double * JOINTS)()
        self._library.call("dhdGetJointAngles", joints, self._number)
        joints[:3] = [float(angle) for angle in angles]
        self._library.call("dhdJointAnglesToInertiaMatrix", joints, inertia, self._number)
        self._library.call("dhdJointAnglesToGravityJointTorques", joints, torques, DELTA, self._number)
        j = np.array(jacobian).reshape(3, 3)
        gravity_force_n = np.linalg.pinv(j.T) @ np.array(torques[:3]) if np.isfinite(j).all() else np.full(3, np.nan)
        return LinkageReading(np.array(position_m), angles, j, np.array(inertia).reshape(6, 6)[:3, :3], gravity_force_n)

    def _read_position(self, name: str, *counts: c_int) -> FloatArray:
        """The three numbers that a function of the library returns for three encoder counts."""
        values = [c_double() for _ in range(3)]
        self._library.call(name, *counts, *map(byref, values), self._number)
        return np.array([value.value for value in values])


@contextlib.contextmanager
def vendor_linkage(name: str) -> Iterator[VendorLinkage]:
    """Context: the linkage of an open, braked device of this name (`MODELS`), disconnected at the end. Raises
    `DeviceError`."""
    model, library = MODELS[name], load_library()
    handle = open_model(library, model)
    try:
        info = read_info(handle, library, model, read_lab().effective_mass_kg)
        library.call("dhdEnableExpertMode")
        if not handle.status().calibrated:
            raise DeviceError(f"The {model.name} is not calibrated", "It does not know where its handle is.", CALIBRATE)
        yield VendorLinkage(handle, model, info)
    except LibraryError as error:
        raise device_error(model.name, error) from error
    finally:
        handle.disconnect()
