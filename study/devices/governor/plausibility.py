"""Plausibility of position readings: workspace, step length, acceleration, and stale (frozen) readings.

Spring and damper turn a false position into force, so that an implausible reading releases the force. A reading is
stale if it does not change although the force must have moved even a firmly gripped handle (simulated: m a + b v + k x
= F after dry friction). Bounds and their reasons: `protocols.definition.plausibility`. A false reading within them
causes at most the feedback's force limit.
"""

import math

from equalizer.signals.signal import FloatArray
from study.devices.governor.cells import (
    ACCELERATION_SMOOTHING,
    AXIS_EXPECTED,
    AXIS_FORCE,
    AXIS_HIGH,
    AXIS_LOW,
    AXIS_REFERENCE,
    AXIS_SPEED,
    AXIS_UNCHANGED_TICKS,
    ELAPSED_TICKS,
    EXCITATION,
    EXPECTED_POSITION,
    EXPECTED_SPEED,
    FASTEST_STEP,
    FEEDBACK_FORCE,
    FEEDBACK_REDUCTION,
    FRICTION,
    JUMPED,
    LAST_POSITION,
    LAST_STEP,
    LONGEST_JUMP,
    MAX_ACCELERATION,
    MOVING_FORCE,
    NO_FAULT,
    NOT_A_NUMBER,
    OUTSIDE,
    RANGE_HIGH,
    RANGE_LOW,
    REDUCTION_AT_CHANGE,
    REFERENCE_POSITION,
    RESOLUTION,
    SHAKEN,
    SMOOTHED_ACCELERATION,
    SMOOTHED_STIMULUS,
    STALE,
    STALE_TICKS,
    STALLED,
    STIMULUS_SMOOTHING,
    TICK_S,
    TWICE_SMOOTHED_STIMULUS,
    UNCHANGED_TICKS,
    WORKSPACE_RADIUS,
)
from study.devices.governor.compiling import njit_inline
from study.devices.governor.confine import compute_norm, is_bounded

LATE_S = 0.1
"""Time without a tick (s) after which a real rig's loop counts as hanging; a later reading cannot be compared with the
one before. Chosen: a busy computer is late by some 10 ms."""

MAX_COMPONENT_M = 0.5
"""A reading with a component (m) of this magnitude or more is treated as invalid, like NaN. Chosen: the
upper bound of the workspace's radius in `protocols.definition.plausibility`."""

GRIPPED_KG, GRIPPED_N_S_PER_M, GRIPPED_N_PER_M = 1.0, 60.0, 3000.0
"""Mass, damping and stiffness of a handle in a hard grip; assumed: a real handle moves no less. A whole arm has 0.55
kg, 6.5 N s/m, 135 N/m (Sci. Rep. srep18004), a hard grip some 20 times that stiffness."""

AXIS_STRETCH_RATIO, AXIS_STRETCH_COUNT = 4.0, 2
"""Length of the stretches of time over which a single axis is tested, in units of `STALE_TICKS`, and number of
successive stretches, each with an expected motion, after which an unchanged axis is stale. Chosen: longer than for the
whole position, because friction of the linkage can hold one axis while the others move."""

MOTION_CORNER_HZ = 80.0
"""Corner frequency (Hz) of the two first-order low-passes before the expected motion. Faster forces hardly move a
gripped handle; the friction model, computed at the loop rate, would turn them into a drift that does not occur."""

QUANTISATION_STEPS = 2.0
"""Largest effect of quantisation, in units of the resolution, on the second difference of three readings, each wrong by
half a step. Also the expected motion beyond which an unchanged reading is stale."""


@njit_inline
def _integrate_gripped_handle(
    state: FloatArray, tick_s: float, force_n: float, cell_indices: tuple[int, int, int, int]
) -> None:
    """Integrate the gripped handle along one axis over a tick (semi-implicit Euler), and extend its range. tick_s: s;
    force_n: N. cell_indices: of position (m), velocity (m/s), least and greatest position in `state`."""
    position, velocity, lowest, highest = cell_indices
    net_force_n = force_n - GRIPPED_N_PER_M * state[position]
    net_force_n -= GRIPPED_N_S_PER_M * state[velocity]
    state[velocity] += tick_s / GRIPPED_KG * net_force_n
    state[position] += tick_s * state[velocity]
    state[lowest] = min(state[lowest], state[position])
    state[highest] = max(state[highest], state[position])


