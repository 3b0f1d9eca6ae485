"""The safety layer's control tick: decides the force on the handle.

Steps of `tick`, in this order:

1. requests (stop, release) and timeouts change the phase (IDLE, PLAYING, RELEASING, LETTING_GO: see `cells`);
2. the position reading is checked (`plausibility`); an implausible one is a fault, which starts the safety fade;
3. the stimulus is capped, faded and added to spring and damper (`feedback`); the sum is capped, its slew rate limited;
4. the result is capped once more, independent of all steps before: no force above the cap, and none that is not a
   number, leaves `tick`.

Entry points: `tick`, `publish` and `record_missed_ticks`.
"""

import math
from pathlib import Path
from typing import Any

from numba import njit, types

from equalizer.signals.signal import FloatArray
from study.devices.governor.compiling import compute_fingerprint, njit_inline
from study.devices.governor.confine import EXCESS_FACTOR, LIMIT_FACTOR, clear_force, compute_norm, confine, is_bounded
from study.devices.governor.feedback import add_feedback
from study.devices.governor.plausibility import find_reading_fault
from study.devices.governor.telemetry_row import write_row
from study.devices.rig import SENSOR_CLIPPED

# isort: off
# fmt: off
from study.devices.governor.cells import (
    ELAPSED_TICKS, EXCITATION, FADE_IN, FADE_OUT, FAULT, FIRST_TICK, FORCE, HELD_TOO_LONG, IDLE, KEEP_ALIVE,
    LAST_KEEP_ALIVE_TICK, LAST_POSITION, LAST_READING_TICK, LAST_READING_TIME_S, LENGTH, LETTING_GO, LET_GO_FORCE,
    LET_GO_REQUEST, LET_GO_START, LET_GO_TICKS, LONGEST_HOLD, MISSED, NOT_A_NUMBER, NO_FAULT, ONSET_TICKS, PEAK_FORCE,
    PHASE, PLAYING, RAISED_COSINE, READING_TIME_S, RECORDED_ROWS, RECORD_FROM, RELEASE_REQUEST, RELEASE_START,
    RELEASING, SENSOR_CLIPS, SLEW_LIMITED, SLEW_STEP, SPRING_GAIN, SPRING_RAMP, STALLED, STIMULUS_CAP, STIMULUS_CLIPPED,
    STIMULUS_GAIN, STOPPED, STOP_REQUEST, TICK, TICKS, TICK_S, TOTAL_CAP, TOTAL_CLIPPED, WATCHDOG_TICKS,
)
# fmt: on
# isort: on

IMPLAUSIBLE_STIMULUS_N = 1e6
"""A stimulus with a component of this magnitude (N) or more is treated like NaN. Chosen far above any device's
force."""

MIN_ELAPSED_TICKS = 1e-3
"""Smallest interval between two readings (ticks), used where their time stamps are closer together or do not advance.
Chosen."""

VECTOR_TYPE, MATRIX_TYPE = types.float64[::1], types.float64[:, ::1]
"""numba types of contiguous arrays with one and two dimensions."""
TICK_SIGNATURE = types.boolean(VECTOR_TYPE, VECTOR_TYPE, MATRIX_TYPE, MATRIX_TYPE, VECTOR_TYPE, VECTOR_TYPE)
"""Signature of the entry point `tick`, whose docstring names the arguments; those of `publish` and
`record_missed_ticks` follow."""
PUBLISH_SIGNATURE = types.void(VECTOR_TYPE, VECTOR_TYPE, MATRIX_TYPE, VECTOR_TYPE)
MISSED_TICKS_SIGNATURE = types.void(VECTOR_TYPE, MATRIX_TYPE, VECTOR_TYPE, types.int64)


@njit_inline
def _start_safety_fade(state: FloatArray, fault: int) -> None:
    """Begin the fade of the last force to zero. The first fault is kept."""
    state[PHASE] = LETTING_GO
    state[LET_GO_START] = state[TICK]
    for i in range(3):
        state[LET_GO_FORCE + i] = state[FORCE + i]
    if state[FAULT] == NO_FAULT:
        state[FAULT] = fault


@njit_inline
def _update_phase_while_playing(state: FloatArray, settings: FloatArray) -> None:
    """End the stimulus: by request, at its length, without a keep-alive (watchdog), or after the longest time."""
    tick = state[TICK]
    if state[KEEP_ALIVE] != 0.0:
        state[KEEP_ALIVE] = 0.0
        state[LAST_KEEP_ALIVE_TICK] = tick
    if state[RELEASE_REQUEST] != 0.0 or tick >= state[LENGTH]:
        state[PHASE] = RELEASING
        state[RELEASE_START] = tick
    elif tick - state[LAST_KEEP_ALIVE_TICK] > settings[WATCHDOG_TICKS]:
        _start_safety_fade(state, STALLED)
    elif tick >= state[LONGEST_HOLD]:
        _start_safety_fade(state, HELD_TOO_LONG)


