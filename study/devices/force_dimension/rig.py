"""A Force Dimension device as a `Rig`: readings, forces, and every way to release its force.

The compiled functions of `tick_io` do the reading and writing; this class owns their memory cells, the threads and the
errors. In addition to the safety layer, `tick_io` never sends a force whose norm is above the cap or NaN. Any failure
is raised as a `DeviceError`: the safety layer then writes a zero force, and if that fails too, the device's watchdog,
if it has one, switches the force off. Made by `open_rig`; the acceptance test (`force_limit_check`) also calls
`is_force_on`, `read_reported_n`, `read_reported_without_cap_n` and `withhold`. The names of the other methods are those
of the interfaces of `study.devices.rig`, which drivers of other devices implement, too.
"""

import contextlib
import math
import threading
import time
from typing import Protocol

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo
from study.devices.drive.real_time_class import request_real_time_class
from study.devices.force_dimension import loop_cells, tick_io
from study.devices.force_dimension.handle import Handle, describe_off_cause
from study.devices.force_dimension.library import LibraryError
from study.devices.force_dimension.tick_io import LOCK_S
from study.devices.native import SharedLock, collect_system_calls
from study.devices.rig import ACCELERATION, READING_SIZE, SENSOR_CLIPPED, CompiledIo, SensedAcceleration
from study.errors import DeviceError

ZERO_INTERVAL_SHARE = 0.25
"""Interval between two zero forces while nothing is played, as a share of the watchdog's timeout. Chosen."""

JOIN_TIMEOUT_S = 0.5
"""Longest wait (s) for the thread that repeats zeros to end: half of what a caller waits for a device to close."""


class Accelerometer(Protocol):
    """Interface of an acceleration sensor at the handle that is read by a separate thread, such as
    `study.devices.accelerometer.sensor.Accelerometer`. One with an attribute `samples` is also read by compiled
    code."""

    def read_latest(self) -> tuple[FloatArray, bool]:
        """Newest acceleration (3,), m/s², NaN without a fresh sample, and whether a channel is at its limit. Fast
        enough for every tick."""
        ...

    def sensed(self, since_s: float, tick_s: FloatArray, rate_hz: float) -> SensedAcceleration | None:
        """Accelerations at past ticks: as `study.devices.rig.AsynchronousAccelerometer.sensed`."""
        ...

    def close(self) -> None:
        """Stop reading. Never raises; may be called again."""
        ...


