"""An opened device: the library's functions bound to its number, with values instead of pointers."""

import contextlib
import math
import time
from ctypes import byref, c_double, c_int, c_ubyte, c_ushort
from dataclasses import dataclass

from study.devices.force_dimension.library import Library, LibraryError

STALE, SCALED = 1, 2
"""dhdGetPosition answers STALE where it repeats an earlier reading; dhdSetForce answers SCALED where the device cannot
give that force and gives less of it, in the same direction."""

WATCHDOG_UNIT_S = 125e-6
"""Unit of dhdSetWatchdog's and dhdGetWatchdog's argument (s)."""
STATUS_SIZE = 32
"""Entries of the array for dhdGetStatus: 17 in SDK 3.17.5, and room for more, since a library writes as many as it
knows."""

NO_SERIAL = 0xFFFF
"""Serial number that no device has: not known."""

POWERED_PLACE, CALIBRATED_PLACE, FORCE_ON_PLACE, BRAKING_PLACE, OFF_CAUSE_PLACE = 0, 3, 5, 6, 14
"""Indices in the library's status array."""

UNPOWERED_CAUSE, UNCALIBRATED_CAUSE, BRAKED_CAUSE = 101, 102, 103
"""Causes that the library has no code for: it reports forces as on, and these causes in other entries of the status."""
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
"""Words for the causes of forces being off: the library's codes, and the three above."""
WATCHDOG_CAUSE = 3
"""The library's code for forces that the device's watchdog switched off."""

STOP_ATTEMPTS = 3
"""Attempts to stop a device whose connection fails. By hand."""
BRAKED_WITHIN_S = 0.02
"""Longest wait after each attempt for the status "braking" (s): a status may be some transfers old. By hand."""


def describe_off_cause(cause: int) -> str:
    """Words for a cause by which the device's force is off, as in `Status.off_cause`."""
    return OFF_CAUSES.get(cause, "the device does not say why")


@dataclass(frozen=True, slots=True)
class Status:
    """State of the device as reported by dhdGetStatus."""

    powered: bool
    calibrated: bool
    force_on: bool
    braking: bool
    off_cause: int
    """Why the force is off, 0 where that is not known."""

    @property
    def off_reason(self) -> str:
        """The cause in words. Brakes that are on while the device reports forces as on are a cause of their own."""
        return describe_off_cause(BRAKED_CAUSE if self.force_on and self.braking else self.off_cause)

    @property
    def gives_forces(self) -> bool:
        """Whether forces reach the handle."""
        return self.force_on and not self.braking