@njit_inline
def _update_phase(state: FloatArray, settings: FloatArray) -> None:
    """Change the phase by requests (in the order of precedence stop, let-go, release) and by time."""
    phase = state[PHASE]
    if state[STOP_REQUEST] != 0.0:
        if phase != IDLE and state[FAULT] == NO_FAULT:
            state[FAULT] = STOPPED
        state[PHASE] = IDLE
    elif state[LET_GO_REQUEST] != 0.0 and phase in (PLAYING, RELEASING):
        _start_safety_fade(state, NO_FAULT)
    elif phase == PLAYING:
        _update_phase_while_playing(state, settings)
    elif phase == RELEASING and state[TICK] - state[RELEASE_START] > state[FADE_OUT]:
        if state[FORCE] == 0.0 and state[FORCE + 1] == 0.0 and state[FORCE + 2] == 0.0:
            state[PHASE] = IDLE
        else:
            _start_safety_fade(state, NO_FAULT)  # the slew limit delayed the fade-out: a force remains


@njit_inline
def _compute_fade_gain(ticks: float, fade_ticks: float, raised_cosine: float) -> float:
    """Compute the gain of a fade-in: 1 from `fade_ticks` ticks on, else 0 up to 0 ticks; between, linear, or (1 -
    cos(pi ticks / fade_ticks)) / 2 where raised_cosine is not 0."""
    if ticks >= fade_ticks:
        return 1.0
    if ticks <= 0:
        return 0.0
    if raised_cosine != 0.0:
        return 0.5 - 0.5 * math.cos(math.pi * ticks / fade_ticks)
    return ticks / fade_ticks


@njit_inline
def _compute_gains(state: FloatArray) -> tuple[float, float]:
    """Compute the gains (0 to 1) of stimulus and of spring and damper at this tick. A release during a fade-in starts
    from the gain reached."""
    tick, raised_cosine = state[TICK], state[RAISED_COSINE]
    if state[PHASE] == PLAYING:
        state[STIMULUS_GAIN] = _compute_fade_gain(tick, state[FADE_IN], raised_cosine)
        state[SPRING_GAIN] = _compute_fade_gain(tick - state[FIRST_TICK], state[SPRING_RAMP], raised_cosine)
        return state[STIMULUS_GAIN], state[SPRING_GAIN]
    remaining_gain = 1.0 - _compute_fade_gain(tick - state[RELEASE_START], state[FADE_OUT], raised_cosine)
    return remaining_gain * state[STIMULUS_GAIN], remaining_gain * state[SPRING_GAIN]


@njit_inline
def _update_elapsed(state: FloatArray, settings: FloatArray) -> None:
    """Set the time since the last reading (ticks, at least `MIN_ELAPSED_TICKS`): from the time stamps of the readings
    where both have one, else from the number of ticks."""
    elapsed_ticks = state[TICK] - state[LAST_READING_TICK]
    if state[READING_TIME_S] > 0.0 and state[LAST_READING_TIME_S] > 0.0:
        elapsed_ticks = (state[READING_TIME_S] - state[LAST_READING_TIME_S]) / settings[TICK_S]
    state[ELAPSED_TICKS] = elapsed_ticks if elapsed_ticks > MIN_ELAPSED_TICKS else MIN_ELAPSED_TICKS
    state[LAST_READING_TICK], state[LAST_READING_TIME_S] = state[TICK], state[READING_TIME_S]


@njit_inline
def _limit_slew(state: FloatArray, settings: FloatArray, force: FloatArray) -> bool:
    """Shorten the step from the last force to the slew limit, in place (force (3,), N). Both forces lie within the cap,
    and a ball is convex, so that the new force lies within it too. Returns whether the step exceeded the limit by more
    than rounding."""
    x, y, z = force[0] - state[FORCE], force[1] - state[FORCE + 1], force[2] - state[FORCE + 2]
    step_n = compute_norm(x, y, z)
    if step_n > settings[SLEW_STEP] * LIMIT_FACTOR:
        step_share = settings[SLEW_STEP] * LIMIT_FACTOR / step_n
        force[0] = state[FORCE] + step_share * x
        force[1] = state[FORCE + 1] + step_share * y
        force[2] = state[FORCE + 2] + step_share * z
    return bool(step_n > settings[SLEW_STEP] * EXCESS_FACTOR)


@njit_inline
def _compute_force(
    state: FloatArray, settings: FloatArray, loop: FloatArray, reading: FloatArray, force: FloatArray
) -> None:
    """Fill force (3,), N: stimulus, spring and damper within all limits. An implausible stimulus or reading is a fault:
    it starts the safety fade instead."""
    tick = int(state[TICK])
    clear_force(force)
    if 0 <= tick < state[LENGTH]:
        onset_ticks = int(state[ONSET_TICKS])
        row = tick if tick < onset_ticks else onset_ticks + (tick - onset_ticks) % (loop.shape[0] - onset_ticks)
        for i in range(3):
            force[i] = loop[row, i]
    _update_elapsed(state, settings)
    fault = find_reading_fault(state, settings, reading) if is_bounded(force, IMPLAUSIBLE_STIMULUS_N) else NOT_A_NUMBER
    if fault != NO_FAULT:
        _start_safety_fade(state, fault)
        return
    state[STIMULUS_CLIPPED] += confine(force, settings[STIMULUS_CAP])
    stimulus_gain, spring_gain = _compute_gains(state)
    for i in range(3):
        force[i] *= stimulus_gain
        state[EXCITATION + i] = force[i]
    add_feedback(state, settings, reading, spring_gain, force)
    for i in range(3):
        state[LAST_POSITION + i] = reading[i]
    state[TOTAL_CLIPPED] += confine(force, settings[TOTAL_CAP])
    state[SLEW_LIMITED] += _limit_slew(state, settings, force)


