"""What the two halves of a tick share: memory cells, error codes, and the occasional check of the status."""

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
from study.devices.native import SYSTEM_SIZE, Addresses, call_int, room_for_16, word

ODD_FOR, ODD_SHARE = 5, 0.1
"""Status checks whose reported force is another than the one that was sent: so many beyond this share of all checks
stop the device (`count_beyond_share`), and so many in a row after a zero."""

ODD_N, ODD_PART = 0.2, 0.2
"""Difference of the two forces that an acceptance allows: N, and a share of the one that was sent."""

REMEMBERED, LEAST_WEIGHT = 200.0, 20.0
"""Status checks over which the gain of the reported force is estimated (2 s at 1 kHz; older ones fade out), and how
many it takes."""
GAIN_ERRORS = 5.0
"""Standard errors by which the gain must be further from 1 than `ODD_PART`."""
IMPLAUSIBLE_N = 1e6
"""Reported force along an axis (N) from which it is treated like NaN."""
FINEST_N = 0.002
"""Resolution that no report is taken to be finer than (N)."""

POSITION, FORCE, STATUS, BUTTONS, BRAKES, ENABLE, GIVEN, CALLS_SIZE = range(SYSTEM_SIZE, SYSTEM_SIZE + 8)
"""Places of the addresses of the library's functions (`LIBRARY`), after those of `native`."""
LIBRARY = (
    "dhdGetPosition", "dhdSetForce", "dhdGetStatus", "dhdGetButtonMask", "dhdSetBrakes", "dhdEnableForce", "dhdGetForce"
)  # fmt: skip
"""Functions of the vendor's library that a tick calls, in the order of their places."""

(
    NUMBER, CAP_N, DROPS_AFTER_S, READS, REPEATED, TOO_STRONG, PRESSED, SENT_S, SENT_ZERO, WITHHELD_UNTIL_S, CLOSED,
    LET_GO, FAILED, OFF_CAUSE, REFUSED_N, ODD, REPORTS, LAST_Z,
) = range(18)  # fmt: skip
"""Cells of the driver. REPEATED, TOO_STRONG, ODD: readings, forces and status checks beyond their share, counted by
`count_beyond_share`; PRESSED: mask of buttons; OFF_CAUSE, REFUSED_N: for the text of a failure; REPORTS: status
checks that speak for a device that reports the forces it gives (`_reports_forces`); LAST_Z: reported force along z at
the last of them (N)."""

REPORTED, SENT = 18, 21
"""First cells of the reported force at the last status check (x, y, z; N), and of the last `MEMORY` forces sent (the
same)."""
MEMORY = 3
"""Forces sent that are remembered, for the comparison with the reported force."""
WEIGHT = SENT + 3 * MEMORY
"""Cells of the sums for the gain: number, reported force (x, y, z), its square; from LAGGED on, for each age of the
report in ticks: sent force (x, y, z), its square, its product with the reported one."""
LAGGED, OF_LAG = WEIGHT + 5, 5
REPORTED_AT_REST = LAGGED + OF_LAG * MEMORY
"""First cell of the reported force after a zero (x, y, z; N)."""
ODD_AT_REST = REPORTED_AT_REST + 3
"""Number of zeros in a row after which that force was more than `ODD_N`."""
CELLS_SIZE = ODD_AT_REST + 1
"""Number of cells of the driver."""

OF_LIBRARY = 1
"""Error code of a failed call of the first function of LIBRARY; the codes of the others follow."""
(REPEATS, RELEASED, REFUSED, LOCKED, IS_CLOSED, WEAK, GIVES_ANOTHER, FAILED_BEFORE, SAID) = range(
    OF_LIBRARY + len(LIBRARY), OF_LIBRARY + len(LIBRARY) + 9
)
"""Further error codes. SAID: the driver failed outside the loop, and has stated why."""


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
    return record_failure(cells, OF_LIBRARY + function - SYSTEM_SIZE)


@part
def count_beyond_share(count: float, happened: bool, share: float) -> float:
    """Count an event beyond its allowed share of all times (CUSUM). 1e-12 keeps a sum of steps below a whole."""
    return max(0.0, count + (1.0 if happened else 0.0) - share + 1e-12)


