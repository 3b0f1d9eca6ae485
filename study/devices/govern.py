"""The heart of the safety layer: one tick decides one force, and nothing else in the program decides any.

The order within a tick: hear what was asked, aim (stimulus and spring), limit, and confine once more whatever came
out. The last step trusts none of the others: a force is never written that is above the cap or not a number.
All that decides stands in this one file. numba keeps compiled code on disk until the file of that very function
changes: with its parts in several files, a changed limit could go on running as it was."""

import math

from numba import njit, types

from equalizer.signals.signal import FloatArray
from study.devices.rig import SENSOR_CLIPPED

(
    TICK_S, STIFFNESS, DAMPING, VELOCITY_SHARE, CENTRE_X, CENTRE_Y, CENTRE_Z,
    STIMULUS_CAP, TOTAL_CAP, SLEW_STEP, WATCHDOG_TICKS, LET_GO_TICKS, SETTINGS_SIZE,
) = range(13)  # fmt: skip
"""Cells of `settings`, fixed from opening to closing. SLEW_STEP in N per tick, LET_GO_TICKS >= 1."""

(
    # Letter box: written from Python at any time, even in the middle of a block.
    STOP_ASKED, RELEASE_ASKED, LET_GO_ASKED, SIGN_OF_LIFE,
    # What is played: written while nothing moves. In ticks; LENGTH is inf for a loop, LEAD rows of it are played once.
    START, FADE_IN, FADE_OUT, RAISED_COSINE, SPRING_RAMP, LENGTH, LEAD, LONGEST, RECORD_FROM,
    # How it goes.
    PHASE, FAULT, TICK, LAST_SIGN, RELEASED_AT, LET_GO_AT, STIMULUS_GAIN, SPRING_GAIN,
    # What was counted.
    TICKS, MISSED, STIMULUS_CLIPPED, TOTAL_CLIPPED, SLEW_LIMITED, SENSOR_CLIPS, PEAK, RECORDED,
    # Vectors: the place of their first component.
    FORCE, _FY, _FZ, EXCITATION, _EY, _EZ, LAST_POSITION, _XY, _XZ, VELOCITY, _VY, _VZ, LET_GO_FROM, _LY, _LZ,
    STATE_SIZE,
) = range(45)  # fmt: skip
"""Cells of `state`."""

STILL, PLAYING, RELEASING, LETTING_GO = range(4)
"""Phases. RELEASING is asked for and fades as the stimulus says; LETTING_GO is the safety layer's own fade of the
last force: straight to zero, needing neither sensor nor program, and exempt from the slew limit."""

NO_FAULT, NOT_A_NUMBER, STALLED, HELD_TOO_LONG, STOPPED, LOST, FORCE_LEFT = range(7)
"""In the order of `study.devices.device.Fault`."""

ROW_SIZE = 15
"""A row of the recording: command, excitation, position, acceleration, true acceleration."""

IMPLAUSIBLE_N, IMPLAUSIBLE_M, OVERFLOWING = 1e6, 0.5, 1e100
"""Treated like NaN: no handle is half a metre off, and against such a reading the spring would pull in earnest."""

WITHIN, BEYOND = 1 - 1e-12, 1 + 1e-9
"""Forces are confined to the first share of a limit: rounding cannot then carry them over it. They count as limited
from the second share on: a stimulus that is just at its cap is not clipped."""

VECTOR, ROWS = types.float64[::1], types.float64[:, ::1]
TICK_SIGNATURE = types.boolean(VECTOR, VECTOR, ROWS, ROWS, VECTOR, VECTOR)

# Division by zero gives inf or NaN, which `_confine` knows, and never an exception halfway through a tick.
_compiled = njit(cache=True, nogil=True, error_model="numpy")


@_compiled
def _below(vector: FloatArray, bound: float) -> bool:
    """False for NaN and infinity too."""
    return bool(abs(vector[0]) < bound and abs(vector[1]) < bound and abs(vector[2]) < bound)


@_compiled
def _clear(force: FloatArray) -> None:
    for i in range(3):
        force[i] = 0.0


