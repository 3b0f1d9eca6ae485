"""Whether a reading of the position can be a handle's: where it is, how it got there, and whether it follows the force.

The bounds and their reasons: `protocols.definition.plausibility`. What passes may still be wrong; then it pulls with
the feedback's cap at the most.
"""

import math

from equalizer.signals.signal import FloatArray
from study.devices.governor.cells import (
    ACCELERATION,
    ACCELERATION_SHARE,
    AXIS_CHANGED,
    AXIS_EXPECTED,
    AXIS_FORCE,
    AXIS_LEAST,
    AXIS_MOST,
    AXIS_SPEED,
    AXIS_UNCHANGED,
    CHANGED,
    EASED,
    EASED_BEFORE,
    ELAPSED,
    EXCITATION,
    EXPECTED,
    EXPECTED_SPEED,
    FASTEST_STEP,
    FRICTION,
    JUMPED,
    LAST_POSITION,
    LAST_STEP,
    LEAST,
    LONGEST_JUMP,
    MOST,
    MOVING_FORCE,
    NO_FAULT,
    NOT_A_NUMBER,
    OUTSIDE,
    PASSED,
    PASSED_SHARE,
    PASSED_TWICE,
    PULL,
    RESOLUTION,
    SHAKEN,
    SHAKING,
    STALE,
    STALE_TICKS,
    TICK_S,
    UNCHANGED,
    WORKSPACE,
)
from study.devices.governor.compiling import part
from study.devices.governor.confine import is_bounded, norm_of

IMPLAUSIBLE_M = 0.5
"""A reading beyond this counts as no number at all."""

GRIPPED_KG, GRIPPED_N_S_PER_M, GRIPPED_N_PER_M = 1.0, 60.0, 3000.0
"""A handle in a hard grip moves no less than this. A whole arm has 0.55 kg, 6.5 N s/m, 135 N/m (Sci. Rep. srep18004),
a hard grip some 20 times that stiffness."""

AXIS_TIMES, AXIS_STRETCHES = 4.0, 2
"""An axis by itself is looked at in stretches of so many times what makes the whole position stale, and must have been
expected to move in each of so many in a row: while the others move, the linkage's friction holds an axis for longer."""

MOVING_BELOW_HZ = 80.0
"""Corner of the two low-passes before the expected motion. Faster forces move a gripped handle by less than a step of
the resolution; dry friction, computed at the rate of the loop, would make a drift of them that no handle follows."""

STEPS_OF_RESOLUTION = 2.0
"""Between the differences of three readings that are each wrong by half a step; and so far must a handle be expected
to have moved, before a reading that did not change is stale."""


@part
def _move_gripped(state: FloatArray, tick_s: float, force_n: float, at: tuple[int, int, int, int]) -> None:
    """Move the gripped handle along an axis for a tick, and widen the range in which it was. at: cells of position,
    speed, least and most position."""
    place, speed, least, most = at
    left = force_n - GRIPPED_N_PER_M * state[place]
    left -= GRIPPED_N_S_PER_M * state[speed]
    state[speed] += tick_s / GRIPPED_KG * left
    state[place] += tick_s * state[speed]
    state[least] = min(state[least], state[place])
    state[most] = max(state[most], state[place])


@part
def _expect_motion(state: FloatArray, settings: FloatArray) -> None:
    """Update the motion expected of the gripped handle in the last tick, by the stimulus: a hand at rest has held
    before what it holds now. Dry friction passes only the part of a force that exceeds the last one that moved the
    handle (Prandtl's play operator)."""
    for i in range(3):
        state[PASSED + i] += settings[PASSED_SHARE] * (state[EXCITATION + i] - state[PASSED + i])
        state[PASSED_TWICE + i] += settings[PASSED_SHARE] * (state[PASSED + i] - state[PASSED_TWICE + i])
    x = state[PASSED_TWICE] - state[MOVING_FORCE]
    y = state[PASSED_TWICE + 1] - state[MOVING_FORCE + 1]
    z = state[PASSED_TWICE + 2] - state[MOVING_FORCE + 2]
    beyond = norm_of(x, y, z)
    share = 1.0 - settings[FRICTION] / beyond if beyond > settings[FRICTION] else 0.0
    state[MOVING_FORCE] += share * x
    state[MOVING_FORCE + 1] += share * y
    state[MOVING_FORCE + 2] += share * z
    for i in range(3):
        at = EXPECTED + i, EXPECTED_SPEED + i, LEAST + i, MOST + i
        _move_gripped(state, settings[TICK_S], state[MOVING_FORCE + i], at)


@part
def _has_changed(state: FloatArray, settings: FloatArray, reading: FloatArray) -> bool:
    """Since the reading that was the last to change. Then it is that one itself."""
    away = norm_of(reading[0] - state[CHANGED], reading[1] - state[CHANGED + 1], reading[2] - state[CHANGED + 2])
    if away < 0.5 * settings[RESOLUTION]:
        return False
    for i in range(3):
        state[CHANGED + i] = reading[i]
        state[LEAST + i] = state[MOST + i] = state[EXPECTED + i]
    state[EASED_BEFORE] = state[EASED]
    return True


