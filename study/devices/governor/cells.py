"""Layout of the arrays that the safety layer's control tick reads and changes (settings, state, rows), and its codes.

Compiled code takes arrays of 64-bit floats, so that each quantity is a cell with a named index. The name of a vector is
the index of its x component; names that begin with an underscore reserve the cells of y and z.
"""

import numpy as np

(
    TICK_S, STIFFNESS, DAMPING, VELOCITY_SHARE, CENTRE_X, CENTRE_Y, CENTRE_Z,
    STIMULUS_CAP, FEEDBACK_CAP, TOTAL_CAP, SLEW_STEP, WATCHDOG_TICKS, LET_GO_TICKS,
    # Bounds of a plausible position reading and their reasons: `protocols.definition.plausibility`.
    WORKSPACE, LONGEST_JUMP, FASTEST_STEP, ACCELERATION, ACCELERATION_SHARE, RESOLUTION, FRICTION,
    STALE_TICKS, EASE_TICKS, PASSED_SHARE, SETTINGS_SIZE,
) = range(24)  # fmt: skip
"""Cells of `settings`, fixed from opening to closing the device, in SI units (N, m, s); names with TICKS in ticks,
LET_GO_TICKS >= 1. SLEW_STEP in N per tick, FASTEST_STEP in m per tick. VELOCITY_SHARE, ACCELERATION_SHARE and
PASSED_SHARE: coefficient c of a first-order low-pass y += c (x - y) per tick."""

(
    # Requests, written from Python at any time, even in the middle of a block of ticks.
    STOP_ASKED, RELEASE_ASKED, LET_GO_ASKED, SIGN_OF_LIFE,
    # Time of the reading, s, by the loop's clock; 0 where it follows from the tick's number.
    STAMP_S,
    # Time at which the tick before START was due, s, by the same clock.
    BEGAN_S,
    # Stimulus, written while no force acts; in ticks. LENGTH is inf for a loop, its first ONSET_TICKS rows play once.
    START, FADE_IN, FADE_OUT, RAISED_COSINE, SPRING_RAMP, LENGTH, ONSET_TICKS, LONGEST, RECORD_FROM,
    # Phase, fault, present tick, ticks of events, and gains (0 to 1).
    PHASE, FAULT, TICK, LAST_SIGN, RELEASED_AT, LET_GO_AT, STIMULUS_GAIN, SPRING_GAIN,
    # Counters of events in ticks; PEAK: largest force, N; RECORDED: rows.
    TICKS, MISSED, STIMULUS_CLIPPED, FEEDBACK_CLIPPED, TOTAL_CLIPPED, SLEW_LIMITED, SENSOR_CLIPS, PEAK, RECORDED,
    # Number of ticks that ended after the next was due; longest time from when a tick was due to its end, s.
    LATE, LATEST_S,
    # Ticks since the last reading, its tick and time (s); force of spring and damper together (N); low-passed
    # acceleration of the readings (m/s²); ticks in which the position did not change.
    ELAPSED, READ_AT, READ_AT_S, PULL, SHAKING, UNCHANGED,
    # Share by which PULL is reduced while the position does not change: now, and when the position last changed.
    EASED, EASED_BEFORE,
    # Vectors x, y, z: forces in N, positions in m, velocity in m/s.
    FORCE, _FY, _FZ, EXCITATION, _EY, _EZ, LAST_POSITION, _XY, _XZ, VELOCITY, _VY, _VZ, LET_GO_FROM, _LY, _LZ,
    # LAST_STEP in m per tick; REFERENCE: last reading that differed from its predecessor, m; then the motion
    # expected of a gripped handle: force that exceeds dry friction (N), position (m), speed (m/s), and range since
    # REFERENCE (m).
    LAST_STEP, _SY, _SZ, REFERENCE, _CY, _CZ, MOVING_FORCE, _MY, _MZ, EXPECTED, _DY, _DZ, EXPECTED_SPEED, _UY, _UZ,
    RANGE_LOW, _AY, _AZ, RANGE_HIGH, _BY, _BZ,
    # The same for each axis by itself; AXIS_UNCHANGED: ticks since the axis's reading changed.
    AXIS_REFERENCE, _A1, _A2, AXIS_FORCE, _A3, _A4, AXIS_EXPECTED, _A5, _A6, AXIS_SPEED, _A7, _A8,
    AXIS_LOW, _A9, _A10, AXIS_HIGH, _A11, _A12, AXIS_UNCHANGED, _A13, _A14,
    # The stimulus after the first low-pass and after the second, N.
    PASSED, _P1, _P2, PASSED_TWICE, _P3, _P4,
    STATE_SIZE,
) = range(106)  # fmt: skip
"""Cells of `state`, which each tick updates."""

IDLE, PLAYING, RELEASING, LETTING_GO = range(4)
"""Phases: no force; stimulus; fade-out of the stimulus on request or at its end, as the stimulus specifies; the safety
layer's own fade of the last force, linear to zero, which needs neither sensor nor program and has no slew limit."""

NO_FAULT, NOT_A_NUMBER, STALLED, HELD_TOO_LONG, STOPPED, LOST, FORCE_LEFT, OUTSIDE, JUMPED, SHAKEN, STALE = range(11)
"""Codes of faults, in the order of `study.devices.device.Fault`."""

ROW_SIZE = 15
"""Numbers in a row of the recording: command and excitation (N), position (m), acceleration and true acceleration
(m/s²), three components each."""

(
    RING_INDEX, RING_TIME_S, RING_TICK, RING_POSITION, _PY, _PZ, RING_VELOCITY, _RV, _RW, RING_ACCELERATION, _RY, _RZ,
    RING_COMMANDED, _KY, _KZ, RING_APPLIED, _QY, _QZ, RING_PHASE, RING_FAULT, RING_MISSED, RING_CHECK, RING_WIDTH,
) = range(23)  # fmt: skip
"""Cells of a row of the telemetry ring, which describes one tick; meaning and units: `study.devices.telemetry`.
RING_CHECK is a checksum: the sum, modulo 2^64, over all other cells of the cell's bits times a factor of its place."""

RING_FACTORS = np.array(
    [pow(0x9E3779B97F4A7C15, 1 + place, 2**64) for place in range(RING_CHECK)], dtype=np.uint64
).view(np.int64)
"""Factors of the checksum: odd, and different for each place, so that equal changes in several cells do not cancel.
They are powers, modulo 2^64, of 2^64 divided by the golden ratio. A cell's bits enter as `bits ^ (bits >> RING_FOLD)`,
because the lower bits of a round number are all zero."""
RING_FOLD = 29
"""Bits by which a cell's higher bits are shifted onto its lower ones; see `RING_FACTORS`."""

RING_COUNT, RING_RATE_HZ, RING_FORMAT = range(3)
"""Cells of the ring's first row, its header: rows written so far, ticks per second, version of the row format."""
