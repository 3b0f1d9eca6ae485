"""Buffer of the last minutes of samples, with their times of arrival and the counts of lost packets.

The reading thread of `sensor` adds, other threads read. After a recording, `sensor` selects the samples and arrivals of
an interval, to which the clock is fitted (`clock_fit`) and which are resampled to the ticks (`tick_resampling`).
"""

import threading
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.samples import PacketCounts, Samples

BUFFER_S = 300.0
"""Time (s) for which samples are kept after their arrival: enough for a recording of three minutes and the two minutes
before it to which the clock is fitted (`sensor.CLOCK_FIT_S`). Of a longer recording the acceleration of the beginning
is missing: at 10 kHz, five minutes are 120 MB already."""


class RowBuffer:
    """Growing array of rows, shape (n, columns): rows are appended at the end, in amortised constant time per row, and
    dropped at the beginning."""

    def __init__(self, columns: int) -> None:
        """columns: number of columns. The capacity begins with 1024 rows, chosen: half a second of samples at 2 kHz."""
        self._rows, self._start, self._end = np.zeros((1024, columns)), 0, 0

    @property
    def rows(self) -> FloatArray:
        """The present rows: a view, valid until the next change."""
        return self._rows[self._start : self._end]

    def append(self, rows: FloatArray) -> None:
        """Append rows (k, columns). Where the array is full, it is replaced by one of twice the needed length, at least
        1024 rows."""
        if self._end + len(rows) > len(self._rows):
            present_rows = self.rows
            enlarged_rows = np.zeros((max(1024, 2 * (len(present_rows) + len(rows))), self._rows.shape[1]))
            enlarged_rows[: len(present_rows)] = present_rows
            self._rows, self._start, self._end = enlarged_rows, 0, len(present_rows)
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def drop(self, row_count: int) -> None:
        """Drop this number of the oldest rows."""
        self._start += row_count


@dataclass(frozen=True, slots=True, eq=False)
class ArrivedSamples:
    """Samples that arrived within an interval (n samples), and their arrivals (m, each of one sample or more)."""

    device_s: FloatArray
    """(n,), time of each sample by the sensor's clock (s)."""
    restarts: FloatArray
    """(n,), number of restarts of the sensor before each sample, as in `Samples`."""
    raw: FloatArray
    """(n, 3), raw values of the three channels, as in `Samples`."""
    last_device_s: FloatArray
    """(m,), time of the newest sample of each arrival, by the sensor's clock (s)."""
    last_restarts: FloatArray
    """(m,), number of restarts of the sensor before that sample."""
    arrived_s: FloatArray
    """(m,), time of each arrival by the host's clock (s)."""


class SampleHistory:
    """Samples of at least the last `BUFFER_S` seconds, and their arrivals; all times in seconds. A lock lets one thread
    add while others read."""

    def __init__(self) -> None:
        self._samples, self._arrivals = RowBuffer(5), RowBuffer(7)
        """Columns of a sample: device time (s), restarts, three raw values. Columns of an arrival: host time (s),
        number of all samples up to it, newest device time (s), and the four numbers of `PacketCounts`."""
        self._dropped_count = 0
        """Number of samples that were dropped."""
        self._lock = threading.Lock()

    def add(self, samples: Samples, arrived_s: float, counts: PacketCounts) -> None:
        """Append samples (at least one) that arrived together at arrived_s (s). counts: of the source at that time."""
        device_s = 1e-6 * samples.time_us
        rows = np.column_stack((device_s, samples.restarts, samples.raw))
        with self._lock:
            self._samples.append(rows)
            sample_count = self._dropped_count + len(self._samples.rows)
            arrival = (
                arrived_s,
                sample_count,
                device_s[-1],
                counts.packets,
                counts.lost,
                counts.spoiled_bytes,
                counts.restarts,
            )
            self._arrivals.append(np.array([arrival], dtype=np.float64))
            self._drop_outdated(arrived_s - BUFFER_S)

    def count_since(self, since_s: float) -> PacketCounts:
        """Count packets since `since_s` (s): differences from the last arrival before that time, or else from the first
        arrival that is kept, to the newest arrival; zeros without arrivals."""
        with self._lock:
            arrivals = self._arrivals.rows
            if not len(arrivals):
                return PacketCounts()
            reference_row = max(0, int(np.searchsorted(arrivals[:, 0], since_s)) - 1)
            differences = arrivals[-1, 3:] - arrivals[reference_row, 3:]
        return PacketCounts(*(int(count) for count in differences))

    def select_interval(self, from_s: float, until_s: float) -> ArrivedSamples:
        """Select the arrivals with from_s <= time < until_s, by the host's clock (s), and their samples, except for
        samples that were dropped because of their age."""
        with self._lock:
            arrivals = self._arrivals.rows
            first_arrival, end_arrival = np.searchsorted(arrivals[:, 0], (from_s, until_s))
            first_sample = int(arrivals[first_arrival - 1, 1]) - self._dropped_count if first_arrival else 0
            end_sample = int(arrivals[end_arrival - 1, 1]) - self._dropped_count if end_arrival else 0
            samples, arrivals = (
                self._samples.rows[first_sample:end_sample].copy(),
                arrivals[first_arrival:end_arrival].copy(),
            )
        return ArrivedSamples(
            samples[:, 0], samples[:, 1], samples[:, 2:], arrivals[:, 2], arrivals[:, 6], arrivals[:, 0]
        )

    def _drop_outdated(self, before_s: float) -> None:
        """Drop arrivals before `before_s` (s) and their samples, once they exceed a tenth of all arrivals (chosen), so
        that most calls return at once. The last arrival before that time is kept, without its samples: it gives the
        index of the next arrival's first sample."""
        arrivals = self._arrivals.rows
        outdated_count = int(np.searchsorted(arrivals[:, 0], before_s)) - 1
        if outdated_count > 0.1 * len(arrivals):
            outdated_samples = int(arrivals[outdated_count, 1]) - self._dropped_count
            self._samples.drop(outdated_samples)
            self._arrivals.drop(outdated_count)
            self._dropped_count += outdated_samples