@_compiled
def _confine(force: FloatArray, cap: float) -> bool:
    """Shorten to the cap, direction kept; zero if it is no force at all. Whether it was above the cap."""
    if not (_below(force, OVERFLOWING) and cap > 0.0):
        _clear(force)
        return False
    norm = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    if norm > cap * WITHIN:
        for i in range(3):
            force[i] *= cap * WITHIN / norm
    return norm > cap * BEYOND


@_compiled
def _let_go(state: FloatArray, fault: int) -> None:
    state[PHASE] = LETTING_GO
    state[LET_GO_AT] = state[TICK]
    for i in range(3):
        state[LET_GO_FROM + i] = state[FORCE + i]
    if state[FAULT] == NO_FAULT:
        state[FAULT] = fault


@_compiled
def _hear_while_playing(state: FloatArray, settings: FloatArray) -> None:
    tick = state[TICK]
    if state[SIGN_OF_LIFE] != 0.0:
        state[SIGN_OF_LIFE] = 0.0
        state[LAST_SIGN] = tick
    if state[RELEASE_ASKED] != 0.0 or tick >= state[LENGTH]:
        state[PHASE] = RELEASING
        state[RELEASED_AT] = tick
    elif tick - state[LAST_SIGN] > settings[WATCHDOG_TICKS]:
        _let_go(state, STALLED)
    elif tick >= state[LONGEST]:
        _let_go(state, HELD_TOO_LONG)


@_compiled
def _hear(state: FloatArray, settings: FloatArray) -> None:
    """Change of phase: what was asked for, and what was asked too long ago."""
    phase = state[PHASE]
    if state[STOP_ASKED] != 0.0:
        if phase != STILL and state[FAULT] == NO_FAULT:
            state[FAULT] = STOPPED
        state[PHASE] = STILL
    elif state[LET_GO_ASKED] != 0.0 and phase in (PLAYING, RELEASING):
        _let_go(state, NO_FAULT)
    elif phase == PLAYING:
        _hear_while_playing(state, settings)
    elif phase == RELEASING and state[TICK] - state[RELEASED_AT] > state[FADE_OUT]:
        if state[FORCE] == 0.0 and state[FORCE + 1] == 0.0 and state[FORCE + 2] == 0.0:
            state[PHASE] = STILL
        else:
            _let_go(state, NO_FAULT)  # the slew limit held it up


@_compiled
def _risen(ticks: float, length: float, raised_cosine: float) -> float:
    """From 0 at 0 ticks to 1 at `length`."""
    if ticks >= length:
        return 1.0
    if ticks <= 0:
        return 0.0
    if raised_cosine != 0.0:
        return 0.5 - 0.5 * math.cos(math.pi * ticks / length)
    return ticks / length


@_compiled
def _gains(state: FloatArray) -> tuple[float, float]:
    """Of stimulus and spring, at this tick. A release in the middle of a fade-in starts from where that was."""
    tick, cosine = state[TICK], state[RAISED_COSINE]
    if state[PHASE] == PLAYING:
        state[STIMULUS_GAIN] = _risen(tick, state[FADE_IN], cosine)
        state[SPRING_GAIN] = _risen(tick - state[START], state[SPRING_RAMP], cosine)
        return state[STIMULUS_GAIN], state[SPRING_GAIN]
    left = 1.0 - _risen(tick - state[RELEASED_AT], state[FADE_OUT], cosine)
    return left * state[STIMULUS_GAIN], left * state[SPRING_GAIN]


@_compiled
def _add_spring(state: FloatArray, settings: FloatArray, reading: FloatArray, gain: float, force: FloatArray) -> None:
    for i in range(3):
        last = state[LAST_POSITION + i]
        speed = 0.0 if math.isnan(last) else (reading[i] - last) / settings[TICK_S]
        state[VELOCITY + i] += settings[VELOCITY_SHARE] * (speed - state[VELOCITY + i])
        state[LAST_POSITION + i] = reading[i]
        away = reading[i] - settings[CENTRE_X + i]
        force[i] -= gain * (settings[STIFFNESS] * away + settings[DAMPING] * state[VELOCITY + i])