@njit_inline
def _update_expected_motion(state: FloatArray, settings: FloatArray) -> None:
    """Update the motion that the stimulus, without spring and damper, must have caused in a gripped handle over the
    last tick. Dry friction follows the play operator (Prandtl): the force that moves the handle changes only where the
    stimulus differs from it by more than the friction."""
    for i in range(3):
        state[SMOOTHED_STIMULUS + i] += settings[STIMULUS_SMOOTHING] * (
            state[EXCITATION + i] - state[SMOOTHED_STIMULUS + i]
        )
        state[TWICE_SMOOTHED_STIMULUS + i] += settings[STIMULUS_SMOOTHING] * (
            state[SMOOTHED_STIMULUS + i] - state[TWICE_SMOOTHED_STIMULUS + i]
        )
    x = state[TWICE_SMOOTHED_STIMULUS] - state[MOVING_FORCE]
    y = state[TWICE_SMOOTHED_STIMULUS + 1] - state[MOVING_FORCE + 1]
    z = state[TWICE_SMOOTHED_STIMULUS + 2] - state[MOVING_FORCE + 2]
    difference_n = compute_norm(x, y, z)
    moved_share = 1.0 - settings[FRICTION] / difference_n if difference_n > settings[FRICTION] else 0.0
    state[MOVING_FORCE] += moved_share * x
    state[MOVING_FORCE + 1] += moved_share * y
    state[MOVING_FORCE + 2] += moved_share * z
    for i in range(3):
        cell_indices = EXPECTED_POSITION + i, EXPECTED_SPEED + i, RANGE_LOW + i, RANGE_HIGH + i
        _integrate_gripped_handle(state, settings[TICK_S], state[MOVING_FORCE + i], cell_indices)


@njit_inline
def _update_reference(state: FloatArray, settings: FloatArray, reading: FloatArray) -> bool:
    """Make the reading the new reference, and restart the expected range, if it differs by half the resolution or more
    from the reference, the last reading that had changed (at first the origin). Returns whether this is so."""
    distance_m = compute_norm(
        reading[0] - state[REFERENCE_POSITION],
        reading[1] - state[REFERENCE_POSITION + 1],
        reading[2] - state[REFERENCE_POSITION + 2],
    )
    if distance_m < 0.5 * settings[RESOLUTION]:
        return False
    for i in range(3):
        state[REFERENCE_POSITION + i] = reading[i]
        state[RANGE_LOW + i] = state[RANGE_HIGH + i] = state[EXPECTED_POSITION + i]
    state[REDUCTION_AT_CHANGE] = state[FEEDBACK_REDUCTION]
    return True


@njit_inline
def _must_have_moved(state: FloatArray, settings: FloatArray, distance_m: float) -> bool:
    """Whether the spring's force has been reduced so far, since the last change, that even a gripped handle must have
    moved by `distance_m` (m): by more than friction + stiffness of the grip * distance."""
    released_n = (state[FEEDBACK_REDUCTION] - state[REDUCTION_AT_CHANGE]) * state[FEEDBACK_FORCE]
    return bool(released_n > settings[FRICTION] + GRIPPED_N_PER_M * distance_m)


@njit_inline
def _is_stale(state: FloatArray, settings: FloatArray, reading: FloatArray) -> bool:
    """Whether the position has not changed for `STALE_TICKS`, although a gripped handle must have moved. Updates the
    reference and the count of unchanged ticks."""
    if _update_reference(state, settings, reading):
        state[UNCHANGED_TICKS] = 0.0
        return False
    state[UNCHANGED_TICKS] += 1.0
    expected_range_m = max(
        state[RANGE_HIGH] - state[RANGE_LOW],
        state[RANGE_HIGH + 1] - state[RANGE_LOW + 1],
        state[RANGE_HIGH + 2] - state[RANGE_LOW + 2],
    )
    distance_m = QUANTISATION_STEPS * settings[RESOLUTION]
    return bool(
        state[UNCHANGED_TICKS] >= settings[STALE_TICKS]
        and (expected_range_m > distance_m or _must_have_moved(state, settings, distance_m))
    )


@njit_inline
def _update_expected_axis_motion(state: FloatArray, settings: FloatArray, i: int) -> None:
    """Update the motion expected along axis i alone, as `_update_expected_motion` does for all axes, with the full
    friction on its component of the force."""
    difference_n = state[TWICE_SMOOTHED_STIMULUS + i] - state[AXIS_FORCE + i]
    if abs(difference_n) > settings[FRICTION]:
        state[AXIS_FORCE + i] += difference_n - math.copysign(settings[FRICTION], difference_n)
    cell_indices = AXIS_EXPECTED + i, AXIS_SPEED + i, AXIS_LOW + i, AXIS_HIGH + i
    _integrate_gripped_handle(state, settings[TICK_S], state[AXIS_FORCE + i], cell_indices)


