"""State of the Force Dimension driver within a control tick: memory cells, error codes, and the status check.

A tick of the compiled loop reads the sensors and writes the force (`tick_io`); both use the array `cells` described
here, which `rig` makes. The status check compares the force that the device reports with the force that was sent."""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.force_dimension.handle import (
    BRAKED_CAUSE,
    BRAKING_INDEX,
    CALIBRATED_INDEX,
    FORCE_ON_INDEX,
    OFF_CAUSE_INDEX,
    POWERED_INDEX,
    UNCALIBRATED_CAUSE,
    UNPOWERED_CAUSE,
    WATCHDOG_CAUSE,
)
from study.devices.force_dimension.library import HIGHEST_NOTICE
from study.devices.governor.compiling import njit_inline
from study.devices.governor.confine import is_bounded
from study.devices.native import SYSTEM_SIZE, Addresses, allocate_16_words, call_int, read_word

MISMATCH_COUNT, MISMATCH_SHARE = 5, 0.1
"""Mismatches of reported and sent force that stop the device: MISMATCH_COUNT status checks in a row, or the same excess
over MISMATCH_SHARE of all checks (`count_beyond_share`); after zero forces MISMATCH_COUNT in a row."""

MISMATCH_N, MISMATCH_RATIO = 0.2, 0.2
"""Allowed difference of reported and sent force: in N, plus a share of the force sent. The acceptance test accepts a
report that is too small by the same share."""

GAIN_WINDOW, MIN_WEIGHT = 200.0, 20.0
"""Exponential memory, in status checks, of the estimated gain of the reported force (2 s at 1 kHz), and the smallest
sum of weights from which it is estimated."""
GAIN_STANDARD_ERRORS = 5.0
"""Standard errors by which |gain - 1| must exceed `MISMATCH_RATIO`; its square is the threshold of the likelihood-ratio
test for the age of the report. Chosen: rare false alarms."""
IMPLAUSIBLE_N = 1e6
"""Reported force along an axis (N) from which on it counts as implausible, like NaN. Chosen: no device can exert it."""
RESOLUTION_N = 0.002
"""Finest resolution assumed for a reported force (N): smallest change that counts, and floor of the fit's residuals.
Chosen."""

POSITION, FORCE, STATUS, BUTTONS, BRAKES, ENABLE, GET_FORCE, CALLS_SIZE = range(SYSTEM_SIZE, SYSTEM_SIZE + 8)
"""Indices of the addresses of the library's functions (`VENDOR_CALLS`) in `Addresses`, after those of `native`."""
VENDOR_CALLS = (
    "dhdGetPosition", "dhdSetForce", "dhdGetStatus", "dhdGetButtonMask", "dhdSetBrakes", "dhdEnableForce", "dhdGetForce"
)  # fmt: skip
"""Functions of the vendor's library that a tick calls, in the order of their indices."""

(
    DEVICE_NUMBER, CAP_N, DROPS_AFTER_S, READ_COUNT, REPEAT_COUNT, SCALED_COUNT, BUTTON_MASK, SENT_S, SENT_ZERO,
    WITHHELD_UNTIL_S, CLOSED, RELEASE_CONFIRMED, FAILED, OFF_CAUSE, REFUSED_N, MISMATCHES, REPORT_COUNT, LAST_Z_N,
) = range(18)  # fmt: skip
"""Cells of the driver. Times are of the monotonic clock (s); flags are 0 or 1.

DEVICE_NUMBER: the library's number of the device; CAP_N: largest norm of a force that is sent; DROPS_AFTER_S: timeout
of the device's watchdog, 0 = none; READ_COUNT: readings so far; SENT_S: time of the last force; SENT_ZERO: flag, that
force was zero; WITHHELD_UNTIL_S: until then nothing is sent (test of the watchdog); CLOSED: flag, the driver is closed;
RELEASE_CONFIRMED: flag, the library confirmed the release at closing; FAILED: first error code, 0 = none.

REPEAT_COUNT, SCALED_COUNT, MISMATCHES: repeated readings, reduced forces and mismatches beyond their allowed share
(`count_beyond_share`); BUTTON_MASK: bit k is set while button k is pressed; OFF_CAUSE, REFUSED_N: cause of switched-off
forces and norm of a refused force, for the text of a failure; REPORT_COUNT: status checks which show that the device
reports the forces it gives (`_has_reported_forces`); LAST_Z_N: reported force along z at the last of them (N)."""

