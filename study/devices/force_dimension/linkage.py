"""Kinematics and dynamics of an open device at any position, as computed by the vendor's library. Nothing moves.

For a position of the handle the library gives encoder counts, joint angles q, Jacobian J = dx/dq, inertia matrix and
gravity torques tau; the force that holds the weight is pinv(J^T) tau. The device gets no force and stays braked. The
actual position of the handle is used only in `check_frame`, the present angles of a wrist for inertia and gravity.
Opened by `study.devices.opening.open_linkage`, for `study.workflows.recording.calibrate_linkage`.
"""

import contextlib
from collections.abc import Callable, Iterator
from ctypes import byref, c_double, c_int
from typing import TypeVar

import numpy as np

from equalizer.linkage.calibration import LinkageReading
from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo
from study.devices.force_dimension.connect import CALIBRATION_ADVICE, load_library, make_device_error, open_model
from study.devices.force_dimension.device_models import MODELS, DeviceModel
from study.devices.force_dimension.handle import Handle
from study.devices.force_dimension.lab import read_lab_settings
from study.devices.force_dimension.library import GEOMETRY_ERROR, LibraryError
from study.devices.force_dimension.open_rig import read_info
from study.errors import DeviceError

Result = TypeVar("Result")
"""Type of what a function that calls the library returns."""

JOINT_COUNT = 8
"""DHD_MAX_DOF, the length of the library's arrays of joints: those of base, wrist and gripper."""
BASE_JOINTS_MASK = 0b111
"""Bit mask that selects the three joints of the base."""

REACH_TOLERANCE_M = 2e-4
"""A position is out of reach where the position computed from its encoder counts differs by more than this (m). The
encoders resolve about 1e-5 m."""
POSITION_TOLERANCE_M = 1e-3
"""Largest accepted difference (m) between the handle's reported position and that of its reported joint angles."""