@njit_inline
def _apply_safety_fade(state: FloatArray, settings: FloatArray, force: FloatArray) -> None:
    """Fill force (3,), N, during the safety fade: the last force before it, reduced linearly to zero within
    LET_GO_TICKS ticks. At zero the phase becomes IDLE."""
    remaining_gain = 1.0 - (state[TICK] - state[LET_GO_START] + 1.0) / settings[LET_GO_TICKS]
    for i in range(3):
        force[i] = max(remaining_gain, 0.0) * state[LET_GO_FORCE + i]
    if remaining_gain <= 0.0:
        state[PHASE] = IDLE


@njit_inline
def _record_row(state: FloatArray, buffer: FloatArray, reading: FloatArray) -> None:
    """Write command, excitation and reading (without its last element) of a tick of the recorded part into the
    recording ring, in place of the oldest row of a full one; do nothing outside of that part."""
    if state[PHASE] == PLAYING and state[RECORD_FROM] <= state[TICK] < state[LENGTH]:
        row = int(state[RECORDED_ROWS]) % buffer.shape[0]
        for i in range(3):
            buffer[row, i] = state[FORCE + i]
            buffer[row, 3 + i] = state[EXCITATION + i]
        for i in range(9):
            buffer[row, 6 + i] = reading[i]
        state[RECORDED_ROWS] += 1


def _compile_publish(sources_fingerprint: int) -> Any:
    """Compile `publish`. sources_fingerprint: captured so that a change of a source invalidates numba's cache."""

    @njit(PUBLISH_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def publish(state: FloatArray, settings: FloatArray, ring: FloatArray, reading: FloatArray) -> None:
        """Write the row of the tick just computed into the telemetry ring; do nothing for a ring without rows."""
        _ = sources_fingerprint
        if ring.shape[0] > 1:
            write_row(state, settings, ring, reading)

    return publish


def _compile_tick(sources_fingerprint: int) -> tuple[Any, Any]:
    """Compile `tick` and `record_missed_ticks`. sources_fingerprint: see `_compile_publish`."""

    @njit(MISSED_TICKS_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def record_missed_ticks(state: FloatArray, buffer: FloatArray, missed_reading: FloatArray, ticks: int) -> None:
        """Count missed ticks; recorded rows contain the last force, and `missed_reading` as the reading."""
        _ = sources_fingerprint
        for _tick_number in range(ticks):
            _record_row(state, buffer, missed_reading)
            state[TICK] += 1.0
            state[TICKS] += 1.0
            state[MISSED] += 1.0

    @njit(TICK_SIGNATURE, cache=True, nogil=True, error_model="numpy")
    def tick(
        state: FloatArray, settings: FloatArray, loop: FloatArray, buffer: FloatArray, reading: FloatArray,
        force: FloatArray,
    ) -> bool:  # fmt: skip
        """Compute the force of one tick. Returns whether the force is off and stays off. state (STATE_SIZE,), buffer
        (rows, ROW_SIZE): changed in place; settings (SETTINGS_SIZE,); loop (n, 3), N: the stimulus; reading
        (READING_SIZE,): from the rig's `sense`; force (3,), N: the result, written in place."""
        _ = sources_fingerprint
        _update_phase(state, settings)
        if state[PHASE] in (PLAYING, RELEASING):
            _compute_force(state, settings, loop, reading, force)
        if state[PHASE] == LETTING_GO:
            _apply_safety_fade(state, settings, force)
        if state[PHASE] == IDLE:
            clear_force(force)
        confine(force, settings[TOTAL_CAP])
        for i in range(3):
            state[FORCE + i] = force[i]
        state[PEAK_FORCE] = max(state[PEAK_FORCE], compute_norm(force[0], force[1], force[2]))
        state[SENSOR_CLIPS] += reading[SENSOR_CLIPPED] == 1.0
        state[TICKS] += 1
        _record_row(state, buffer, reading)
        state[TICK] += 1
        return bool(state[PHASE] == IDLE)

    return tick, record_missed_ticks


_SOURCES_FINGERPRINT = compute_fingerprint(Path(__file__).parent, Path(__file__).parents[1] / "rig.py")
"""Fingerprint of all files whose code is compiled into the entry points."""
tick, record_missed_ticks = _compile_tick(_SOURCES_FINGERPRINT)
publish = _compile_publish(_SOURCES_FINGERPRINT)
