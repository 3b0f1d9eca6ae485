"""Compiled input and output of a control tick: reads the sensors, and writes the force to the device.

The only implementation for all callers: the compiled loop calls it without the interpreter, the methods of `rig` call
it from Python. A return value of 0 is success; any other is an error code of `loop_cells`. The cell FAILED keeps the
first error, after which no force other than zero is sent.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.newest_sample import (
    ARRIVAL_S,
    IS_CLIPPED,
    MAX_AGE_S,
    REST_MPS2,
    RING_SIZE,
    SAMPLE_COUNT,
    SENSED_MPS2,
)
from study.devices.drive.compiled_drive import CALLS, SENSE_SIGNATURE, WRITE_SIGNATURE
from study.devices.force_dimension.handle import REPEATED_READING
from study.devices.force_dimension.loop_cells import (
    BRAKES,
    CAP_N,
    CLOSED,
    DEVICE_CLOSED,
    DEVICE_NUMBER,
    DROPS_AFTER_S,
    ENABLE,
    FAILED,
    FAILED_BEFORE,
    FORCE,
    FORCE_REFUSED,
    FORCE_SCALED_DOWN,
    FORCES_OFF,
    POSITION,
    READ_COUNT,
    REFUSED_N,
    RELEASE_CONFIRMED,
    REPEAT_COUNT,
    SCALED_COUNT,
    SEND_LOCKED,
    SENT_S,
    SENT_ZERO,
    STALE_READINGS,
    WITHHELD_UNTIL_S,
    check_force_on,
    check_status,
    check_zero_force,
    count_beyond_share,
    is_success,
    record_failure,
    record_library_failure,
    record_sent_force,
)
from study.devices.governor.compiling import compute_fingerprint, njit_inline
from study.devices.governor.govern import VECTOR_TYPE
from study.devices.native import Addresses, acquire, call_int, read_clock_s, release
from study.devices.rig import ACCELERATION, READING_SIZE, SENSOR_CLIPPED

STATUS_CYCLE_TICKS, STATUS_CHECK_TICKS = 42.0, (0.0, 8.0, 18.0, 29.0)
"""Of every `STATUS_CYCLE_TICKS` ticks those at which status, buttons and reported force are read (95 Hz at 1 kHz,
faster than a person presses). Unevenly spaced, so that a periodic stimulus is not always sampled at the same phases."""

MAX_STALE_READINGS, STALE_SHARE = 50, 0.5
"""Limits on readings that only repeat an earlier one: this many in a row, or the same excess over this share of all
readings (`count_beyond_share`), switch the force off. At 1 kHz half of the time after which a loop counts as lost."""

MAX_SCALED_FORCES, SCALED_SHARE = 5, 0.02
"""The same limits for forces that the device reduced, which its answer reports: the participant then does not feel the
recorded force. The share detects a force of which only the peaks are reduced, for some milliseconds in each period."""

ROUNDING_FACTOR = 1 + 1e-9
"""Factor on the cap that allows for rounding, as in `study.devices.admission`."""
REPEAT_ZERO_SIGNATURE = types.int64(CALLS, VECTOR_TYPE, types.float64, VECTOR_TYPE)
"""Signature of the compiled function that repeats the zero force between stimuli."""
LOCK_S = 0.002
"""Longest wait for the lock (s), ten times the duration of a write: a longer wait means that a call hangs."""


@njit_inline
def _sense_acceleration(samples: FloatArray, time_s: float, reading: FloatArray) -> None:
    """Read the accelerometer in compiled code, as `study.devices.accelerometer.newest_sample.NewestSample.read_zeroed`
    does in Python."""
    sample_count = samples[0, SAMPLE_COUNT]
    while sample_count > 0.0:
        row = 1 + int(sample_count - 1.0) % RING_SIZE
        is_recent = not time_s - samples[row, ARRIVAL_S] > MAX_AGE_S
        for i in range(3):
            value = samples[row, SENSED_MPS2 + i] - samples[0, REST_MPS2 + i]
            reading[ACCELERATION.start + i] = value if is_recent else math.nan
        reading[SENSOR_CLIPPED] = 1.0 if is_recent and samples[row, IS_CLIPPED] != 0.0 else 0.0
        newer_count = samples[0, SAMPLE_COUNT]
        if newer_count - sample_count < RING_SIZE - 1:
            break
        sample_count = newer_count


@njit_inline
def _sense(calls: Addresses, cells: FloatArray, samples: FloatArray, reading: FloatArray) -> int:
    """Read the position (m), at some ticks the status, and the newest acceleration (m/s²) into `reading`."""
    if cells[FAILED] != 0.0:
        return FAILED_BEFORE
    for i in range(READING_SIZE):
        reading[i] = math.nan
    address = reading.ctypes.data
    arguments = (np.int64(address), np.int64(address + 8), np.int64(address + 16), np.int32(cells[DEVICE_NUMBER]))
    return_value = call_int(calls[POSITION], arguments)
    if not is_success(return_value):
        return record_library_failure(cells, POSITION)
    if cells[READ_COUNT] % STATUS_CYCLE_TICKS in STATUS_CHECK_TICKS:
        code = check_status(calls, cells)
        if code != 0:
            return code
    cells[READ_COUNT] += 1.0
    cells[REPEAT_COUNT] = count_beyond_share(cells[REPEAT_COUNT], return_value == REPEATED_READING, STALE_SHARE)
    if cells[REPEAT_COUNT] >= MAX_STALE_READINGS * (1.0 - STALE_SHARE):
        return record_failure(cells, STALE_READINGS)
    reading[SENSOR_CLIPPED] = 0.0
    if samples.shape[0] > 1:
        _sense_acceleration(samples, read_clock_s(calls), reading)
    return 0


@njit_inline
def _is_watchdog_expired(calls: Addresses, cells: FloatArray) -> bool:
    """Whether no force was sent for longer than the timeout of the device's watchdog; False without one."""
    return bool(read_clock_s(calls) - cells[SENT_S] > cells[DROPS_AFTER_S] > 0.0)


