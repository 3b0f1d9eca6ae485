"""Writes the row of a tick into the telemetry ring; in a full ring, in place of the oldest row.

The loop is the only writer and never waits; readers (`study.devices.telemetry`) only read. A row that is being written
is recognised by its index and its checksum, on any processor: the method does not depend on the order of the stores.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.governor.cells import (
    BEGIN_TIME_S,
    EXCITATION,
    FAULT,
    FIRST_TICK,
    FORCE,
    MISSED,
    PHASE,
    PLAYING,
    READING_TIME_S,
    RELEASING,
    RING_ACCELERATION,
    RING_APPLIED,
    RING_CHECK,
    RING_COMMANDED,
    RING_COUNT,
    RING_FACTORS,
    RING_FAULT,
    RING_FOLD,
    RING_INDEX,
    RING_MISSED,
    RING_PHASE,
    RING_POSITION,
    RING_TICK,
    RING_TIME_S,
    RING_VELOCITY,
    TICK,
    TICK_S,
    VELOCITY,
)
from study.devices.governor.compiling import njit_inline


@njit_inline
def write_row(state: FloatArray, settings: FloatArray, ring: FloatArray, reading: FloatArray) -> None:
    """Write the row of a tick, after `govern.tick` has advanced TICK. ring (1 + rows, RING_WIDTH): a header, then the
    rows. Time in s, position in m, acceleration in m/s², forces in N."""
    row_count = ring[0, RING_COUNT]
    row = ring[1 + int(row_count) % (ring.shape[0] - 1)]
    # The excitation and the velocity are computed in these two phases only.
    is_force_computed = state[PHASE] in (PLAYING, RELEASING)
    row[RING_INDEX] = row_count
    row[RING_TIME_S] = state[READING_TIME_S]
    if not state[READING_TIME_S] > 0.0:
        row[RING_TIME_S] = state[BEGIN_TIME_S] + (state[TICK] - state[FIRST_TICK]) * settings[TICK_S]
    row[RING_TICK] = state[TICK] - 1.0
    for i in range(3):
        row[RING_POSITION + i] = reading[i]
        row[RING_ACCELERATION + i] = reading[3 + i]
        row[RING_APPLIED + i] = state[FORCE + i]
        row[RING_COMMANDED + i] = state[EXCITATION + i] if is_force_computed else 0.0
        row[RING_VELOCITY + i] = state[VELOCITY + i] if is_force_computed else math.nan
    row[RING_PHASE], row[RING_FAULT], row[RING_MISSED] = state[PHASE], state[FAULT], state[MISSED]
    bits = row.view(np.int64)
    checksum = np.int64(0)
    for i in range(RING_CHECK):
        checksum += (bits[i] ^ (bits[i] >> RING_FOLD)) * RING_FACTORS[i]
    bits[RING_CHECK] = checksum
    ring[0, RING_COUNT] = row_count + 1.0
