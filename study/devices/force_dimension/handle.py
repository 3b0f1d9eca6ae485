"""An opened device (a software handle, not the grip in the hand): the vendor library's functions for its number, with
values in place of pointers.

Opened by `connect.open_model`. `rig` uses it outside the compiled ticks; the constants are also those of `tick_io` and
`loop_cells`. The functions are those of Force Dimension's DHD (SDK 3.17.5).
"""

import contextlib
import math
import time
from ctypes import byref, c_double, c_int, c_ubyte, c_ushort
from dataclasses import dataclass

from study.devices.force_dimension.library import Library, LibraryError

REPEATED_READING, SCALED_FORCE = 1, 2
"""Return values of success with a notice. dhdGetPosition returns REPEATED_READING where it repeats an earlier reading;
dhdSetForce returns SCALED_FORCE where the device cannot exert that force and exerts less, in the same direction."""

WATCHDOG_UNIT_S = 125e-6
"""Unit of dhdSetWatchdog's and dhdGetWatchdog's argument (s)."""
STATUS_ARRAY_SIZE = 32
"""Entries of the array for dhdGetStatus: 17 in SDK 3.17.5, and room for more, because other versions may write more
entries."""

UNKNOWN_SERIAL = 0xFFFF
"""Serial number that no device has: the number is not known."""

POWERED_INDEX, CALIBRATED_INDEX, FORCE_ON_INDEX, BRAKING_INDEX, OFF_CAUSE_INDEX = 0, 3, 5, 6, 14
"""Indices in the array of dhdGetStatus."""

UNPOWERED_CAUSE, UNCALIBRATED_CAUSE, BRAKED_CAUSE = 101, 102, 103
"""Causes for which the library has no code: it reports these conditions in other entries of the status."""
OFF_CAUSES = {
    1: "a button of the device was pressed",
    2: "the handle moved faster than the device allows",
    3: "the program came too late for the device's watchdog",
    4: "a program switched it off",
    5: "the USB connection broke",
    6: "the hand was not on the handle (dead-man's switch)",
    UNPOWERED_CAUSE: "its power supply is off",
    UNCALIBRATED_CAUSE: "it does not know its place any more, and needs to be calibrated",
    BRAKED_CAUSE: "its brakes are on",
}
"""Text for each cause of forces being off: the library's codes, and the three above."""
WATCHDOG_CAUSE = 3
"""The library's code for forces that the device's watchdog switched off."""

MAX_STOP_ATTEMPTS = 3
"""Largest number of attempts to stop a device whose connection fails. Chosen by hand."""
BRAKING_TIMEOUT_S = 0.02
"""Longest wait after each attempt for the status "braking" (s), because a status may be a few transfers old. Chosen by
hand."""


def describe_off_cause(cause: int) -> str:
    """Describe the cause by which the device's force is off. cause: a code of `OFF_CAUSES`, or any other."""
    return OFF_CAUSES.get(cause, "the device does not say why")


@dataclass(frozen=True, slots=True)
class Status:
    """State of the device as reported by dhdGetStatus."""

    powered: bool
    calibrated: bool
    force_on: bool
    braking: bool
    off_cause: int
    """Code of the cause for which the force is off (`OFF_CAUSES`); 0 where that is not known."""

    @property
    def off_reason(self) -> str:
        """Cause for which no force acts, as text; `BRAKED_CAUSE` where the forces are on but the brakes are on too."""
        return describe_off_cause(BRAKED_CAUSE if self.force_on and self.braking else self.off_cause)

    @property
    def gives_forces(self) -> bool:
        """Whether forces reach the handle: they are on, and the brakes are off."""
        return self.force_on and not self.braking


