"""Ring of the last minutes of samples, with their time of arrival and the packets lost. One thread adds, others
read."""

import threading
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.samples import Counts, Samples

KEPT_S = 300.0
"""Time for which samples are kept, by their arrival: the longest recording, and the minutes before it to which the
clock is fitted."""


class Table:
    """Rows that only ever come to its end, shape (n, columns), in steps that take no time each."""

    def __init__(self, columns: int) -> None:
        self._rows, self._from, self._end = np.zeros((1024, columns)), 0, 0

    @property
    def rows(self) -> FloatArray:
        """A view, until the next change."""
        return self._rows[self._from : self._end]

    def append(self, rows: FloatArray) -> None:
        """rows: (k, columns). The array is made anew, twice as long, only when it is full."""
        if self._end + len(rows) > len(self._rows):
            kept = self.rows
            roomier = np.zeros((max(1024, 2 * (len(kept) + len(rows))), self._rows.shape[1]))
            roomier[: len(kept)] = kept
            self._rows, self._from, self._end = roomier, 0, len(kept)
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def drop(self, rows: int) -> None:
        """The oldest."""
        self._from += rows


@dataclass(frozen=True, slots=True, eq=False)
class ArrivedSamples:
    """Samples that arrived within an interval, and their arrivals."""

    device_s: FloatArray
    """(n,), by the board's clock."""
    restarts: FloatArray
    """(n,), as in `Samples`."""
    raw: FloatArray
    """(n, 3)."""
    last_device_s: FloatArray
    """(m,), of the newest sample of each arrival."""
    last_restarts: FloatArray
    """(m,)."""
    arrived_s: FloatArray
    """(m,), by the host's clock."""


class History:
    """Samples of the last `KEPT_S` seconds and their arrivals, behind a lock; all times are in seconds."""

    def __init__(self) -> None:
        self._samples, self._arrivals = Table(5), Table(7)
        """Device time in s, restarts, raw; arrival, samples until then, newest device time, and `Counts`."""
        self._taken = 0
        """Samples that were dropped."""
        self._lock = threading.Lock()

    def add(self, samples: Samples, arrived_s: float, counts: Counts) -> None:
        """Append samples that arrived together at arrived_s. counts: of the source at that time."""
        device_s = 1e-6 * samples.time_us
        rows = np.column_stack((device_s, samples.restarts, samples.raw))
        with self._lock:
            self._samples.append(rows)
            until = self._taken + len(self._samples.rows)
            new = (arrived_s, until, device_s[-1], counts.packets, counts.lost, counts.spoiled_bytes, counts.restarts)
            self._arrivals.append(np.array([new], dtype=np.float64))
            self._forget(arrived_s - KEPT_S)

    def counted(self, since_s: float) -> Counts:
        """Counts from the last arrival before that time to the newest."""
        with self._lock:
            arrivals = self._arrivals.rows
            if not len(arrivals):
                return Counts()
            before = max(0, int(np.searchsorted(arrivals[:, 0], since_s)) - 1)
            counted = arrivals[-1, 3:] - arrivals[before, 3:]
        return Counts(*(int(count) for count in counted))

    def stretch(self, from_s: float, until_s: float) -> ArrivedSamples:
        """Arrivals from from_s up to until_s, with all of their samples."""
        with self._lock:
            arrivals = self._arrivals.rows
            first, end = np.searchsorted(arrivals[:, 0], (from_s, until_s))
            begin = int(arrivals[first - 1, 1]) - self._taken if first else 0
            stop = int(arrivals[end - 1, 1]) - self._taken if end else 0
            samples, arrivals = self._samples.rows[begin:stop].copy(), arrivals[first:end].copy()
        return ArrivedSamples(
            samples[:, 0], samples[:, 1], samples[:, 2:], arrivals[:, 2], arrivals[:, 6], arrivals[:, 0]
        )

    def _forget(self, before_s: float) -> None:
        """Now and then, a tenth at a time, but for the last arrival before: it says where the next one begins."""
        arrivals = self._arrivals.rows
        old = int(np.searchsorted(arrivals[:, 0], before_s)) - 1
        if old > 0.1 * len(arrivals):
            dropped = int(arrivals[old, 1]) - self._taken
            self._samples.drop(dropped)
            self._arrivals.drop(old)
            self._taken += dropped
