"""Indices into the arrays of the safety layer's control tick (settings, state, rows), and its phase and fault codes.

The compiled tick takes arrays of 64-bit floats, so that each quantity is a cell with a named index. The name of a
vector is the index of its x component; names that begin with an underscore reserve the cells of y and z.
"""

import numpy as np

(
    TICK_S, STIFFNESS, DAMPING, VELOCITY_SMOOTHING, CENTRE_X, CENTRE_Y, CENTRE_Z,
    STIMULUS_CAP, FEEDBACK_CAP, TOTAL_CAP, SLEW_STEP, WATCHDOG_TICKS, LET_GO_TICKS,
    # Bounds of a plausible position reading and their reasons: `protocols.definition.plausibility`.
    WORKSPACE_RADIUS, LONGEST_JUMP, FASTEST_STEP, MAX_ACCELERATION, ACCELERATION_SMOOTHING, RESOLUTION, FRICTION,
    STALE_TICKS, REDUCTION_TICKS, STIMULUS_SMOOTHING, SETTINGS_SIZE,
) = range(24)  # fmt: skip
"""Cells of `settings`, fixed from opening to closing the device, in SI units (N, m, s); names with TICKS in ticks,
LET_GO_TICKS >= 1. SLEW_STEP in N per tick, FASTEST_STEP in m per tick. REDUCTION_TICKS: time of unchanged position
readings before the feedback force is reduced, and duration of its reduction to zero. VELOCITY_SMOOTHING,
ACCELERATION_SMOOTHING and STIMULUS_SMOOTHING: coefficient c of a first-order low-pass y += c (x - y) per tick."""

(
    # Requests and keep-alive: 0, or 1 as written from Python at any time, even in the middle of a block of ticks.
    STOP_REQUEST, RELEASE_REQUEST, LET_GO_REQUEST, KEEP_ALIVE,
    # Time of the reading, s, by the loop's clock; 0 where it follows from the tick's number.
    READING_TIME_S,
    # Time at which the tick before FIRST_TICK was due, s, by the same clock.
    BEGIN_TIME_S,
    # Stimulus, written while no force acts; in ticks, but for RAISED_COSINE (0 or 1). LENGTH is inf for a loop, whose
    # first ONSET_TICKS rows are played once.
    FIRST_TICK, FADE_IN, FADE_OUT, RAISED_COSINE, SPRING_RAMP, LENGTH, ONSET_TICKS, LONGEST_HOLD, RECORD_FROM,
    # Phase, fault, present tick, ticks of events, and gains (0 to 1).
    PHASE, FAULT, TICK, LAST_KEEP_ALIVE_TICK, RELEASE_START, LET_GO_START, STIMULUS_GAIN, SPRING_GAIN,
    # Counters of ticks: all, missed, and those in which a limit or the sensor clipped. PEAK_FORCE: largest force, N.
    TICKS, MISSED, STIMULUS_CLIPPED, FEEDBACK_CLIPPED, TOTAL_CLIPPED, SLEW_LIMITED, SENSOR_CLIPS,
    PEAK_FORCE, RECORDED_ROWS,
    # Number of ticks that ended after the next was due; longest time from when a tick was due to its end, s.
    LATE, LATEST_S,
    # Ticks since the last reading, its tick and time (s); force of spring and damper together (N); low-passed
    # acceleration of the readings (m/s²); ticks in which the position did not change.
    ELAPSED_TICKS, LAST_READING_TICK, LAST_READING_TIME_S, FEEDBACK_FORCE, SMOOTHED_ACCELERATION, UNCHANGED_TICKS,
    # Share (0 to 1) by which the feedback force is reduced because the position does not change: now, and at the last
    # change of the position.
    FEEDBACK_REDUCTION, REDUCTION_AT_CHANGE,
    # Vectors x, y, z: forces in N, positions in m, velocity in m/s.
    FORCE, _FY, _FZ, EXCITATION, _EY, _EZ, LAST_POSITION, _XY, _XZ, VELOCITY, _VY, _VZ, LET_GO_FORCE, _LY, _LZ,
    # LAST_STEP in m per tick; REFERENCE_POSITION: last reading that counted as changed (`plausibility`), m; then the
    # motion expected of a gripped handle: force that exceeds dry friction (N), position (m), speed (m/s), and its
    # range since that reading (m).
    LAST_STEP, _SY, _SZ, REFERENCE_POSITION, _CY, _CZ, MOVING_FORCE, _MY, _MZ,
    EXPECTED_POSITION, _DY, _DZ, EXPECTED_SPEED, _UY, _UZ, RANGE_LOW, _AY, _AZ, RANGE_HIGH, _BY, _BZ,
    # The same for each axis by itself; AXIS_UNCHANGED_TICKS: ticks since the axis's reading changed.
    AXIS_REFERENCE, _A1, _A2, AXIS_FORCE, _A3, _A4, AXIS_EXPECTED, _A5, _A6, AXIS_SPEED, _A7, _A8,
    AXIS_LOW, _A9, _A10, AXIS_HIGH, _A11, _A12, AXIS_UNCHANGED_TICKS, _A13, _A14,
    # The stimulus after the first low-pass and after the second, N.
    SMOOTHED_STIMULUS, _P1, _P2, TWICE_SMOOTHED_STIMULUS, _P3, _P4,
    STATE_SIZE,
) = range(106)  # fmt: skip
"""Cells of `state`, which each tick updates. STOP_REQUEST must be the first: a new stimulus clears all others."""

IDLE, PLAYING, RELEASING, LETTING_GO = range(4)
"""Phases. IDLE: no force. PLAYING: stimulus. RELEASING: fade-out of the stimulus, on request or at its end, with the
duration that the stimulus specifies. LETTING_GO: safety fade of the last force, linear to zero within LET_GO_TICKS,
which needs neither sensor nor program and has no slew limit."""

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