@njit_inline
def _is_axis_stale(state: FloatArray, settings: FloatArray, reading: FloatArray) -> bool:
    """Whether the reading of a single axis is stale: unchanged although its component of the force must have moved
    it. Updates the expected motion, the reference and the count of unchanged ticks of every axis."""
    is_stale, stretch_ticks, half_resolution = (
        False,
        AXIS_STRETCH_RATIO * settings[STALE_TICKS],
        0.5 * settings[RESOLUTION],
    )
    for i in range(3):
        _update_expected_axis_motion(state, settings, i)
        if abs(reading[i] - state[AXIS_REFERENCE + i]) >= half_resolution:
            state[AXIS_REFERENCE + i], state[AXIS_UNCHANGED_TICKS + i] = reading[i], 0.0
            state[AXIS_LOW + i] = state[AXIS_HIGH + i] = state[AXIS_EXPECTED + i]
            continue
        state[AXIS_UNCHANGED_TICKS + i] += 1.0
        if state[AXIS_UNCHANGED_TICKS + i] % stretch_ticks != 0.0:
            continue
        if state[AXIS_HIGH + i] - state[AXIS_LOW + i] <= QUANTISATION_STEPS * settings[RESOLUTION]:
            state[AXIS_UNCHANGED_TICKS + i] = 0.0
        is_stale = is_stale or state[AXIS_UNCHANGED_TICKS + i] >= AXIS_STRETCH_COUNT * stretch_ticks
        state[AXIS_LOW + i] = state[AXIS_HIGH + i] = state[AXIS_EXPECTED + i]
    return is_stale


@njit_inline
def _is_shaken(state: FloatArray, settings: FloatArray, x: float, y: float, z: float) -> bool:
    """Whether the low-passed acceleration of the readings exceeds its bound. Updates it and the last step.
    x, y, z: the latest step, in m per tick."""
    last_x = state[LAST_STEP]
    if not math.isnan(last_x):  # NaN at the first step
        step_change_m = compute_norm(x - last_x, y - state[LAST_STEP + 1], z - state[LAST_STEP + 2])
        step_change_m = max(0.0, step_change_m - QUANTISATION_STEPS * settings[RESOLUTION])
        acceleration_mps2 = step_change_m / (settings[TICK_S] * settings[TICK_S])
        state[SMOOTHED_ACCELERATION] += settings[ACCELERATION_SMOOTHING] * (
            acceleration_mps2 - state[SMOOTHED_ACCELERATION]
        )
    state[LAST_STEP], state[LAST_STEP + 1], state[LAST_STEP + 2] = x, y, z
    return bool(state[SMOOTHED_ACCELERATION] > settings[MAX_ACCELERATION])


@njit_inline
def find_reading_fault(state: FloatArray, settings: FloatArray, reading: FloatArray) -> int:
    """Find the fault of a reading: its code, for which the force must be released, or NO_FAULT. reading: its first
    three numbers are the position, m. `state` holds the last position (LAST_POSITION; NaN before the first reading) and
    the ticks since then (ELAPSED_TICKS). Updates the cells of this module in `state`."""
    if not is_bounded(reading, MAX_COMPONENT_M):
        return NOT_A_NUMBER
    last_x = state[LAST_POSITION]
    # The program can be stopped between the start of a tick and its reading, where the loop's own check misses it.
    if state[ELAPSED_TICKS] * settings[TICK_S] > LATE_S and not math.isnan(last_x):
        return STALLED
    if not compute_norm(reading[0], reading[1], reading[2]) <= settings[WORKSPACE_RADIUS]:
        return OUTSIDE
    if math.isnan(last_x):  # the first reading
        _update_reference(state, settings, reading)
        for i in range(3):
            state[AXIS_REFERENCE + i] = reading[i]
        return NO_FAULT
    x, y, z = reading[0] - last_x, reading[1] - state[LAST_POSITION + 1], reading[2] - state[LAST_POSITION + 2]
    # Driver and loop have separate clocks: time stamps of successive samples may be less than a tick apart.
    ticks = max(1.0, state[ELAPSED_TICKS])
    step_m = compute_norm(x, y, z)
    if not (step_m <= settings[LONGEST_JUMP] and step_m <= settings[FASTEST_STEP] * ticks + settings[RESOLUTION]):
        return JUMPED
    if _is_shaken(state, settings, x / ticks, y / ticks, z / ticks):
        return SHAKEN
    _update_expected_motion(state, settings)
    axis_stale = _is_axis_stale(state, settings, reading)
    return STALE if _is_stale(state, settings, reading) or axis_stale else NO_FAULT