@part
def _gave_way(state: FloatArray, settings: FloatArray, way: float) -> bool:
    """Whether so much of the spring's pull was taken back that it must have moved even a gripped handle."""
    taken_back = (state[EASED] - state[EASED_BEFORE]) * state[PULL]
    return bool(taken_back > settings[FRICTION] + GRIPPED_N_PER_M * way)


@part
def _is_stale(state: FloatArray, settings: FloatArray, reading: FloatArray) -> bool:
    if _has_changed(state, settings, reading):
        state[UNCHANGED] = 0.0
        return False
    state[UNCHANGED] += 1.0
    expected = max(state[MOST] - state[LEAST], state[MOST + 1] - state[LEAST + 1], state[MOST + 2] - state[LEAST + 2])
    way = STEPS_OF_RESOLUTION * settings[RESOLUTION]
    return bool(state[UNCHANGED] >= settings[STALE_TICKS] and (expected > way or _gave_way(state, settings, way)))


@part
def _expect_along_axis(state: FloatArray, settings: FloatArray, i: int) -> None:
    """As `_expect_motion`, for an axis by itself: its share of the force must exceed the friction alone."""
    beyond = state[PASSED_TWICE + i] - state[AXIS_FORCE + i]
    if abs(beyond) > settings[FRICTION]:
        state[AXIS_FORCE + i] += beyond - math.copysign(settings[FRICTION], beyond)
    at = AXIS_EXPECTED + i, AXIS_SPEED + i, AXIS_LEAST + i, AXIS_MOST + i
    _move_gripped(state, settings[TICK_S], state[AXIS_FORCE + i], at)


@part
def _is_axis_stale(state: FloatArray, settings: FloatArray, reading: FloatArray) -> bool:
    """Whether an axis has not changed although its share of the force must have moved it, while the others move on."""
    stale, stretch, half = False, AXIS_TIMES * settings[STALE_TICKS], 0.5 * settings[RESOLUTION]
    for i in range(3):
        _expect_along_axis(state, settings, i)
        if abs(reading[i] - state[AXIS_CHANGED + i]) >= half:
            state[AXIS_CHANGED + i], state[AXIS_UNCHANGED + i] = reading[i], 0.0
            state[AXIS_LEAST + i] = state[AXIS_MOST + i] = state[AXIS_EXPECTED + i]
            continue
        state[AXIS_UNCHANGED + i] += 1.0
        if state[AXIS_UNCHANGED + i] % stretch != 0.0:
            continue
        if state[AXIS_MOST + i] - state[AXIS_LEAST + i] <= STEPS_OF_RESOLUTION * settings[RESOLUTION]:
            state[AXIS_UNCHANGED + i] = 0.0
        stale = stale or state[AXIS_UNCHANGED + i] >= AXIS_STRETCHES * stretch
        state[AXIS_LEAST + i] = state[AXIS_MOST + i] = state[AXIS_EXPECTED + i]
    return stale


@part
def _is_shaken(state: FloatArray, settings: FloatArray, x: float, y: float, z: float) -> bool:
    """x, y, z: the present step, in m per tick."""
    last = state[LAST_STEP]
    if not math.isnan(last):  # as it is before the second reading
        change = norm_of(x - last, y - state[LAST_STEP + 1], z - state[LAST_STEP + 2])
        change = max(0.0, change - STEPS_OF_RESOLUTION * settings[RESOLUTION])
        acceleration = change / (settings[TICK_S] * settings[TICK_S])
        state[SHAKING] += settings[ACCELERATION_SHARE] * (acceleration - state[SHAKING])
    state[LAST_STEP], state[LAST_STEP + 1], state[LAST_STEP + 2] = x, y, z
    return bool(state[SHAKING] > settings[ACCELERATION])


@part
def fault_of_reading(state: FloatArray, settings: FloatArray, reading: FloatArray) -> int:
    """NO_FAULT, or why the force must be let go. LAST_POSITION and ELAPSED say what was before."""
    if not is_bounded(reading, IMPLAUSIBLE_M):
        return NOT_A_NUMBER
    if not norm_of(reading[0], reading[1], reading[2]) <= settings[WORKSPACE]:
        return OUTSIDE
    last_x = state[LAST_POSITION]
    if math.isnan(last_x):  # the first reading
        _has_changed(state, settings, reading)
        for i in range(3):
            state[AXIS_CHANGED + i] = reading[i]
        return NO_FAULT
    x, y, z = reading[0] - last_x, reading[1] - state[LAST_POSITION + 1], reading[2] - state[LAST_POSITION + 2]
    # Driver and loop have clocks of their own: readings may be a tick apart, though they were taken one after another.
    ticks = max(1.0, state[ELAPSED])
    way = norm_of(x, y, z)
    if not (way <= settings[LONGEST_JUMP] and way <= settings[FASTEST_STEP] * ticks + settings[RESOLUTION]):
        return JUMPED
    if _is_shaken(state, settings, x / ticks, y / ticks, z / ticks):
        return SHAKEN
    _expect_motion(state, settings)
    axis_stale = _is_axis_stale(state, settings, reading)
    return STALE if _is_stale(state, settings, reading) or axis_stale else NO_FAULT
