"""A device of the vendor as a rig: readings, forces, and all that makes it let go.

Beyond what the safety layer does, a force above the cap or no number never leaves this file, and the library is told
the cap as well. Anything odd ends in an error: the safety layer then writes zero, and the watchdog sees to the rest.
"""

import math
import threading
import time
from typing import Protocol

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo
from study.devices.force_dimension.handle import WATCHDOG_CAUSE, Handle
from study.devices.force_dimension.library import LibraryError
from study.devices.rig import ACCELERATION, POSITION, READING_SIZE, SENSOR_CLIPPED
from study.errors import DeviceError

LOOK_EVERY = 10
"""Readings: how often status and buttons are asked for. 100 times a second: a person cannot press faster."""

STALE_FOR, STALE_SHARE = 50, 0.5
"""Readings that only repeat an earlier one: so many in a row, or as many beyond this share of all readings, end the
force. At 1 kHz half of what counts as a lost loop."""

SCALED_FOR, SCALED_SHARE = 5, 0.02
"""The same of forces that the device cannot give in full: what a participant feels is then not what is written down.
A force whose peaks alone are scaled is so only for some milliseconds in a row, again and again."""

ROUNDING = 1 + 1e-9
LOCK_S = 0.002
"""A write lasts a tenth of that: what waits longer waits for a call that hangs."""

REST_SHARE = 0.25
"""Share of the watchdog's time between two zeros while nothing is played."""


class Accelerometer(Protocol):
    """A sensor at the handle, read by a thread of its own."""

    def latest(self) -> tuple[FloatArray, bool]:
        """Acceleration (3,), m/s², NaN where there is none of now; whether a channel is at its limit. Cheap."""
        ...

    def close(self) -> None:
        """Never raises; may be called again."""
        ...