@njit_inline
def _set_force(calls: Addresses, cells: FloatArray, x: float, y: float, z: float) -> int:
    """Call dhdSetForce (N). Returns its return value."""
    return int(call_int(calls[FORCE], (x, y, z, np.int32(cells[DEVICE_NUMBER]))))


@njit_inline
def _reenable_forces(calls: Addresses, cells: FloatArray) -> int:
    """Enable forces after a pause longer than the watchdog's timeout. Returns an error code where the forces are off
    for another cause, a force acted, a call failed or the driver is closed; a pause after a zero (nothing was played)
    is no error. A suspended computer's clock shows no pause: the status check then finds the forces off."""
    code = check_force_on(calls, cells)
    if code >= 0:
        return code
    if cells[CLOSED] != 0.0:
        return record_failure(cells, DEVICE_CLOSED)
    device_number = np.int32(cells[DEVICE_NUMBER])
    if not is_success(call_int(calls[BRAKES], (np.int32(0), device_number))):
        return record_library_failure(cells, BRAKES)
    if cells[CLOSED] == 0.0 and not is_success(call_int(calls[ENABLE], (np.int32(1), device_number))):
        return record_library_failure(cells, ENABLE)
    if cells[CLOSED] != 0.0:  # the call hung while the device was closed: undo it
        _brake(calls, cells)
        return record_failure(cells, DEVICE_CLOSED)
    return 0 if is_success(_set_force(calls, cells, 0.0, 0.0, 0.0)) else record_library_failure(cells, FORCE)


@njit_inline
def _brake(calls: Addresses, cells: FloatArray) -> None:
    """Switch forces off and brakes on; the answers of the library are ignored."""
    device_number = np.int32(cells[DEVICE_NUMBER])
    call_int(calls[ENABLE], (np.int32(0), device_number))
    call_int(calls[BRAKES], (np.int32(1), device_number))


@njit_inline
def _send_force(calls: Addresses, cells: FloatArray, force: FloatArray) -> int:
    """Send a force. The caller must hold the lock."""
    if _is_watchdog_expired(calls, cells):
        code = _reenable_forces(calls, cells)
        if code != 0:
            return code
    x, y, z = force[0], force[1], force[2]
    # The watchdog counts from the arrival of the force, which may be long before the call ends.
    began_s = read_clock_s(calls)
    return_value = _set_force(calls, cells, x, y, z)
    if not is_success(return_value):
        return record_library_failure(cells, FORCE)
    cells[SENT_S] = began_s
    record_sent_force(cells, x, y, z)
    cells[SENT_ZERO] = 1.0 if x == 0.0 and y == 0.0 and z == 0.0 else 0.0
    cells[SCALED_COUNT] = count_beyond_share(cells[SCALED_COUNT], return_value != 0, SCALED_SHARE)
    if cells[SCALED_COUNT] >= MAX_SCALED_FORCES * (1.0 - SCALED_SHARE):
        return record_failure(cells, FORCE_SCALED_DOWN)
    return 0