class Handle:
    """An open device. Methods raise `LibraryError` where the library reports a failure, except `disconnect`,
    `read_system_name` and, for a missing watchdog, `arm_watchdog`."""

    def __init__(self, library: Library, number: int) -> None:
        self.library = library
        self.number = number
        self._set_force = library.get_function("dhdSetForce")
        self._open = True

    def read_position_m(self) -> tuple[float, float, float]:
        """Read the position of the handle (m), x, y, z, in the device's axes."""
        return self._read_vector("dhdGetPosition")

    def read_velocity_mps(self) -> tuple[float, float, float]:
        """Read the velocity of the handle (m/s), x, y, z, which the library estimates over the last 20 ms."""
        return self._read_vector("dhdGetLinearVelocity")

    def set_force(self, x_n: float, y_n: float, z_n: float) -> bool:
        """Set the force (N). Returns whether the device exerts less than it. May be called from any thread."""
        return (
            self.library.check_return_value("dhdSetForce", self._set_force(x_n, y_n, z_n, self.number)) == SCALED_FORCE
        )

    def read_force_n(self) -> tuple[float, float, float]:
        """Read the force (N), x, y, z, that the device reports as acting now."""
        return self._read_vector("dhdGetForce")

    def _read_vector(self, function_name: str) -> tuple[float, float, float]:
        """Call a function of the library that writes three numbers x, y and z."""
        x, y, z = c_double(), c_double(), c_double()
        self.library.call(function_name, byref(x), byref(y), byref(z), self.number)
        return x.value, y.value, z.value

    def read_status(self) -> Status:
        """Read the state of the device: powered, calibrated, force on, braking, and the cause of a force that is
        off."""
        status_array = (c_int * STATUS_ARRAY_SIZE)()
        self.library.call("dhdGetStatus", status_array, self.number)
        return Status(
            powered=bool(status_array[POWERED_INDEX]),
            calibrated=bool(status_array[CALIBRATED_INDEX]),
            force_on=bool(status_array[FORCE_ON_INDEX]),
            braking=bool(status_array[BRAKING_INDEX]),
            off_cause=int(status_array[OFF_CAUSE_INDEX]),
        )

    def read_system_type(self) -> int:
        """Read the library's number of the device's model."""
        return self.library.call("dhdGetSystemType", self.number)

    def read_system_name(self) -> str:
        """Read the library's name of the device's model; "unnamed" where it has none."""
        return (self.library.get_function("dhdGetSystemName")(self.number) or b"unnamed").decode("utf-8", "replace")

    def read_serial_number(self) -> int:
        """Read the serial number; `UNKNOWN_SERIAL` where the library writes none."""
        serial_number = c_ushort(UNKNOWN_SERIAL)
        self.library.call("dhdGetSerialNumber", byref(serial_number), self.number)
        return serial_number.value

    def read_firmware_version(self) -> float:
        """Read the version of the firmware; NaN where the library writes none."""
        version = c_double(math.nan)
        self.library.call("dhdGetVersion", byref(version), self.number)
        return version.value

    def enable_force(self) -> None:
        """Release the brakes and let the device follow commands, with a force of zero."""
        self.library.call("dhdSetBrakes", 0, self.number)
        self.library.call("dhdEnableForce", 1, self.number)
        self.set_force(0.0, 0.0, 0.0)

    def compensate_gravity(self, effector_mass_kg: float | None) -> None:
        """Switch gravity compensation on. effector_mass_kg: mass of the end effector; None keeps the library's
        default."""
        if effector_mass_kg is not None:
            self.library.call("dhdSetEffectorMass", effector_mass_kg, self.number)
        self.library.call("dhdSetGravityCompensation", 1, self.number)

    def limit_force(self, cap_n: float) -> None:
        """Set the cap of the library on the norm of the force (N)."""
        self.library.call("dhdSetMaxForce", cap_n, self.number)

    def disable_time_guard(self) -> None:
        """Switch off the minimum interval between readings, so that every call takes a new reading: by default the
        library repeats a reading that is younger than this interval, and the 1 kHz loop already sets the interval."""
        self.library.call("dhdEnableExpertMode")
        self.library.call("dhdSetTimeGuard", 0, self.number)

    def arm_watchdog(self, timeout_s: float) -> float:
        """Arm the device's watchdog, which switches the force off when no command follows in time. timeout_s: at most
        0.0318 s (255 units). Returns the timeout that the device reports (s); 0 where it has no watchdog: a force then
        stays on."""
        self.library.call("dhdEnableExpertMode")
        timeout_units = c_ubyte()
        try:
            self.library.call("dhdSetWatchdog", round(timeout_s / WATCHDOG_UNIT_S), self.number)
            self.library.call("dhdGetWatchdog", byref(timeout_units), self.number)
        except LibraryError:
            return 0.0
        return timeout_units.value * WATCHDOG_UNIT_S

    def calibrate(self, timeout_s: float) -> None:
        """Wait, for timeout_s at most, until the handle is in its rest position, and take that as reference.
        Raises `LibraryError` after the timeout."""
        self.library.call("dhdReset", self.number)
        self.library.call("dhdWaitForReset", round(1000 * timeout_s), self.number)

    def disconnect(self) -> bool:
        """Set zero force, brake and close the device. Returns whether the device confirmed that it brakes; True if it
        was closed before. Never raises; may be called again."""
        if not self._open:
            return True
        is_braked = any(self._stop_once() for _ in range(MAX_STOP_ATTEMPTS))
        with contextlib.suppress(LibraryError):
            self.library.call("dhdClose", self.number)
            self._open = False
        return is_braked

    def _stop_once(self) -> bool:
        """Set zero force and brake. Returns whether the device confirmed that it brakes; False where the library
        fails."""
        with contextlib.suppress(LibraryError):
            self.set_force(0.0, 0.0, 0.0)
        with contextlib.suppress(LibraryError):
            self.library.call("dhdSetBrakes", 1, self.number)
        try:
            self.library.call("dhdStop", self.number)
            return self._is_braked()
        except LibraryError:
            return False

    def _is_braked(self) -> bool:
        """Whether the device reports within `BRAKING_TIMEOUT_S` that its force is off and it brakes. Raises
        `LibraryError`."""
        deadline_s = time.monotonic() + BRAKING_TIMEOUT_S
        while (status := self.read_status()).force_on or not status.braking:
            if time.monotonic() > deadline_s:
                return False
            time.sleep(BRAKING_TIMEOUT_S / 10)
        return True