class ForceDimensionRig:
    """An opened device. drops_force_after_s: timeout of its watchdog (s), 0 = none. cap_n: largest norm of a force that
    `write` sends (N). repeats_zero: repeat the zero force in a thread while nothing is played, so that gravity stays
    compensated (only for a device with a watchdog); without it, the watchdog lets the device brake between stimuli."""

    def __init__(
        self,
        handle: Handle,
        info: DeviceInfo,
        drops_force_after_s: float,
        cap_n: float,
        accelerometer: Accelerometer | None = None,
        repeats_zero: bool = True,
    ) -> None:
        self.info = info
        self.drops_force_after_s = drops_force_after_s
        self._handle = handle
        self._accelerometer = accelerometer
        self._send_lock = SharedLock()
        self._calls = np.concatenate(
            [collect_system_calls(self._send_lock), handle.library.find_addresses(loop_cells.VENDOR_CALLS)]
        )
        self._cells: FloatArray = np.zeros(loop_cells.CELLS_SIZE)
        self._cells[loop_cells.DEVICE_NUMBER] = handle.number
        self._cells[loop_cells.CAP_N] = min(cap_n, info.max_force_n)
        self._cells[loop_cells.DROPS_AFTER_S] = drops_force_after_s
        # The time of the last zero is unknown: with a watchdog, the first force then checks the status of the device.
        self._cells[loop_cells.SENT_S], self._cells[loop_cells.SENT_ZERO] = -math.inf, 1.0
        sensor_rows: FloatArray | None = getattr(accelerometer, "samples", None)
        self._samples: FloatArray = np.zeros((1, 1)) if sensor_rows is None else sensor_rows
        self._uncompiled_accelerometer = accelerometer if sensor_rows is None else None
        self._failure: DeviceError | None = None
        self._closed = threading.Event()
        self._zero_thread = threading.Thread(target=self._repeat_zero_force, name="gravity compensation", daemon=True)
        if repeats_zero and drops_force_after_s > 0:
            self._zero_thread.start()

    @property
    def compiled_io(self) -> CompiledIo | None:
        """The compiled `sense` and `write`; None with an accelerometer that compiled code cannot read."""
        if self._uncompiled_accelerometer is not None:
            return None
        return CompiledIo(
            tick_io.sense_once, tick_io.write_once, self._calls, self._cells, self._samples, self._get_error
        )

    def sense(self) -> FloatArray:
        """Reading, shape (READING_SIZE,), with the newest acceleration; NaN without a fresh sample. Raises
        `DeviceError` where the device fails or only repeats its position."""
        reading = np.empty(READING_SIZE)
        self._raise_for_code(tick_io.sense_once(self._calls, self._cells, self._samples, reading))
        if self._uncompiled_accelerometer is not None:
            reading[ACCELERATION], is_clipped = self._uncompiled_accelerometer.read_latest()
            reading[SENSOR_CLIPPED] = float(is_clipped)
        return reading

    def buttons(self) -> frozenset[int]:
        """Numbers of the pressed buttons, from 0, at the last status check."""
        mask = int(self._cells[loop_cells.BUTTON_MASK])
        return frozenset(bit for bit in range(32) if mask >> bit & 1)

    def write(self, force_n: FloatArray) -> None:
        """Command a force (3,), N. A zero force is sent even after a failure. Raises `DeviceError` where sending fails,
        for another force after a failure, and for one above the cap or NaN, in place of which a zero is sent."""
        self._raise_for_code(tick_io.write_once(self._calls, self._cells, np.array(force_n, dtype=np.float64)))

    def sensed(self, since_s: float, tick_s: FloatArray, rate_hz: float) -> SensedAcceleration | None:
        """Accelerations at past ticks, as `study.devices.rig.AsynchronousAccelerometer.sensed`; None without an
        accelerometer."""
        return None if self._accelerometer is None else self._accelerometer.sensed(since_s, tick_s, rate_hz)

    def withhold(self, seconds: float) -> float:
        """Simulate a stopped control loop, to test the watchdog: `write` sends nothing for this time (s), not even
        zeros. Returns the time of the last force (s, monotonic clock)."""
        with self._send_lock:
            self._cells[loop_cells.WITHHELD_UNTIL_S] = time.monotonic() + seconds
            return float(self._cells[loop_cells.SENT_S])

    def is_force_on(self) -> bool:
        """Whether the device reports that its forces are on. May be called from any thread. Raises `DeviceError`."""
        try:
            return self._handle.read_status().force_on
        except LibraryError as error:
            raise self._record_failure(f"The library says: {error}") from error

    def read_reported_n(self) -> float:
        """Read the norm of the horizontal force (N) that the device reports at this moment; the vertical force is left
        out, because it may compensate gravity. Raises `DeviceError`."""
        try:
            x, y, _ = self._handle.read_force_n()
        except LibraryError as error:
            raise self._record_failure(f"The library says: {error}") from error
        return math.hypot(x, y)

    def read_reported_without_cap_n(self, asked_n: float) -> float:
        """Send `asked_n` (N) along x without the cap of this rig, to test the cap of the library, and read the norm of
        the horizontal force (N) that the device then reports; a zero follows at once. Only for the acceptance test of a
        device, with no hand on the handle. Raises `DeviceError`."""
        with self._send_lock:
            try:
                self._handle.set_force(asked_n, 0.0, 0.0)
                return self.read_reported_n()
            except LibraryError as error:
                raise self._record_failure(f"The library says: {error}") from error
            finally:
                with contextlib.suppress(LibraryError):
                    self._handle.set_force(0.0, 0.0, 0.0)

    def close(self) -> bool:
        """Release and close the device and its accelerometer. Returns whether the library confirmed the release."""
        self._cells[loop_cells.WITHHELD_UNTIL_S] = 0.0
        self._cells[loop_cells.CLOSED] = 1.0
        self._closed.set()
        is_locked = self._send_lock.acquire(LOCK_S)
        try:
            self._cells[loop_cells.RELEASE_CONFIRMED] = self._handle.disconnect()
        finally:
            if is_locked:
                self._send_lock.release()
            if self._accelerometer is not None:
                self._accelerometer.close()
        self._join_zero_thread()
        return bool(self._cells[loop_cells.RELEASE_CONFIRMED])

    def _join_zero_thread(self) -> None:
        """Wait for the thread that repeats zeros, after the force is off and the brakes are on, so that a hanging call
        of that thread delays neither. The second disconnect undoes a force or a release of the brakes by such a call;
        if it fails, the release does not count as confirmed."""
        if self._zero_thread.ident is None or self._zero_thread is threading.current_thread():
            return
        self._zero_thread.join(JOIN_TIMEOUT_S)
        if not self._handle.disconnect():
            self._cells[loop_cells.RELEASE_CONFIRMED] = 0.0

    def _repeat_zero_force(self) -> None:
        """Repeat a zero force until closed or failed; a zero is sent only where the last force was zero. Runs with the
        real-time priority of the control loop: if it were interrupted while it holds the lock, the loop's next force
        would wait."""
        interval_s, zero_force = ZERO_INTERVAL_SHARE * self.drops_force_after_s, np.zeros(3)
        with request_real_time_class():
            while not self._closed.wait(interval_s) and self._cells[loop_cells.FAILED] == 0.0:
                code = tick_io.repeat_zero_once(self._calls, self._cells, interval_s, zero_force)
                if code:
                    self._get_error(code)

    def _raise_for_code(self, code: int) -> None:
        """Raise the error of a code of `tick_io`; do nothing for 0."""
        if code:
            raise self._get_error(code)

    def _get_error(self, code: int) -> DeviceError:
        """Return the error of a code; the first failure is kept. Must be called in the thread that got the code,
        because the library stores its last error per thread."""
        failure_code = int(self._cells[loop_cells.FAILED])  # read first: another thread sets it after `_failure`
        return self._failure or self._record_failure(self._describe_failure(failure_code or code))

    def _describe_failure(self, code: int) -> str:
        """Describe a failure, without a full stop. code: as in `loop_cells`; LIBRARY_ERROR plus the index of a
        function for an error of the library."""
        function_index = code - loop_cells.LIBRARY_ERROR
        if 0 <= function_index < len(loop_cells.VENDOR_CALLS):
            return f"The library says: {self._handle.library.fetch_last_error(loop_cells.VENDOR_CALLS[function_index])}"
        cap_n, refused_n = self._cells[loop_cells.CAP_N], self._cells[loop_cells.REFUSED_N]
        return {
            loop_cells.STALE_READINGS: "It repeatedly reports the same position",
            loop_cells.FORCES_OFF: f"It let its force go: {describe_off_cause(int(self._cells[loop_cells.OFF_CAUSE]))}",
            loop_cells.FORCE_REFUSED: f"A force of {refused_n:g} N was refused; at most {cap_n:g} N may be sent",
            loop_cells.SEND_LOCKED: "An earlier force is still being sent",
            loop_cells.DEVICE_CLOSED: "It is closed",
            loop_cells.FORCE_SCALED_DOWN: "Its motors cannot give the commanded force, and give less",
            loop_cells.FORCE_MISMATCH: "It repeatedly reports another force than the one that it was sent",
        }[code]

    def _record_failure(self, reason: str) -> DeviceError:
        """Record a failure and return its error. Only the first failure is kept: later calls return the same error."""
        if self._failure is None:
            self._failure = DeviceError(
                f"The {self.info.name} let go",
                f"{reason}.",
                "Check its power and its cable, then open it again; a session is continued with `hapteq resume`.",
            )
            # After the error: another thread that reads the code then finds its reason.
            self._cells[loop_cells.FAILED] = self._cells[loop_cells.FAILED] or loop_cells.RAISED_IN_PYTHON
        return self._failure
