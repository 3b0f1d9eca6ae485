"""State of the Force Dimension driver within a control tick: memory cells, error codes, and the status check.

A tick of the compiled loop reads the sensors and writes the force (`tick_io`); both use the array `cells` described
here. The status check compares the force that the device reports with the force that was sent."""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.force_dimension.handle import (
    BRAKED_CAUSE,
    BRAKING_PLACE,
    CALIBRATED_PLACE,
    FORCE_ON_PLACE,
    OFF_CAUSE_PLACE,
    POWERED_PLACE,
    UNCALIBRATED_CAUSE,
    UNPOWERED_CAUSE,
    WATCHDOG_CAUSE,
)
from study.devices.force_dimension.library import HIGHEST_NOTICE
from study.devices.governor.compiling import part
from study.devices.governor.confine import is_bounded
from study.devices.native import SYSTEM_SIZE, Addresses, allocate_16_words, call_int, read_word

MISMATCH_COUNT, MISMATCH_SHARE = 5, 0.1
"""Mismatches of reported and sent force that stop the device: MISMATCH_COUNT status checks beyond MISMATCH_SHARE of all
checks (`count_beyond_share`), or MISMATCH_COUNT in a row after a zero force."""

MISMATCH_N, MISMATCH_RATIO = 0.2, 0.2
"""Allowed difference of reported and sent force: in N, plus a share of the force sent. The acceptance test allows the
same."""

GAIN_WINDOW, MIN_WEIGHT = 200.0, 20.0
"""Exponential memory, in status checks, of the estimated gain of the reported force (2 s at 1 kHz), and the smallest
sum of weights from which it is estimated."""
GAIN_ERRORS = 5.0
"""Number of standard errors by which |gain - 1| must exceed `MISMATCH_RATIO`."""
IMPLAUSIBLE_N = 1e6
"""Reported force along an axis (N) from which on it counts as implausible, like NaN."""
RESOLUTION_N = 0.002
"""Finest resolution assumed for a reported force (N)."""

POSITION, FORCE, STATUS, BUTTONS, BRAKES, ENABLE, GET_FORCE, CALLS_SIZE = range(SYSTEM_SIZE, SYSTEM_SIZE + 8)
"""Places of the addresses of the library's functions (`LIBRARY`), after those of `native`."""
LIBRARY = (
    "dhdGetPosition", "dhdSetForce", "dhdGetStatus", "dhdGetButtonMask", "dhdSetBrakes", "dhdEnableForce", "dhdGetForce"
)  # fmt: skip
"""Functions of the vendor's library that a tick calls, in the order of their places."""

(
    NUMBER, CAP_N, DROPS_AFTER_S, READS, REPEATED, SCALED_COUNT, PRESSED, SENT_S, SENT_ZERO, WITHHELD_UNTIL_S, CLOSED,
    LET_GO, FAILED, OFF_CAUSE, REFUSED_N, MISMATCHES, REPORTS, LAST_Z,
) = range(18)  # fmt: skip
"""Cells of the driver. REPEATED, SCALED_COUNT, MISMATCHES: readings, forces and status checks beyond their share,
counted by `count_beyond_share`; PRESSED: mask of buttons; OFF_CAUSE, REFUSED_N: for the text of a failure; REPORTS:
status checks that speak for a device that reports the forces it gives (`_reports_forces`); LAST_Z: reported force along
z at the last of them (N)."""

REPORTED, SENT_FORCES = 18, 21
"""First cells of the reported force at the last status check (x, y, z; N), and of the last `MEMORY` forces sent (the
same)."""
MEMORY = 3
"""Forces sent that are remembered, for the comparison with the reported force."""
WEIGHT = SENT_FORCES + 3 * MEMORY
"""Cells of the sums for the gain: number, reported force (x, y, z), its square; from LAG_SUMS on, for each age of the
report in ticks: sent force (x, y, z), its square, its product with the reported one."""
LAG_SUMS, LAG_SUMS_SIZE = WEIGHT + 5, 5
REPORTED_AT_REST = LAG_SUMS + LAG_SUMS_SIZE * MEMORY
"""First cell of the reported force after a zero (x, y, z; N)."""
MISMATCHES_AT_REST = REPORTED_AT_REST + 3
"""Number of zeros in a row after which that force was more than `MISMATCH_N`."""
CELLS_SIZE = MISMATCHES_AT_REST + 1
"""Number of cells of the driver."""

LIBRARY_ERROR = 1
"""Error code of a failed call of the first function of LIBRARY; the codes of the others follow."""
(REPEATS, RELEASED, REFUSED, LOCKED, IS_CLOSED, SCALED_DOWN, FORCE_MISMATCH, FAILED_BEFORE, RAISED_IN_PYTHON) = range(
    LIBRARY_ERROR + len(LIBRARY), LIBRARY_ERROR + len(LIBRARY) + 9
)
"""Further error codes. RAISED_IN_PYTHON: the driver failed outside the loop, and has stated why."""