class Handle:
    """An open device: the vendor's functions with values in place of pointers. Every method but `disconnect` raises
    `LibraryError`."""

    def __init__(self, library: Library, number: int) -> None:
        self.library = library
        self.number = number
        self._set_force = library.function("dhdSetForce")
        self._open = True

    def position_m(self) -> tuple[float, float, float]:
        """Position of the handle (m), x, y, z, in the device's axes."""
        return self._read_vector("dhdGetPosition")

    def velocity_mps(self) -> tuple[float, float, float]:
        """Velocity of the handle (m/s), x, y, z, as the library estimates it over its last 20 ms."""
        return self._read_vector("dhdGetLinearVelocity")

    def set_force(self, x_n: float, y_n: float, z_n: float) -> bool:
        """Set the force (N). Returns whether the device gives less of it. May be called from any thread."""
        return self.library.check_answer("dhdSetForce", self._set_force(x_n, y_n, z_n, self.number)) == SCALED

    def force_n(self) -> tuple[float, float, float]:
        """Force (N), x, y, z, that the device reports to give now."""
        return self._read_vector("dhdGetForce")

    def _read_vector(self, function: str) -> tuple[float, float, float]:
        x, y, z = c_double(), c_double(), c_double()
        self.library.call(function, byref(x), byref(y), byref(z), self.number)
        return x.value, y.value, z.value

    def status(self) -> Status:
        """State of the device: powered, calibrated, force on, braking, and why the force is off."""
        values = (c_int * STATUS_SIZE)()
        self.library.call("dhdGetStatus", values, self.number)
        return Status(
            powered=bool(values[POWERED_PLACE]),
            calibrated=bool(values[CALIBRATED_PLACE]),
            force_on=bool(values[FORCE_ON_PLACE]),
            braking=bool(values[BRAKING_PLACE]),
            off_cause=int(values[OFF_CAUSE_PLACE]),
        )

    def system_type(self) -> int:
        """The library's number of the device's model."""
        return self.library.call("dhdGetSystemType", self.number)

    def system_name(self) -> str:
        """The library's name of the device's model; "unnamed" where it has none."""
        return (self.library.function("dhdGetSystemName")(self.number) or b"unnamed").decode("utf-8", "replace")

    def serial(self) -> int:
        """Serial number; `NO_SERIAL` where the library has none."""
        number = c_ushort(NO_SERIAL)
        self.library.call("dhdGetSerialNumber", byref(number), self.number)
        return number.value

    def firmware(self) -> float:
        """Version of the firmware; NaN where the library has none."""
        version = c_double(math.nan)
        self.library.call("dhdGetVersion", byref(version), self.number)
        return version.value

    def enable_force(self) -> None:
        """Release the brakes and let the device follow commands, with a force of zero."""
        self.library.call("dhdSetBrakes", 0, self.number)
        self.library.call("dhdEnableForce", 1, self.number)
        self.set_force(0.0, 0.0, 0.0)

    def compensate_gravity(self, effector_mass_kg: float | None) -> None:
        """Switch gravity compensation on. effector_mass_kg: mass of the end effector; None leaves the library's own."""
        if effector_mass_kg is not None:
            self.library.call("dhdSetEffectorMass", effector_mass_kg, self.number)
        self.library.call("dhdSetGravityCompensation", 1, self.number)

    def limit_force(self, newtons: float) -> None:
        """Cap of the library itself on the norm of the force (N)."""
        self.library.call("dhdSetMaxForce", newtons, self.number)

    def disable_time_guard(self) -> None:
        """Take a new reading at every call: by default the library repeats a reading that is only a moment old, and the
        1 kHz loop keeps its own time."""
        self.library.call("dhdEnableExpertMode")
        self.library.call("dhdSetTimeGuard", 0, self.number)

    def arm_watchdog(self, seconds: float) -> float:
        """Arm the device's watchdog, which switches the force off when no command follows in time. seconds: at most
        0.0318 (255 units). Returns the time that the device reports (s); 0 where it has no watchdog: a force then stays
        on."""
        self.library.call("dhdEnableExpertMode")
        units = c_ubyte()
        try:
            self.library.call("dhdSetWatchdog", round(seconds / WATCHDOG_UNIT_S), self.number)
            self.library.call("dhdGetWatchdog", byref(units), self.number)
        except LibraryError:
            return 0.0
        return units.value * WATCHDOG_UNIT_S

    def calibrate(self, patience_s: float) -> None:
        """Wait, for patience_s at most, until the handle was put to its rest position, and take that as reference."""
        self.library.call("dhdReset", self.number)
        self.library.call("dhdWaitForReset", round(1000 * patience_s), self.number)

    def disconnect(self) -> bool:
        """Set zero force, brake and close the device. Returns whether the device confirmed that it brakes. Never
        raises; may be called again."""
        if not self._open:
            return True
        is_braked = any(self._stop_once() for _ in range(STOP_ATTEMPTS))
        with contextlib.suppress(LibraryError):
            self.library.call("dhdClose", self.number)
            self._open = False
        return is_braked

    def _stop_once(self) -> bool:
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
        """Whether the device reports within `BRAKED_WITHIN_S` that it brakes. Raises `LibraryError`."""
        until_s = time.monotonic() + BRAKED_WITHIN_S
        while (status := self.status()).force_on or not status.braking:
            if time.monotonic() > until_s:
                return False
            time.sleep(BRAKED_WITHIN_S / 10)
        return True
