"""Newest sample of a sensor, handed without locks from the thread that reads it to a loop that must not wait.

One writer, any number of readers, compiled ones too. A reader sees a whole sample, unless the writer laps it within a
reading: then it reads once more. The lock is a barrier: its release makes a row visible before the count that names it.
"""

import threading

import numpy as np

from equalizer.signals.signal import FloatArray

FRESH_S = 0.05
"""A sample that is older is none: fifty ticks, and longer than a busy computer leaves a thread waiting."""

COUNT, REST, ROWS = 0, 1, 16
"""Columns of the first row: number of samples so far, acceleration that counts as zero (3). The other rows are
samples."""
TAKEN_S, SENSED, CLIPPED, WIDTH = 0, 1, 4, 5
"""Columns of a sample: time of arrival by the monotonic clock, acceleration (3), m/s², whether a channel was at its
limit."""


class NewestSample:
    """Written by one thread."""

    def __init__(self) -> None:
        self.rows: FloatArray = np.zeros((1 + ROWS, WIDTH))
        self._barrier = threading.Lock()

    def put(self, taken_s: float, acceleration: FloatArray, clipped: bool) -> None:
        """taken_s: time of arrival by `time.monotonic`; acceleration: (3,), m/s², as sensed; clipped: whether a channel
        is at its limit."""
        count = self.rows[0, COUNT]
        with self._barrier:
            self.rows[1 + int(count) % ROWS] = taken_s, *acceleration, clipped
        self.rows[0, COUNT] = count + 1.0

    def latest(self) -> FloatArray | None:
        """A row, as it was sensed, however old. None before the first."""
        while count := int(self.rows[0, COUNT]):
            row: FloatArray = self.rows[1 + (count - 1) % ROWS].copy()
            if self.rows[0, COUNT] - count < ROWS - 1:
                return row
        return None

    def count_as_none(self, acceleration: FloatArray) -> None:
        """(3,): read so, it is at rest."""
        self.rows[0, REST : REST + 3] = acceleration

    def fresh(self, now_s: float) -> tuple[FloatArray, bool]:
        """Acceleration (3,), m/s², NaN where there is none of now; whether a channel is at its limit."""
        row = self.latest()
        if row is None or now_s - row[TAKEN_S] > FRESH_S:
            return np.full(3, np.nan), False
        return row[SENSED : SENSED + 3] - self.rows[0, REST : REST + 3], bool(row[CLIPPED])