@part
def is_success(answer: int) -> bool:
    """Whether an answer of the vendor's library is success, with or without a notice."""
    return bool(0 <= answer <= HIGHEST_NOTICE)


@part
def record_failure(cells: FloatArray, code: int) -> int:
    """Keep the first failure; return `code`."""
    if cells[FAILED] == 0.0:
        cells[FAILED] = code
    return code


@part
def record_library_failure(cells: FloatArray, function: int) -> int:
    """Record the failure of a function of the vendor's library. Returns its error code."""
    return record_failure(cells, LIBRARY_ERROR + function - SYSTEM_SIZE)


@part
def count_beyond_share(count: float, occurred: bool, share: float) -> float:
    """Cumulative sum (CUSUM) of an event beyond its allowed share of all times. The 1e-12 compensates rounding, so that
    the sum reaches whole numbers."""
    return max(0.0, count + (1.0 if occurred else 0.0) - share + 1e-12)


@part
def _read_int(status: int, place: int) -> int:
    """Read the 32-bit integer at a place of a status; a 64-bit word contains two."""
    return int((read_word(status, place // 2) >> (32 * (place % 2))) & 0xFFFFFFFF)


@part
def check_force_on(calls: Addresses, cells: FloatArray) -> int:
    """Check whether the device's forces are switched on. Returns 0 if so, -1 if its watchdog has switched them off
    after a zero force, else an error code; OFF_CAUSE then holds the cause."""
    status = allocate_16_words()
    if not is_success(call_int(calls[STATUS], (status, np.int32(cells[NUMBER])))):
        return record_library_failure(cells, STATUS)
    cause, force_on = _read_int(status, OFF_CAUSE_PLACE), _read_int(status, FORCE_ON_PLACE) != 0
    if force_on or cause == 0:
        if _read_int(status, POWERED_PLACE) == 0:
            cause = UNPOWERED_CAUSE
        elif _read_int(status, CALIBRATED_PLACE) == 0:
            cause = UNCALIBRATED_CAUSE
        elif force_on and _read_int(status, BRAKING_PLACE) != 0:
            cause = BRAKED_CAUSE
        elif force_on:
            return 0
    if cells[SENT_ZERO] != 0.0 and cause == WATCHDOG_CAUSE:
        return -1
    if cells[FAILED] == 0.0:
        cells[OFF_CAUSE] = cause
    return record_failure(cells, RELEASED)


@part
def record_sent_force(cells: FloatArray, x: float, y: float, z: float) -> None:
    """Store a force that was sent (N), as the newest of `MEMORY`."""
    for place in range(SENT_FORCES + 3 * MEMORY - 1, SENT_FORCES + 2, -1):
        cells[place] = cells[place - 3]
    cells[SENT_FORCES], cells[SENT_FORCES + 1], cells[SENT_FORCES + 2] = x, y, z


@part
def _is_force_different(cells: FloatArray) -> bool:
    """Whether the reported force differs from each of the last forces sent, because the report may be one or two ticks
    old. The vertical component is ignored: it may contain the device's gravity compensation."""
    for k in range(MEMORY):
        x, y = cells[SENT_FORCES + 3 * k], cells[SENT_FORCES + 3 * k + 1]
        difference_n = math.hypot(cells[REPORTED] - x, cells[REPORTED + 1] - y)
        if difference_n <= MISMATCH_N + MISMATCH_RATIO * math.hypot(x, y):
            return False
    return True


@part
def _add_to_sums(cells: FloatArray) -> None:
    """Add the newest status check to the sums for the gain; the weights of earlier ones decay."""
    for place in range(WEIGHT, REPORTED_AT_REST):
        cells[place] *= 1.0 - 1.0 / GAIN_WINDOW
    cells[WEIGHT] += 1.0
    for i in range(3):
        reported = cells[REPORTED + i]
        cells[WEIGHT + 1 + i] += reported
        cells[WEIGHT + 4] += reported * reported
        for k in range(MEMORY):
            sent_n, sums = cells[SENT_FORCES + 3 * k + i], LAG_SUMS + LAG_SUMS_SIZE * k
            cells[sums + i] += sent_n
            cells[sums + 3] += sent_n * sent_n
            cells[sums + 4] += sent_n * reported


@part
def _fit_gain(cells: FloatArray, age: int) -> tuple[float, float, float]:
    """Linear regression of the reported on the sent force, with a constant (gravity compensation), for a report
    that is `age` ticks old: gain, squared residuals (N²), squared variation of the force sent (N²)."""
    n, sums = cells[WEIGHT], LAG_SUMS + LAG_SUMS_SIZE * age
    reported_squares, sent_squares, product = cells[WEIGHT + 4], cells[sums + 3], cells[sums + 4]
    for i in range(3):
        reported, sent_n = cells[WEIGHT + 1 + i], cells[sums + i]
        reported_squares, sent_squares, product = (
            reported_squares - reported * reported / n,
            sent_squares - sent_n * sent_n / n,
            product - sent_n * reported / n,
        )
    gain = product / max(sent_squares, 1e-12)
    return gain, max(0.0, reported_squares - gain * product) + 3.0 * n * RESOLUTION_N * RESOLUTION_N, sent_squares


@part
def _is_gain_wrong(cells: FloatArray) -> bool:
    """Whether the gain of the reported force differs from 1, for each age of the report that a likelihood-ratio test
    does not reject against the best. Forces that vary by less than `MISMATCH_N` are not tested."""
    n, best = cells[WEIGHT], math.inf
    if n < MIN_WEIGHT:
        return False
    for age in range(MEMORY):
        best = min(best, _fit_gain(cells, age)[1])
    for age in range(MEMORY):
        gain, residual, sent_squares = _fit_gain(cells, age)
        if 3.0 * n * math.log(residual / best) > GAIN_ERRORS * GAIN_ERRORS:
            continue
        error = math.sqrt(residual / (3.0 * n * max(sent_squares, 1e-12)))
        if not (
            2.0 * sent_squares > MISMATCH_N * MISMATCH_N * n and abs(gain - 1.0) > MISMATCH_RATIO + GAIN_ERRORS * error
        ):
            return False
    return True


@part
def _reports_forces(cells: FloatArray) -> bool:
    """Whether the device is known to report its forces: it has reported one along x or y, or one along z that changed
    at `MISMATCH_COUNT` status checks. A constant one along z may be gravity compensation alone."""
    if cells[REPORTED] != 0.0 or cells[REPORTED + 1] != 0.0:
        cells[REPORTS] = MISMATCH_COUNT
    elif abs(cells[REPORTED + 2] - cells[LAST_Z]) > RESOLUTION_N:
        cells[REPORTS] += 1.0
        cells[LAST_Z] = cells[REPORTED + 2]
    return bool(cells[REPORTS] >= MISMATCH_COUNT)


@part
def _check_reported_force(calls: Addresses, cells: FloatArray) -> int:
    """Compare the reported force with those sent. Returns 0 or an error code. A device that has never reported a force
    is not checked, because its acceptance test fails already; one that has, and no longer does, is at fault."""
    address = cells.ctypes.data + 8 * REPORTED
    arguments = (np.int64(address), np.int64(address + 8), np.int64(address + 16), np.int32(cells[NUMBER]))
    if not is_success(call_int(calls[GET_FORCE], arguments)):
        return record_library_failure(cells, GET_FORCE) if cells[REPORTS] >= MISMATCH_COUNT else 0
    if not _reports_forces(cells):
        return 0
    bounded = is_bounded(cells[REPORTED : REPORTED + 3], IMPLAUSIBLE_N)
    if bounded:  # a NaN would remain in the sums, and the gain would never be tested again
        _add_to_sums(cells)
    cells[MISMATCHES] = count_beyond_share(cells[MISMATCHES], not bounded or _is_force_different(cells), MISMATCH_SHARE)
    is_mismatch = cells[MISMATCHES] >= MISMATCH_COUNT * (1.0 - MISMATCH_SHARE) or _is_gain_wrong(cells)
    return record_failure(cells, FORCE_MISMATCH) if is_mismatch else 0


@part
def check_status(calls: Addresses, cells: FloatArray) -> int:
    """Status check within the loop: read the buttons, the status and the reported force, and compare that with the
    forces sent. Returns 0, or the error code of a call that failed, of a device that takes no forces
    (`check_force_on`), or of a reported force that matches none of those sent or has a wrong gain (FORCE_MISMATCH)."""
    pressed = call_int(calls[BUTTONS], (np.int32(cells[NUMBER]),))
    if pressed < 0:  # no device has 32 buttons
        return record_library_failure(cells, BUTTONS)
    cells[PRESSED] = pressed & 0xFFFFFFFF
    code = max(0, check_force_on(calls, cells))
    return code if code != 0 else _check_reported_force(calls, cells)


@part
def check_zero_force(calls: Addresses, cells: FloatArray) -> int:
    """Check the reported force after a zero force that was sent while nothing is played. Returns 0, or an error code
    where the device has reported a force `MISMATCH_COUNT` times in a row."""
    address = cells.ctypes.data + 8 * REPORTED_AT_REST
    arguments = (np.int64(address), np.int64(address + 8), np.int64(address + 16), np.int32(cells[NUMBER]))
    answered = is_success(call_int(calls[GET_FORCE], arguments))
    reported = answered and not math.hypot(cells[REPORTED_AT_REST], cells[REPORTED_AT_REST + 1]) <= MISMATCH_N
    cells[MISMATCHES_AT_REST] = cells[MISMATCHES_AT_REST] + 1.0 if reported else 0.0
    return 0 if cells[MISMATCHES_AT_REST] < MISMATCH_COUNT else record_failure(cells, FORCE_MISMATCH)