REPORTED_FORCE, SENT_FORCES = 18, 21
"""First cells of the reported force at the last status check (x, y, z; N), and of the last `FORCE_MEMORY` forces sent
(likewise, newest first)."""
FORCE_MEMORY = 3
"""Forces sent that are remembered, for the comparison with the reported force."""
GAIN_SUMS = SENT_FORCES + 3 * FORCE_MEMORY
"""First cell of the weighted sums from which the gain is estimated: weights, reported force (x, y, z), its square; from
LAG_SUMS on, for each age of the report in ticks: sent force (x, y, z), its square, its product with the reported
force."""
LAG_SUMS, LAG_SUMS_SIZE = GAIN_SUMS + 5, 5
REPORTED_AT_REST = LAG_SUMS + LAG_SUMS_SIZE * FORCE_MEMORY
"""First cell of the force that the device reports after a zero force (x, y, z; N), for `check_zero_force`."""
MISMATCHES_AT_REST = REPORTED_AT_REST + 3
"""Cell of the number of zero forces in a row after which the reported force exceeded `MISMATCH_N`."""
CELLS_SIZE = MISMATCHES_AT_REST + 1
"""Number of cells of the driver."""

LIBRARY_ERROR = 1
"""Error code of a failed call of the first function of VENDOR_CALLS; the codes of the others follow."""
(
    STALE_READINGS,
    FORCES_OFF,
    FORCE_REFUSED,
    SEND_LOCKED,
    DEVICE_CLOSED,
    FORCE_SCALED_DOWN,
    FORCE_MISMATCH,
    FAILED_BEFORE,
    RAISED_IN_PYTHON,
) = range(LIBRARY_ERROR + len(VENDOR_CALLS), LIBRARY_ERROR + len(VENDOR_CALLS) + 9)
"""Further error codes: readings only repeat an earlier one; the device switched its forces off; a force above the cap;
the lock was not free; the driver is closed; forces were reduced; reported and sent force differ; an earlier failure;
the driver failed in Python, outside the loop, and has raised the error there."""


@njit_inline
def is_success(answer: int) -> bool:
    """Whether an answer of the vendor's library is success, with or without a notice."""
    return bool(0 <= answer <= HIGHEST_NOTICE)


@njit_inline
def record_failure(cells: FloatArray, code: int) -> int:
    """Store the error code in FAILED unless an earlier one is there. Returns `code`."""
    if cells[FAILED] == 0.0:
        cells[FAILED] = code
    return code


@njit_inline
def record_library_failure(cells: FloatArray, function: int) -> int:
    """Record the failure of a function of the vendor's library. Returns its error code."""
    return record_failure(cells, LIBRARY_ERROR + function - SYSTEM_SIZE)


@njit_inline
def count_beyond_share(count: float, occurred: bool, share: float) -> float:
    """One step of a one-sided cumulative sum (CUSUM, Page 1954): the event's occurrences beyond its allowed share of
    all steps. The 1e-12 compensates rounding, so that the sum reaches whole numbers."""
    return max(0.0, count + (1.0 if occurred else 0.0) - share + 1e-12)