class ForceDimensionRig:
    """cap_n: no force above it is ever sent. rests: repeat the zero while nothing is played, in a thread, so that
    gravity stays compensated; without it the device brakes between stimuli."""

    def __init__(
        self,
        handle: Handle,
        info: DeviceInfo,
        drops_force_after_s: float,
        cap_n: float,
        accelerometer: Accelerometer | None = None,
        rests: bool = True,
    ) -> None:
        self.info = info
        self.drops_force_after_s = drops_force_after_s
        self._handle = handle
        self._cap_n = min(cap_n, info.max_force_n)
        self._accelerometer = accelerometer
        self._reads = 0
        self._stale = self._scaled = 0.0
        self._pressed: frozenset[int] = frozenset()
        self._sending = threading.Lock()
        self._sent_s, self._sent_zero = time.monotonic(), True
        self._withheld_until_s = 0.0
        self._failure: DeviceError | None = None
        self._closed, self._let_go = threading.Event(), False
        if rests and drops_force_after_s > 0:
            threading.Thread(target=self._rest, name="gravity compensation", daemon=True).start()

    def sense(self) -> FloatArray:
        if self._failure is not None:
            raise self._failure
        reading = np.full(READING_SIZE, np.nan)
        try:
            repeated = self._handle.read_position(reading[POSITION])
            if self._reads % LOOK_EVERY == 0:
                self._look()
        except LibraryError as error:
            raise self._fail(f"The library says: {error}") from error
        self._reads += 1
        self._stale = _beyond(self._stale, repeated, STALE_SHARE)
        if self._stale >= STALE_FOR * (1.0 - STALE_SHARE):
            raise self._fail("It repeats its last position again and again")
        reading[SENSOR_CLIPPED] = 0.0
        if self._accelerometer is not None:
            reading[ACCELERATION], clipped = self._accelerometer.latest()
            reading[SENSOR_CLIPPED] = float(clipped)
        return reading

    def buttons(self) -> frozenset[int]:
        return self._pressed

    def write(self, force_n: FloatArray) -> None:
        x, y, z = (float(component) for component in force_n)
        if time.monotonic() < self._withheld_until_s:
            return
        norm = math.sqrt(x * x + y * y + z * z)
        if norm == 0.0:
            self._write_zero()
            return
        if not norm <= self._cap_n * ROUNDING:
            self._write_zero()
            raise self._fail(f"A force of {norm:g} N was refused; at most {self._cap_n:g} N may be sent")
        if self._failure is not None:
            raise self._failure
        if not self._sending.acquire(timeout=LOCK_S):
            raise self._fail("An earlier force is still being sent")
        try:
            if self._closed.is_set():
                raise self._fail("It is closed")
            self._send(x, y, z)
        finally:
            self._sending.release()

    def withhold(self, seconds: float) -> float:
        """Simulates a stopped loop: sends nothing for this long, not even zeros. Returns the time of the last force,
        s."""
        with self._sending:
            self._withheld_until_s = time.monotonic() + seconds
            return self._sent_s

    def force_on(self) -> bool:
        """Whether the device takes forces just now, as it says. From any thread. Raises `DeviceError`."""
        try:
            return self._handle.status().force_on
        except LibraryError as error:
            raise self._fail(f"The library says: {error}") from error

    def close(self) -> None:
        self._withheld_until_s = 0.0
        self._closed.set()
        got = self._sending.acquire(timeout=LOCK_S)
        try:
            self._let_go = self._handle.let_go()
        finally:
            if got:
                self._sending.release()
            if self._accelerometer is not None:
                self._accelerometer.close()

    def _send(self, x: float, y: float, z: float) -> None:
        """Only with `_sending`."""
        try:
            if self._silent_for_too_long():
                self._wake()
            scaled = self._handle.set_force(x, y, z)
        except LibraryError as error:
            raise self._fail(f"The library says: {error}") from error
        self._sent_s, self._sent_zero = time.monotonic(), x == y == z == 0.0
        self._scaled = _beyond(self._scaled, scaled, SCALED_SHARE)
        if self._scaled >= SCALED_FOR * (1.0 - SCALED_SHARE):
            raise self._fail("Its motors cannot give the force that is asked for, and give less")

    def _write_zero(self) -> None:
        """Past everything: neither a lock nor an earlier failure may hold up a zero. It wakes no sleeping device."""
        if self._let_go:
            return
        got = self._sending.acquire(timeout=LOCK_S)
        try:
            self._handle.set_force(0.0, 0.0, 0.0)
            if not self._sent_zero and self._silent_for_too_long() and not (status := self._handle.status()).force_on:
                # A force was cut off: its call may hang still, and must find a device that takes none.
                self._fail(f"It let its force go: {status.why_off}")
            self._sent_zero, self._scaled = True, 0.0
            if not self._silent_for_too_long():
                self._sent_s = time.monotonic()
        except LibraryError as error:
            raise self._fail(f"The library says: {error}") from error
        finally:
            if got:
                self._sending.release()

    def _silent_for_too_long(self) -> bool:
        return time.monotonic() - self._sent_s > self.drops_force_after_s > 0

    def _look(self) -> None:
        mask = self._handle.button_mask()
        self._pressed = frozenset(bit for bit in range(32) if mask >> bit & 1)
        status = self._handle.status()
        if not status.force_on and not (self._sent_zero and status.off_cause == WATCHDOG_CAUSE):
            raise self._fail(f"It let its force go: {status.why_off}")

    def _wake(self) -> None:
        """After a silence that was longer than the watchdog. In the middle of a force that is an end; with none it is
        not: the computer was asleep, or nothing was played."""
        status = self._handle.status()
        if status.force_on:
            return
        if not (self._sent_zero and status.off_cause == WATCHDOG_CAUSE):
            raise self._fail(f"It let its force go: {status.why_off}")
        self._handle.enable_force()

    def _rest(self) -> None:
        """Only ever repeats a zero: never sends one between two forces, nor anything after a failure."""
        every_s = REST_SHARE * self.drops_force_after_s
        while not self._closed.wait(every_s) and self._failure is None:
            with self._sending:
                if self._sent_zero and not self._closed.is_set() and time.monotonic() - self._sent_s >= every_s:
                    try:
                        self._send(0.0, 0.0, 0.0)
                    except DeviceError:
                        return

    def _fail(self, happened: str) -> DeviceError:
        """The first failure stays: the next call says the same."""
        if self._failure is None:
            self._failure = DeviceError(
                f"The {self.info.name} let go",
                f"{happened}.",
                "Check its power and its cable, then open it again; a session goes on with `hapteq resume`.",
            )
        return self._failure


def _beyond(count: float, happened: bool, share: float) -> float:
    """How often something happened beyond this share of all times. A hair below the sum of its steps."""
    return max(0.0, count + (1.0 if happened else 0.0) - share + 1e-12)