@_compiled
def _limit_slew(state: FloatArray, settings: FloatArray, force: FloatArray) -> bool:
    """Both ends of the step lie within the cap, and a ball is convex: so does what is left of the step."""
    x, y, z = force[0] - state[FORCE], force[1] - state[FORCE + 1], force[2] - state[FORCE + 2]
    step = math.sqrt(x * x + y * y + z * z)
    if step > settings[SLEW_STEP] * WITHIN:
        share = settings[SLEW_STEP] * WITHIN / step
        force[0] = state[FORCE] + share * x
        force[1] = state[FORCE + 1] + share * y
        force[2] = state[FORCE + 2] + share * z
    return bool(step > settings[SLEW_STEP] * BEYOND)


@_compiled
def _aim(state: FloatArray, settings: FloatArray, loop: FloatArray, reading: FloatArray, force: FloatArray) -> None:
    tick = int(state[TICK])
    _clear(force)
    if 0 <= tick < state[LENGTH]:
        lead = int(state[LEAD])
        row = tick if tick < lead else lead + (tick - lead) % (loop.shape[0] - lead)
        for i in range(3):
            force[i] = loop[row, i]
    if not (_below(force, IMPLAUSIBLE_N) and _below(reading, IMPLAUSIBLE_M)):
        _let_go(state, NOT_A_NUMBER)
        return
    state[STIMULUS_CLIPPED] += _confine(force, settings[STIMULUS_CAP])
    stimulus_gain, spring_gain = _gains(state)
    for i in range(3):
        force[i] *= stimulus_gain
        state[EXCITATION + i] = force[i]
    _add_spring(state, settings, reading, spring_gain, force)
    state[TOTAL_CLIPPED] += _confine(force, settings[TOTAL_CAP])
    state[SLEW_LIMITED] += _limit_slew(state, settings, force)


@_compiled
def _fade(state: FloatArray, settings: FloatArray, force: FloatArray) -> None:
    left = 1.0 - (state[TICK] - state[LET_GO_AT] + 1.0) / settings[LET_GO_TICKS]
    for i in range(3):
        force[i] = max(left, 0.0) * state[LET_GO_FROM + i]
    if left <= 0.0:
        state[PHASE] = STILL


@_compiled
def record(state: FloatArray, buffer: FloatArray, reading: FloatArray) -> None:
    """One row into a ring: the last rows stay."""
    if state[PHASE] == PLAYING and state[RECORD_FROM] <= state[TICK] < state[LENGTH]:
        row = int(state[RECORDED]) % buffer.shape[0]
        for i in range(3):
            buffer[row, i] = state[FORCE + i]
            buffer[row, 3 + i] = state[EXCITATION + i]
        for i in range(9):
            buffer[row, 6 + i] = reading[i]
        state[RECORDED] += 1


@njit(TICK_SIGNATURE, cache=True, nogil=True, error_model="numpy")
def tick(
    state: FloatArray,
    settings: FloatArray,
    loop: FloatArray,
    buffer: FloatArray,
    reading: FloatArray,
    force: FloatArray,
) -> bool:
    """Decide the force of one tick. Whether all is over and the force off.

    state (STATE_SIZE,), settings (SETTINGS_SIZE,), loop (n, 3) in N, buffer (rows, ROW_SIZE): changed in place with
    state; reading (READING_SIZE,): as the rig sensed it; force (3,), N: the answer.
    """
    _hear(state, settings)
    if state[PHASE] in (PLAYING, RELEASING):
        _aim(state, settings, loop, reading, force)
    if state[PHASE] == LETTING_GO:
        _fade(state, settings, force)
    if state[PHASE] == STILL:
        _clear(force)
    _confine(force, settings[TOTAL_CAP])
    for i in range(3):
        state[FORCE + i] = force[i]
    state[PEAK] = max(state[PEAK], math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]))
    state[SENSOR_CLIPS] += reading[SENSOR_CLIPPED] == 1.0
    state[TICKS] += 1
    record(state, buffer, reading)
    state[TICK] += 1
    return bool(state[PHASE] == STILL)
