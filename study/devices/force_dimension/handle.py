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
"""17 in SDK 3.17.5; room for more, since a library writes as many as it knows."""

NO_SERIAL = 0xFFFF
"""No device's serial number."""

POWERED_PLACE, CALIBRATED_PLACE, FORCE_ON_PLACE, BRAKING_PLACE, OFF_CAUSE_PLACE = 0, 3, 5, 6, 14
"""Indices in the library's status array."""

UNPOWERED_CAUSE, UNCALIBRATED_CAUSE, BRAKED_CAUSE = 101, 102, 103
"""Causes of our own: the library states them in other places of the status, and that its forces are on."""
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
"""Words for the library's codes of why the forces are off, and for those of our own."""
WATCHDOG_CAUSE = 3
"""The library's code for forces that the device's watchdog switched off."""

TRIES = 3
"""Attempts to stop a device whose connection fails."""
BRAKED_S = 0.02
"""Longest wait, after each, for the device to say that it brakes (s): its status may be some transfers old."""


def why_off(cause: int) -> str:
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
    def why_off(self) -> str:
        """In words; brakes that are on while the device says that its forces are, are a cause of their own."""
        return why_off(BRAKED_CAUSE if self.force_on and self.braking else self.off_cause)

    @property
    def gives_forces(self) -> bool:
        """Whether forces reach the handle."""
        return self.force_on and not self.braking


class Handle:
    """An open device: the vendor's functions with values in place of pointers. Raises `LibraryError` from every method
    but `let_go`."""

    def __init__(self, library: Library, number: int) -> None:
        self.library = library
        self.number = number
        self._set_force = library.function("dhdSetForce")
        self._open = True

    def position_m(self) -> tuple[float, float, float]:
        """Position of the handle (m), x, y, z, in the device's axes."""
        return self._read_vector("dhdGetPosition")

    def velocity_mps(self) -> tuple[float, float, float]:
        """Velocity as estimated by the library, over its last 20 ms."""
        return self._read_vector("dhdGetLinearVelocity")

    def set_force(self, x_n: float, y_n: float, z_n: float) -> bool:
        """Whether the device gives less than that. From any thread."""
        return self.library.check_answer("dhdSetForce", self._set_force(x_n, y_n, z_n, self.number)) == SCALED

    def force_n(self) -> tuple[float, float, float]:
        """What the device says that it gives now."""
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
        """`NO_SERIAL` where the library answers and says none."""
        number = c_ushort(NO_SERIAL)
        self.library.call("dhdGetSerialNumber", byref(number), self.number)
        return number.value

    def firmware(self) -> float:
        """NaN where the library answers and says none."""
        version = c_double(math.nan)
        self.library.call("dhdGetVersion", byref(version), self.number)
        return version.value

    def enable_force(self) -> None:
        """Zero force, from now on taken."""
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

    def read_every_time(self) -> None:
        """No reading is repeated because the last was a moment ago: a loop that keeps its own time wants each."""
        self.library.call("dhdEnableExpertMode")
        self.library.call("dhdSetTimeGuard", 0, self.number)

    def arm_watchdog(self, seconds: float) -> float:
        """Arm the watchdog. Returns for how long the device now holds a force that no other follows, in s, as the
        device reports it; 0: for ever."""
        self.library.call("dhdEnableExpertMode")
        units = c_ubyte()
        try:
            self.library.call("dhdSetWatchdog", round(seconds / WATCHDOG_UNIT_S), self.number)
            self.library.call("dhdGetWatchdog", byref(units), self.number)
        except LibraryError:
            return 0.0
        return units.value * WATCHDOG_UNIT_S

    def calibrate(self, patience_s: float) -> None:
        """Wait until the handle was put where it rests, and take that as its place."""
        self.library.call("dhdReset", self.number)
        self.library.call("dhdWaitForReset", round(1000 * patience_s), self.number)

    def let_go(self) -> bool:
        """Zero force, brakes, disconnect. Whether the device took it and says so. Never raises; may be called
        again."""
        if not self._open:
            return True
        stopped = any(self._stop_once() for _ in range(TRIES))
        with contextlib.suppress(LibraryError):
            self.library.call("dhdClose", self.number)
            self._open = False
        return stopped

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
        """Whether the device says so, within `BRAKED_S`. Raises `LibraryError`."""
        until_s = time.monotonic() + BRAKED_S
        while (status := self.status()).force_on or not status.braking:
            if time.monotonic() > until_s:
                return False
            time.sleep(BRAKED_S / 10)
        return True