@part
def _number_at(status: int, place: int) -> int:
    """The int at a place of a status: two are in a word."""
    return int((word(status, place // 2) >> (32 * (place % 2))) & 0xFFFFFFFF)


@part
def check_on(calls: Addresses, cells: FloatArray) -> int:
    """0 where the device takes forces, -1 where its watchdog has switched them off after a zero; else an error code,
    and OFF_CAUSE holds the cause."""
    status = room_for_16()
    if not is_success(call_int(calls[STATUS], (status, np.int32(cells[NUMBER])))):
        return record_library_failure(cells, STATUS)
    cause, on = _number_at(status, OFF_CAUSE_PLACE), _number_at(status, FORCE_ON_PLACE) != 0
    if on or cause == 0:
        if _number_at(status, POWERED_PLACE) == 0:
            cause = UNPOWERED_CAUSE
        elif _number_at(status, CALIBRATED_PLACE) == 0:
            cause = UNCALIBRATED_CAUSE
        elif on and _number_at(status, BRAKING_PLACE) != 0:
            cause = BRAKED_CAUSE
        elif on:
            return 0
    if cells[SENT_ZERO] != 0.0 and cause == WATCHDOG_CAUSE:
        return -1
    if cells[FAILED] == 0.0:
        cells[OFF_CAUSE] = cause
    return record_failure(cells, RELEASED)


@part
def note_sent(cells: FloatArray, x: float, y: float, z: float) -> None:
    """Keep a force that was sent, as the newest of `MEMORY`."""
    for place in range(SENT + 3 * MEMORY - 1, SENT + 2, -1):
        cells[place] = cells[place - 3]
    cells[SENT], cells[SENT + 1], cells[SENT + 2] = x, y, z


@part
def _gives_another(cells: FloatArray) -> bool:
    """Whether the reported force is far from each of the last forces sent: the report may be a tick or two old. Only
    the horizontal part: the vertical one may hold up the device's own weight."""
    for k in range(MEMORY):
        x, y = cells[SENT + 3 * k], cells[SENT + 3 * k + 1]
        apart = math.hypot(cells[REPORTED] - x, cells[REPORTED + 1] - y)
        if apart <= ODD_N + ODD_PART * math.hypot(x, y):
            return False
    return True


@part
def _add_to_sums(cells: FloatArray) -> None:
    """Add the newest status check to the sums for the gain; those before lose weight."""
    for place in range(WEIGHT, REPORTED_AT_REST):
        cells[place] *= 1.0 - 1.0 / REMEMBERED
    cells[WEIGHT] += 1.0
    for i in range(3):
        reported = cells[REPORTED + i]
        cells[WEIGHT + 1 + i] += reported
        cells[WEIGHT + 4] += reported * reported
        for k in range(MEMORY):
            sent, sums = cells[SENT + 3 * k + i], LAGGED + OF_LAG * k
            cells[sums + i] += sent
            cells[sums + 3] += sent * sent
            cells[sums + 4] += sent * reported


@part
def _fit_gain(cells: FloatArray, age: int) -> tuple[float, float, float]:
    """Linear regression of the reported on the sent force, with a constant (the weight that is held up), for a report
    that is so many ticks old: gain, squared residuals (N²), squared variation of the force sent (N²)."""
    n, sums = cells[WEIGHT], LAGGED + OF_LAG * age
    reported2, sent2, product = cells[WEIGHT + 4], cells[sums + 3], cells[sums + 4]
    for i in range(3):
        reported, sent = cells[WEIGHT + 1 + i], cells[sums + i]
        reported2, sent2, product = (
            reported2 - reported * reported / n,
            sent2 - sent * sent / n,
            product - sent * reported / n,
        )
    gain = product / max(sent2, 1e-12)
    return gain, max(0.0, reported2 - gain * product) + 3.0 * n * FINEST_N * FINEST_N, sent2


@part
def _gain_is_off(cells: FloatArray) -> bool:
    """Whether the reported force is another multiple of the force sent, for each age of the report that is as likely as
    the best (likelihood ratio). Forces that vary by less than `ODD_N` are not judged."""
    n, best = cells[WEIGHT], math.inf
    if n < LEAST_WEIGHT:
        return False
    for age in range(MEMORY):
        best = min(best, _fit_gain(cells, age)[1])
    for age in range(MEMORY):
        gain, residual, sent2 = _fit_gain(cells, age)
        if 3.0 * n * math.log(residual / best) > GAIN_ERRORS * GAIN_ERRORS:
            continue
        error = math.sqrt(residual / (3.0 * n * max(sent2, 1e-12)))
        if not (2.0 * sent2 > ODD_N * ODD_N * n and abs(gain - 1.0) > ODD_PART + GAIN_ERRORS * error):
            return False
    return True


@part
def _reports_forces(cells: FloatArray) -> bool:
    """Whether the device reports the forces that it gives: one along x or y, or one along z that has changed at
    `ODD_FOR` status checks. A constant one along z may be the compensation of gravity alone."""
    if cells[REPORTED] != 0.0 or cells[REPORTED + 1] != 0.0:
        cells[REPORTS] = ODD_FOR
    elif abs(cells[REPORTED + 2] - cells[LAST_Z]) > FINEST_N:
        cells[REPORTS] += 1.0
        cells[LAST_Z] = cells[REPORTED + 2]
    return bool(cells[REPORTS] >= ODD_FOR)


@part
def _check_given(calls: Addresses, cells: FloatArray) -> int:
    """Compare the reported force with those sent. A device that never reports a force is not judged by it: its
    acceptance was refused. One that has reported forces, and fails to, is at fault."""
    place = cells.ctypes.data + 8 * REPORTED
    asked = (np.int64(place), np.int64(place + 8), np.int64(place + 16), np.int32(cells[NUMBER]))
    if not is_success(call_int(calls[GIVEN], asked)):
        return record_library_failure(cells, GIVEN) if cells[REPORTS] >= ODD_FOR else 0
    if not _reports_forces(cells):
        return 0
    bounded = is_bounded(cells[REPORTED : REPORTED + 3], IMPLAUSIBLE_N)
    if bounded:  # else the sums would be no numbers from now on, and the gain never judged again
        _add_to_sums(cells)
    cells[ODD] = count_beyond_share(cells[ODD], not bounded or _gives_another(cells), ODD_SHARE)
    odd = cells[ODD] >= ODD_FOR * (1.0 - ODD_SHARE) or _gain_is_off(cells)
    return record_failure(cells, GIVES_ANOTHER) if odd else 0


@part
def check_status(calls: Addresses, cells: FloatArray) -> int:
    """Status check within the loop: read the buttons, the status and the reported force, and compare that with the
    forces sent. Returns 0, or the error code of a call that failed, of a device that takes no forces (`check_on`), or
    of a reported force that is none of those sent or another multiple of them (GIVES_ANOTHER)."""
    pressed = call_int(calls[BUTTONS], (np.int32(cells[NUMBER]),))
    if pressed < 0:  # no device has 32 buttons
        return record_library_failure(cells, BUTTONS)
    cells[PRESSED] = pressed & 0xFFFFFFFF
    code = max(0, check_on(calls, cells))
    return code if code != 0 else _check_given(calls, cells)


@part
def check_still(calls: Addresses, cells: FloatArray) -> int:
    """After a zero that was sent while nothing is played: 0, or an error code where the device says that it gives a
    force all the same, again and again."""
    place = cells.ctypes.data + 8 * REPORTED_AT_REST
    asked = (np.int64(place), np.int64(place + 8), np.int64(place + 16), np.int32(cells[NUMBER]))
    answered = is_success(call_int(calls[GIVEN], asked))
    reported = answered and not math.hypot(cells[REPORTED_AT_REST], cells[REPORTED_AT_REST + 1]) <= ODD_N
    cells[ODD_AT_REST] = cells[ODD_AT_REST] + 1.0 if reported else 0.0
    return 0 if cells[ODD_AT_REST] < ODD_FOR else record_failure(cells, GIVES_ANOTHER)