@njit_inline
def _read_int(status: int, index: int) -> int:
    """The 32-bit integer at this index of the status array at the address `status`; a 64-bit word contains two."""
    return int((read_word(status, index // 2) >> (32 * (index % 2))) & 0xFFFFFFFF)


@njit_inline
def check_force_on(calls: Addresses, cells: FloatArray) -> int:
    """Check whether the device's forces are switched on. Returns 0 if so, -1 if its watchdog has switched them off
    after a zero force, else an error code. OFF_CAUSE holds the cause where FORCES_OFF is the first failure."""
    status = allocate_16_words()
    if not is_success(call_int(calls[STATUS], (status, np.int32(cells[DEVICE_NUMBER])))):
        return record_library_failure(cells, STATUS)
    cause, force_on = _read_int(status, OFF_CAUSE_INDEX), _read_int(status, FORCE_ON_INDEX) != 0
    if force_on or cause == 0:
        if _read_int(status, POWERED_INDEX) == 0:
            cause = UNPOWERED_CAUSE
        elif _read_int(status, CALIBRATED_INDEX) == 0:
            cause = UNCALIBRATED_CAUSE
        elif force_on and _read_int(status, BRAKING_INDEX) != 0:
            cause = BRAKED_CAUSE
        elif force_on:
            return 0
    if cells[SENT_ZERO] != 0.0 and cause == WATCHDOG_CAUSE:
        return -1
    if cells[FAILED] == 0.0:
        cells[OFF_CAUSE] = cause
    return record_failure(cells, FORCES_OFF)


@njit_inline
def record_sent_force(cells: FloatArray, x: float, y: float, z: float) -> None:
    """Store a force that was sent (N), as the newest of `FORCE_MEMORY`."""
    for cell in range(SENT_FORCES + 3 * FORCE_MEMORY - 1, SENT_FORCES + 2, -1):
        cells[cell] = cells[cell - 3]
    cells[SENT_FORCES], cells[SENT_FORCES + 1], cells[SENT_FORCES + 2] = x, y, z


@njit_inline
def _is_force_different(cells: FloatArray) -> bool:
    """Whether the reported force differs from all of the last forces sent; earlier ones count because the report may be
    one or two ticks old. The vertical component is ignored: it may contain the device's gravity compensation."""
    for k in range(FORCE_MEMORY):
        x, y = cells[SENT_FORCES + 3 * k], cells[SENT_FORCES + 3 * k + 1]
        difference_n = math.hypot(cells[REPORTED_FORCE] - x, cells[REPORTED_FORCE + 1] - y)
        if difference_n <= MISMATCH_N + MISMATCH_RATIO * math.hypot(x, y):
            return False
    return True


@njit_inline
def _add_to_sums(cells: FloatArray) -> None:
    """Add the newest status check to the sums for the gain; the weights of earlier ones decay."""
    for cell in range(GAIN_SUMS, REPORTED_AT_REST):
        cells[cell] *= 1.0 - 1.0 / GAIN_WINDOW
    cells[GAIN_SUMS] += 1.0
    for i in range(3):
        reported_n = cells[REPORTED_FORCE + i]
        cells[GAIN_SUMS + 1 + i] += reported_n
        cells[GAIN_SUMS + 4] += reported_n * reported_n
        for k in range(FORCE_MEMORY):
            sent_n, sums_start = cells[SENT_FORCES + 3 * k + i], LAG_SUMS + LAG_SUMS_SIZE * k
            cells[sums_start + i] += sent_n
            cells[sums_start + 3] += sent_n * sent_n
            cells[sums_start + 4] += sent_n * reported_n


@njit_inline
def _fit_gain(cells: FloatArray, age: int) -> tuple[float, float, float]:
    """Linear regression of the reported on the sent force, with an intercept per axis (gravity compensation), for a
    report that is `age` ticks old: gain, residual sum of squares (N², plus that of errors of `RESOLUTION_N`), sum of
    squares of the sent force about its mean (N²)."""
    weight_sum, sums_start = cells[GAIN_SUMS], LAG_SUMS + LAG_SUMS_SIZE * age
    reported_squares, sent_squares, product_sum = cells[GAIN_SUMS + 4], cells[sums_start + 3], cells[sums_start + 4]
    for i in range(3):
        reported_sum, sent_sum = cells[GAIN_SUMS + 1 + i], cells[sums_start + i]
        reported_squares, sent_squares, product_sum = (
            reported_squares - reported_sum * reported_sum / weight_sum,
            sent_squares - sent_sum * sent_sum / weight_sum,
            product_sum - sent_sum * reported_sum / weight_sum,
        )
    gain = product_sum / max(sent_squares, 1e-12)
    return (
        gain,
        max(0.0, reported_squares - gain * product_sum) + 3.0 * weight_sum * RESOLUTION_N * RESOLUTION_N,
        sent_squares,
    )


@njit_inline
def _is_gain_wrong(cells: FloatArray) -> bool:
    """Whether the gain of the reported force differs from 1 for all ages of the report that a likelihood-ratio test
    does not reject against the best-fitting age. Not tested with weights below `MIN_WEIGHT`, nor for forces with less
    than the variance of a sinusoid of amplitude `MISMATCH_N`."""
    weight_sum, smallest_residual = cells[GAIN_SUMS], math.inf
    if weight_sum < MIN_WEIGHT:
        return False
    for age in range(FORCE_MEMORY):
        smallest_residual = min(smallest_residual, _fit_gain(cells, age)[1])
    for age in range(FORCE_MEMORY):
        gain, residual, sent_squares = _fit_gain(cells, age)
        if 3.0 * weight_sum * math.log(residual / smallest_residual) > GAIN_STANDARD_ERRORS * GAIN_STANDARD_ERRORS:
            continue
        standard_error = math.sqrt(residual / (3.0 * weight_sum * max(sent_squares, 1e-12)))
        if not (
            2.0 * sent_squares > MISMATCH_N * MISMATCH_N * weight_sum
            and abs(gain - 1.0) > MISMATCH_RATIO + GAIN_STANDARD_ERRORS * standard_error
        ):
            return False
    return True


@njit_inline
def _has_reported_forces(cells: FloatArray) -> bool:
    """Whether the device is known to report its forces, with this status check: it has reported a force along x or y,
    or a force along z that changed at `MISMATCH_COUNT` status checks (REPORT_COUNT and LAST_Z_N are updated). A
    constant force along z may be gravity compensation alone."""
    if cells[REPORTED_FORCE] != 0.0 or cells[REPORTED_FORCE + 1] != 0.0:
        cells[REPORT_COUNT] = MISMATCH_COUNT
    elif abs(cells[REPORTED_FORCE + 2] - cells[LAST_Z_N]) > RESOLUTION_N:
        cells[REPORT_COUNT] += 1.0
        cells[LAST_Z_N] = cells[REPORTED_FORCE + 2]
    return bool(cells[REPORT_COUNT] >= MISMATCH_COUNT)


@njit_inline
def _check_reported_force(calls: Addresses, cells: FloatArray) -> int:
    """Compare the reported force with those sent. Returns 0 or an error code. A device that has never reported a force
    is not checked, because its acceptance test fails already. If the query fails, that is an error only for a device
    that has reported forces before."""
    address = cells.ctypes.data + 8 * REPORTED_FORCE
    arguments = (np.int64(address), np.int64(address + 8), np.int64(address + 16), np.int32(cells[DEVICE_NUMBER]))
    if not is_success(call_int(calls[GET_FORCE], arguments)):
        return record_library_failure(cells, GET_FORCE) if cells[REPORT_COUNT] >= MISMATCH_COUNT else 0
    if not _has_reported_forces(cells):
        return 0
    is_plausible = is_bounded(cells[REPORTED_FORCE : REPORTED_FORCE + 3], IMPLAUSIBLE_N)
    if is_plausible:  # a NaN would remain in the sums, and the gain would never be tested again
        _add_to_sums(cells)
    cells[MISMATCHES] = count_beyond_share(
        cells[MISMATCHES], not is_plausible or _is_force_different(cells), MISMATCH_SHARE
    )
    is_mismatch = cells[MISMATCHES] >= MISMATCH_COUNT * (1.0 - MISMATCH_SHARE) or _is_gain_wrong(cells)
    return record_failure(cells, FORCE_MISMATCH) if is_mismatch else 0


@njit_inline
def check_status(calls: Addresses, cells: FloatArray) -> int:
    """Status check within the loop: read the buttons, the status and the reported force, and compare that with the
    forces sent. Returns 0, or the error code of a call that failed, of a device whose forces are off
    (`check_force_on`), or of a reported force that matches none of those sent or has a wrong gain (FORCE_MISMATCH)."""
    pressed = call_int(calls[BUTTONS], (np.int32(cells[DEVICE_NUMBER]),))
    if pressed < 0:  # no device has 32 buttons
        return record_library_failure(cells, BUTTONS)
    cells[BUTTON_MASK] = pressed & 0xFFFFFFFF
    code = max(0, check_force_on(calls, cells))
    return code if code != 0 else _check_reported_force(calls, cells)


@njit_inline
def check_zero_force(calls: Addresses, cells: FloatArray) -> int:
    """Check the reported force after a zero force that was sent while nothing is played. Returns 0, or an error code
    where the device has reported more than `MISMATCH_N` along x and y `MISMATCH_COUNT` times in a row."""
    address = cells.ctypes.data + 8 * REPORTED_AT_REST
    arguments = (np.int64(address), np.int64(address + 8), np.int64(address + 16), np.int32(cells[DEVICE_NUMBER]))
    is_read = is_success(call_int(calls[GET_FORCE], arguments))
    is_nonzero = is_read and not math.hypot(cells[REPORTED_AT_REST], cells[REPORTED_AT_REST + 1]) <= MISMATCH_N
    cells[MISMATCHES_AT_REST] = cells[MISMATCHES_AT_REST] + 1.0 if is_nonzero else 0.0
    return 0 if cells[MISMATCHES_AT_REST] < MISMATCH_COUNT else record_failure(cells, FORCE_MISMATCH)
