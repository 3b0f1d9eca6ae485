"""Newest sample of a sensor: passed from the thread that reads the sensor to a control loop that must not wait.

A ring buffer with a sequence counter, for one writer and any number of readers, compiled code included. Readers take no
lock. A reader copies the newest row, then checks by the counter that the writer cannot have overwritten that row
meanwhile; otherwise it copies again. The writer's lock serves as a memory barrier: its release makes a row visible
before the counter that refers to it.
"""

import threading

import numpy as np

from equalizer.signals.signal import FloatArray

MAX_AGE_S = 0.05
"""Age in s above which a sample no longer counts: fifty ticks of the control loop, and longer than a thread waits for
its turn on a busy computer."""

COUNT, REST_ACCELERATION, ROWS = 0, 1, 16
"""Columns of the first row: number of samples so far, first of three for the acceleration at rest. ROWS: number of
further rows, the ring of samples."""
TAKEN_S, SENSED, CLIPPED, WIDTH = 0, 1, 4, 5
"""Columns of a sample: time of arrival by the monotonic clock (s), first of three for the acceleration (m/s²), 1 where
a channel was at its limit. WIDTH: number of columns."""


class NewestSample:
    """Ring buffer of samples. Only one thread may call `add_sample`; any thread may read."""

    def __init__(self) -> None:
        self.rows: FloatArray = np.zeros((1 + ROWS, WIDTH))
        """(1 + ROWS, WIDTH): counter and rest acceleration, then the ring."""
        self._barrier = threading.Lock()

    def add_sample(self, taken_s: float, acceleration: FloatArray, clipped: bool) -> None:
        """Add a sample. taken_s: time of arrival by `time.monotonic`; acceleration: (3,), m/s², as sensed;
        clipped: whether a channel is at its limit."""
        count = self.rows[0, COUNT]
        with self._barrier:
            self.rows[1 + int(count) % ROWS] = taken_s, *acceleration, clipped
        self.rows[0, COUNT] = count + 1.0

    def latest(self) -> FloatArray | None:
        """(WIDTH,): copy of the newest row, as sensed, of any age. None before the first sample."""
        while count := int(self.rows[0, COUNT]):
            row: FloatArray = self.rows[1 + (count - 1) % ROWS].copy()
            # The writer may be filling the next row: this row is intact while fewer than ROWS - 1 more were written.
            if self.rows[0, COUNT] - count < ROWS - 1:
                return row
        return None

    def set_rest(self, acceleration: FloatArray) -> None:
        """Set the reading at rest (3,), m/s², which `read_zeroed` subtracts (such as gravity and offset)."""
        self.rows[0, REST_ACCELERATION : REST_ACCELERATION + 3] = acceleration

    def read_zeroed(self, now_s: float) -> tuple[FloatArray, bool]:
        """Acceleration less the reading at rest, (3,), m/s², NaN without a sample younger than `MAX_AGE_S`; and whether
        a channel is at its limit. now_s: by `time.monotonic`."""
        row = self.latest()
        if row is None or now_s - row[TAKEN_S] > MAX_AGE_S:
            return np.full(3, np.nan), False
        return row[SENSED : SENSED + 3] - self.rows[0, REST_ACCELERATION : REST_ACCELERATION + 3], bool(row[CLIPPED])