class VendorLinkage:
    """Linkage of an opened device, as the vendor's library computes it (a `study.devices.opening.LinkageSource`). Made
    by `open_vendor_linkage`."""

    def __init__(self, handle: Handle, model: DeviceModel, info: DeviceInfo) -> None:
        self.info = info
        self._handle, self._model = handle, model
        self._library, self._number = handle.library, handle.number

    def compute_reading_at(self, position_m: FloatArray) -> LinkageReading | None:
        """Compute joint angles (rad), Jacobian (m/rad), inertia (kg) and holding force (N) at a position (3,), m; None
        out of reach. Raises `DeviceError`."""
        return self._call_library(self._read_linkage, position_m)

    def compute_angles_at(self, position_m: FloatArray) -> FloatArray | None:
        """Compute the joint angles (3,), rad, at a position (3,), m; None where the library reports it as out of
        reach. Raises `DeviceError`."""
        return self._call_library(
            lambda handle_position_m: self._compute_joint_angles(self._compute_encoder_counts(handle_position_m)),
            position_m,
        )

    def check_frame(self) -> None:
        """Check that the linkage functions use the axes of the reported positions: the position of the reported joint
        angles must agree within `POSITION_TOLERANCE_M` with the reported position. Raises `DeviceError` where they
        differ, the position cannot be read, or the handle is out of reach of the model, and `LibraryError` where the
        joint angles cannot be read."""
        try:
            position_m = np.array(self._handle.read_position_m())
        except LibraryError as error:
            raise make_device_error(self._model.name, error) from error
        reading = self.compute_reading_at(position_m)
        joint_angles = (c_double * JOINT_COUNT)()
        self._library.call("dhdGetJointAngles", joint_angles, self._number)
        if (
            reading is not None
            and self._compute_displacement(reading, np.array(joint_angles[:3])) <= POSITION_TOLERANCE_M
        ):
            return
        raise DeviceError(
            f"The linkage of the {self._model.name} was not read",
            "Its library gives another position for the handle than its joint angles do: the handle was moved just "
            "then, or the device's base was given an angle (dhdSetDeviceAngle), which turns its axes.",
            "Leave the handle at rest, and set the base's angle to zero in other programs; then try again.",
        )

    def _compute_displacement(self, reading: LinkageReading, angles: FloatArray) -> float:
        """Compute the distance (m) from the reading's position to that of the joint angles (3,), rad, linearized: |J
        (angles - q)|. Values of the Jacobian that are not finite are replaced (NaN by zero); they are refused later,
        with an error that names them."""
        jacobian = np.nan_to_num(reading.jacobian)
        return float(np.linalg.norm(jacobian @ (angles - reading.joint_angle_rad)))

    def _call_library(
        self, read_library: Callable[[FloatArray], Result | None], position_m: FloatArray
    ) -> Result | None:
        """Call `read_library` for a position (3,), m; None where the library reports it as out of reach. Raises
        `DeviceError` for other failures."""
        try:
            return read_library(position_m)
        except LibraryError as error:
            if error.code == GEOMETRY_ERROR:
                return None
            raise make_device_error(self._model.name, error) from error

    def _compute_encoder_counts(self, position_m: FloatArray) -> list[c_int]:
        """Compute the encoder counts of the base's three joints at a position (3,), m."""
        encoder_counts = [c_int() for _ in range(3)]
        x, y, z = (float(coordinate) for coordinate in position_m)
        self._library.call("dhdDeltaPositionToEncoder", x, y, z, *map(byref, encoder_counts), self._number)
        return encoder_counts

    def _compute_joint_angles(self, encoder_counts: list[c_int]) -> FloatArray:
        """Compute the joint angles (3,), rad, of encoder counts."""
        return self._convert_encoder_counts("dhdDeltaEncodersToJointAngles", *encoder_counts)

    def _read_linkage(self, position_m: FloatArray) -> LinkageReading | None:
        """Compute the reading at a position (3,), m; None where the position of its encoder counts differs by more than
        `REACH_TOLERANCE_M`. The holding force is NaN where the Jacobian is not finite."""
        encoder_counts = self._compute_encoder_counts(position_m)
        encoder_position_m = self._convert_encoder_counts("dhdDeltaEncoderToPosition", *encoder_counts)
        if not float(np.linalg.norm(encoder_position_m - position_m)) <= REACH_TOLERANCE_M:
            return None
        base_angles = self._compute_joint_angles(encoder_counts)
        jacobian_values, inertia_values = (c_double * 9)(), (c_double * 36)()
        self._library.call(
            "dhdDeltaJointAnglesToJacobian", *(float(angle) for angle in base_angles), jacobian_values, self._number
        )
        # For the joints of a wrist, which follow the base's three in the array, the present angles are used.
        joint_angles, gravity_torques = (c_double * JOINT_COUNT)(), (c_double * JOINT_COUNT)()
        self._library.call("dhdGetJointAngles", joint_angles, self._number)
        joint_angles[:3] = [float(angle) for angle in base_angles]
        self._library.call("dhdJointAnglesToInertiaMatrix", joint_angles, inertia_values, self._number)
        self._library.call(
            "dhdJointAnglesToGravityJointTorques", joint_angles, gravity_torques, BASE_JOINTS_MASK, self._number
        )
        jacobian = np.array(jacobian_values).reshape(3, 3)
        gravity_force_n = (
            np.linalg.pinv(jacobian.T) @ np.array(gravity_torques[:3])
            if np.isfinite(jacobian).all()
            else np.full(3, np.nan)
        )
        return LinkageReading(
            np.array(position_m), base_angles, jacobian, np.array(inertia_values).reshape(6, 6)[:3, :3], gravity_force_n
        )

    def _convert_encoder_counts(self, function_name: str, *encoder_counts: c_int) -> FloatArray:
        """Convert three encoder counts by the library's function `function_name`, which computes three numbers: a
        position (m) or joint angles (rad). Returns them, (3,)."""
        values = [c_double() for _ in range(3)]
        self._library.call(function_name, *encoder_counts, *map(byref, values), self._number)
        return np.array([value.value for value in values])


@contextlib.contextmanager
def open_vendor_linkage(name: str) -> Iterator[VendorLinkage]:
    """Context manager that yields the linkage of an open, braked device of this name (`MODELS`), disconnected at the
    end. Raises `DeviceError` where the device cannot be opened, is not calibrated, or the library fails."""
    model, library = MODELS[name], load_library()
    handle = open_model(library, model)
    try:
        info = read_info(handle, library, model, read_lab_settings().effective_mass_kg)
        library.call("dhdEnableExpertMode")
        if not handle.read_status().calibrated:
            raise DeviceError(
                f"The {model.name} is not calibrated", "It does not know where its handle is.", CALIBRATION_ADVICE
            )
        yield VendorLinkage(handle, model, info)
    except LibraryError as error:
        raise make_device_error(model.name, error) from error
    finally:
        handle.disconnect()