@njit_inline
def _send_zero(calls: Addresses, cells: FloatArray) -> int:
    """Send a zero force; brake where the library answers anything but success or a notice."""
    began_s = read_clock_s(calls)
    if not is_success(_set_force(calls, cells, 0.0, 0.0, 0.0)):
        code = record_library_failure(cells, FORCE)
        _brake(calls, cells)  # the device may still give the previous force
        return code
    if cells[SENT_ZERO] == 0.0 and _is_watchdog_expired(calls, cells):
        # The watchdog cut off a force whose call may still hang: the device must take no forces when it continues.
        code = check_force_on(calls, cells)
        if code != 0 and code != FORCES_OFF:
            return code
    record_sent_force(cells, 0.0, 0.0, 0.0)
    cells[SENT_ZERO], cells[SCALED_COUNT] = 1.0, 0.0
    if not _is_watchdog_expired(calls, cells):
        cells[SENT_S] = began_s
    return 0


@njit_inline
def _write_zero(calls: Addresses, cells: FloatArray) -> int:
    """Send a zero force, even if the lock is not free or after an earlier failure; nothing after a confirmed release.
    It does not enable the forces of a braked device."""
    if cells[RELEASE_CONFIRMED] != 0.0:
        return 0
    is_locked = acquire(calls, LOCK_S)
    code = _send_zero(calls, cells)
    if is_locked:
        release(calls)
    return code


@njit_inline
def _write(calls: Addresses, cells: FloatArray, force: FloatArray) -> int:
    """Write a force (3,), N: a zero force always; another only within the cap, without a failure, and under the lock;
    a force above the cap or NaN is refused, and a zero sent. Nothing is written before the time WITHHELD_UNTIL_S."""
    if read_clock_s(calls) < cells[WITHHELD_UNTIL_S]:
        return 0
    norm_n = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    if norm_n == 0.0:
        return _write_zero(calls, cells)
    if not norm_n <= cells[CAP_N] * ROUNDING_FACTOR:
        code = _write_zero(calls, cells)
        if cells[FAILED] == 0.0:
            cells[REFUSED_N] = norm_n
        return code if code != 0 else record_failure(cells, FORCE_REFUSED)
    if cells[FAILED] != 0.0:
        return FAILED_BEFORE
    if not acquire(calls, LOCK_S):
        return record_failure(cells, SEND_LOCKED)
    code = _send_force(calls, cells, force) if cells[CLOSED] == 0.0 else record_failure(cells, DEVICE_CLOSED)
    release(calls)
    return code


@njit_inline
def _repeat_zero(calls: Addresses, cells: FloatArray, interval_s: float, force: FloatArray) -> int:
    """Repeat the zero force while nothing is played, and brake where the device does not take it. The lock is held
    without the interpreter, so that the loop's next force waits for it no longer than `LOCK_S`."""
    if not acquire(calls, LOCK_S):
        return 0
    code = 0
    is_repeat_due = cells[SENT_ZERO] != 0.0 and read_clock_s(calls) - cells[SENT_S] >= interval_s
    if is_repeat_due and cells[CLOSED] == 0.0 and cells[FAILED] == 0.0:
        code = _send_force(calls, cells, force)
        if code == 0:
            code = check_zero_force(calls, cells)
        if code != 0:
            _brake(calls, cells)
    release(calls)
    return code


def _compile_entry_points(sources_fingerprint: int) -> tuple[Any, Any, Any]:
    """Compile the entry points. sources_fingerprint: captured so that a change invalidates numba's cache."""

    @njit(SENSE_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def sense_once(calls: Addresses, cells: FloatArray, samples: FloatArray, reading: FloatArray) -> int:
        _ = sources_fingerprint
        return _sense(calls, cells, samples, reading)

    @njit(WRITE_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def write_once(calls: Addresses, cells: FloatArray, force: FloatArray) -> int:
        _ = sources_fingerprint
        return _write(calls, cells, force)

    @njit(REPEAT_ZERO_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def repeat_zero_once(calls: Addresses, cells: FloatArray, interval_s: float, force: FloatArray) -> int:
        _ = sources_fingerprint
        return _repeat_zero(calls, cells, interval_s, force)

    return sense_once, write_once, repeat_zero_once


_DEVICES_FOLDER = Path(__file__).parents[1]
sense_once, write_once, repeat_zero_once = _compile_entry_points(
    compute_fingerprint(
        Path(__file__).parent,
        *(
            _DEVICES_FOLDER / name
            for name in ("rig.py", "native.py", "accelerometer/newest_sample.py", "governor/compiling.py")
        ),
    )
)
"""`sense_once` and `write_once` as defined in `study.devices.rig.CompiledIo`; `repeat_zero_once(calls, cells,
interval_s, force)` repeats the zero force where the last force was a zero, interval_s (s) or longer ago."""
