"""Lock-free ring buffer that passes the newest accelerometer sample from its reading thread to a control loop.

One thread writes (`sensor`), any number of threads read: Python by `read_zeroed`, the compiled control loop by the same
steps in `force_dimension.tick_io`. Readers take no lock. A reader copies the newest row, then checks by the sample
counter that the writer cannot have overwritten that row in the meantime; otherwise it copies again. The writer's lock
serves as a memory barrier only: its release makes a row visible before the counter that refers to it.
"""

import threading

import numpy as np

from equalizer.signals.signal import FloatArray

MAX_AGE_S = 0.05
"""Age (s) above which a sample is treated as missing: fifty ticks of the control loop at 1 kHz, and longer than a
thread waits to be scheduled on a busy computer."""

SAMPLE_COUNT, REST_MPS2, RING_SIZE = 0, 1, 16
"""Columns of the first row of `NewestSample.rows`: number of samples so far; first of three for the acceleration at
rest (m/s²). RING_SIZE: number of further rows, which hold the samples. Chosen: a reader repeats its copy only where 15
samples (7 ms at 2 kHz) arrive during it."""
ARRIVAL_S, SENSED_MPS2, IS_CLIPPED, COLUMN_COUNT = 0, 1, 4, 5
"""Columns of a sample: time of arrival by the monotonic clock (s), first of three for the acceleration (m/s²), 1 where
a channel was at its limit. COLUMN_COUNT: number of columns."""


class NewestSample:
    """Ring buffer of samples. Only one thread may call `add_sample`; any thread may read."""

    def __init__(self) -> None:
        self.rows: FloatArray = np.zeros((1 + RING_SIZE, COLUMN_COUNT))
        """(1 + RING_SIZE, COLUMN_COUNT): counter and acceleration at rest, then the ring."""
        self._barrier = threading.Lock()

    def add_sample(self, arrival_s: float, acceleration: FloatArray, clipped: bool) -> None:
        """Add a sample. arrival_s: time of arrival by `time.monotonic`; acceleration: (3,), m/s², as sensed;
        clipped: whether a channel is at its limit."""
        sample_count = self.rows[0, SAMPLE_COUNT]
        with self._barrier:
            self.rows[1 + int(sample_count) % RING_SIZE] = arrival_s, *acceleration, clipped
        self.rows[0, SAMPLE_COUNT] = sample_count + 1.0

    def _copy_newest_row(self) -> FloatArray | None:
        """Copy the newest row (COLUMN_COUNT,): as sensed, of any age. None before the first sample."""
        while sample_count := int(self.rows[0, SAMPLE_COUNT]):
            row: FloatArray = self.rows[1 + (sample_count - 1) % RING_SIZE].copy()
            # The writer may be filling the next row: this row is intact while fewer than RING_SIZE - 1 more were added.
            if self.rows[0, SAMPLE_COUNT] - sample_count < RING_SIZE - 1:
                return row
        return None

    def set_rest(self, acceleration: FloatArray) -> None:
        """Set the reading at rest (3,), m/s², which `read_zeroed` subtracts (such as gravity and offset)."""
        self.rows[0, REST_MPS2 : REST_MPS2 + 3] = acceleration

    def read_zeroed(self, now_s: float) -> tuple[FloatArray, bool]:
        """Read the newest acceleration less the reading at rest, (3,), m/s², and whether it was marked as clipped; NaN
        and False where there is none, or it is older than `MAX_AGE_S`. now_s: present time by `time.monotonic`."""
        row = self._copy_newest_row()
        if row is None or now_s - row[ARRIVAL_S] > MAX_AGE_S:
            return np.full(3, np.nan), False
        return row[SENSED_MPS2 : SENSED_MPS2 + 3] - self.rows[0, REST_MPS2 : REST_MPS2 + 3], bool(row[IS_CLIPPED])
