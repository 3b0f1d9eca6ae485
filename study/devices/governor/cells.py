"""Layout of the arrays that the control tick reads and changes (settings, state, rows), and its codes."""

import numpy as np

(
    TICK_S, STIFFNESS, DAMPING, VELOCITY_SHARE, CENTRE_X, CENTRE_Y, CENTRE_Z,
    STIMULUS_CAP, FEEDBACK_CAP, TOTAL_CAP, SLEW_STEP, WATCHDOG_TICKS, LET_GO_TICKS,
    # What a reading may be: see `protocols.definition.plausibility`.
    WORKSPACE, LONGEST_JUMP, FASTEST_STEP, ACCELERATION, ACCELERATION_SHARE, RESOLUTION, FRICTION,
    STALE_TICKS, EASE_TICKS, PASSED_SHARE, SETTINGS_SIZE,
) = range(24)  # fmt: skip
"""Cells of `settings`, fixed from opening to closing. SLEW_STEP in N per tick, FASTEST_STEP in m per tick,
LET_GO_TICKS >= 1; VELOCITY_SHARE, ACCELERATION_SHARE and PASSED_SHARE: how far a low-pass goes in one tick."""

(
    # Letter box: written from Python at any time, even in the middle of a block.
    STOP_ASKED, RELEASE_ASKED, LET_GO_ASKED, SIGN_OF_LIFE,
    # When the reading was taken, s, by a clock of the loop; 0 where the tick's number says it.
    STAMP_S,
    # When the tick before START was due, s, by the same clock.
    BEGAN_S,
    # What is played: written while nothing moves. In ticks; LENGTH is inf for a loop, LEAD rows of it are played once.
    START, FADE_IN, FADE_OUT, RAISED_COSINE, SPRING_RAMP, LENGTH, LEAD, LONGEST, RECORD_FROM,
    # How it goes.
    PHASE, FAULT, TICK, LAST_SIGN, RELEASED_AT, LET_GO_AT, STIMULUS_GAIN, SPRING_GAIN,
    # What was counted.
    TICKS, MISSED, STIMULUS_CLIPPED, FEEDBACK_CLIPPED, TOTAL_CLIPPED, SLEW_LIMITED, SENSOR_CLIPS, PEAK, RECORDED,
    # Ticks whose work ended after the next was due, and the longest from when one was due until it was done, s.
    LATE, LATEST_S,
    # Of the readings: ticks since the one before, that one's tick and time, N of spring and damper together.
    ELAPSED, READ_AT, READ_AT_S, PULL, SHAKING, UNCHANGED,
    # Share of PULL that was taken back from a position that stands still: now, and when the position last changed.
    EASED, EASED_BEFORE,
    # Vectors: the place of their first component.
    FORCE, _FY, _FZ, EXCITATION, _EY, _EZ, LAST_POSITION, _XY, _XZ, VELOCITY, _VY, _VZ, LET_GO_FROM, _LY, _LZ,
    # LAST_STEP in m per tick; where the reading last changed; the motion that is expected meanwhile, m.
    LAST_STEP, _SY, _SZ, CHANGED, _CY, _CZ, MOVING_FORCE, _MY, _MZ, EXPECTED, _DY, _DZ, EXPECTED_SPEED, _UY, _UZ,
    LEAST, _AY, _AZ, MOST, _BY, _BZ,
    # The same of each axis by itself; ticks since its reading changed.
    AXIS_CHANGED, _A1, _A2, AXIS_FORCE, _A3, _A4, AXIS_EXPECTED, _A5, _A6, AXIS_SPEED, _A7, _A8,
    AXIS_LEAST, _A9, _A10, AXIS_MOST, _A11, _A12, AXIS_UNCHANGED, _A13, _A14,
    # The stimulus after the first low-pass and after the second, N.
    PASSED, _P1, _P2, PASSED_TWICE, _P3, _P4,
    STATE_SIZE,
) = range(106)  # fmt: skip
"""Cells of `state`."""

STILL, PLAYING, RELEASING, LETTING_GO = range(4)
"""Phases. RELEASING is asked for and fades as the stimulus says; LETTING_GO is the safety layer's own fade of the
last force: straight to zero, needing neither sensor nor program, and exempt from the slew limit."""

NO_FAULT, NOT_A_NUMBER, STALLED, HELD_TOO_LONG, STOPPED, LOST, FORCE_LEFT, OUTSIDE, JUMPED, SHAKEN, STALE = range(11)
"""Codes of faults, in the order of `study.devices.device.Fault`."""

ROW_SIZE = 15
"""A row of the recording: command, excitation, position, acceleration, true acceleration."""

(
    RING_INDEX, RING_TIME_S, RING_TICK, RING_POSITION, _PY, _PZ, RING_VELOCITY, _RV, _RW, RING_ACCELERATION, _RY, _RZ,
    RING_COMMANDED, _KY, _KZ, RING_APPLIED, _QY, _QZ, RING_PHASE, RING_FAULT, RING_MISSED, RING_CHECK, RING_WIDTH,
) = range(23)  # fmt: skip
"""A row of the telemetry ring: one tick. RING_CHECK is the sum over all other cells, modulo 2^64, of their bits times
the factor of their place."""

RING_FACTORS = np.array(
    [pow(0x9E3779B97F4A7C15, 1 + place, 2**64) for place in range(RING_CHECK)], dtype=np.uint64
).view(np.int64)
"""Odd, and another one for each place: equal changes in several cells, as a hand makes them, do not cancel. Bits enter
as `bits ^ (bits >> RING_FOLD)`, because the lower bits of a round number are all zero."""
RING_FOLD = 29
"""Bits by which a cell's higher bits are shifted onto its lower ones; see `RING_FACTORS`."""

RING_COUNT, RING_RATE_HZ, RING_FORMAT = range(3)
"""Cells of the ring's first row, its header: rows written so far, ticks per second, what the rows are."""
