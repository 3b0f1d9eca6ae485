"""Linear fit of the sensor's clock to the computer's, from the times of arrival of its samples.

A sample arrives after it was taken, never before. The line from device time to host time therefore lies below all
arrivals. Of all such lines the fit takes the one with the smallest mean distance to the arrivals, which is the edge of
their lower convex hull at the mean device time; no constant has to be chosen.
Source: S. B. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay measurements,
INFOCOM 1999.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class ClockFit:
    """Line from device time to host time: host_s = at_host_s + rate (device_s - at_device_s). The smallest delay of an
    arrival cannot be separated from the offset of the clocks: `at_host_s` includes it."""

    at_device_s: float
    """Device time of a point on the line (s)."""
    at_host_s: float
    """Host time of the same point (s)."""
    rate: float
    """Host seconds per second of the device's clock."""
    longest_delay_s: float
    """Largest delay (s) of an arrival above the fitted line, that is in excess of the smallest delay."""

    @property
    def drift_ppm(self) -> float:
        """Drift of the device's clock, in parts per million; > 0: it is slow."""
        return 1e6 * (self.rate - 1.0)

    def to_host_s(self, device_s: FloatArray) -> FloatArray:
        """Convert device times (s), of any shape, to host times (s) of the same shape."""
        return self.at_host_s + self.rate * (np.asarray(device_s) - self.at_device_s)


def fit_clock(device_s: FloatArray, arrived_s: FloatArray) -> ClockFit:
    """Fit the device's clock to the host's. device_s (n,), strictly rising: times of the samples by the device's clock
    (s); arrived_s (n,): their times of arrival by the host's clock (s).

    Raises ValueError for fewer than two samples, device times that do not rise or are NaN, or arrivals that are not
    finite.
    """
    device_times_s, arrival_times_s = np.asarray(device_s, dtype=float), np.asarray(arrived_s, dtype=float)
    if len(device_times_s) < 2 or not (np.diff(device_times_s) > 0).all() or not np.isfinite(arrival_times_s).all():
        raise ValueError("a clock needs two samples or more, with device times that rise")
    # Both intervals since the first sample are nearly equal; their difference is fitted, for numerical precision.
    excess_delay_s = (arrival_times_s - arrival_times_s[0]) - (device_times_s - device_times_s[0])
    hull_indices = _find_lower_hull(device_times_s - device_times_s[0], excess_delay_s)
    mean_device_s = float(np.mean(device_times_s - device_times_s[0]))
    edge_end_corner = int(
        np.searchsorted(device_times_s[hull_indices] - device_times_s[0], mean_device_s).clip(1, len(hull_indices) - 1)
    )
    start_index, end_index = hull_indices[edge_end_corner - 1], hull_indices[edge_end_corner]
    slope = float(
        (excess_delay_s[end_index] - excess_delay_s[start_index])
        / (device_times_s[end_index] - device_times_s[start_index])
    )
    at_host_s = float(
        arrival_times_s[0] + excess_delay_s[start_index] + (device_times_s[start_index] - device_times_s[0])
    )
    preliminary_fit = ClockFit(float(device_times_s[start_index]), at_host_s, 1.0 + slope, 0.0)
    return ClockFit(
        preliminary_fit.at_device_s,
        at_host_s,
        preliminary_fit.rate,
        float((arrival_times_s - preliminary_fit.to_host_s(device_times_s)).max()),
    )


def _find_lower_hull(x: FloatArray, y: FloatArray) -> list[int]:
    """Find the corners of the lower convex hull of points whose x rises (monotone chain): indices in rising order."""
    corner_indices: list[int] = []
    for index in range(len(x)):
        while len(corner_indices) > 1 and _is_above_chord(x, y, corner_indices[-2], corner_indices[-1], index):
            corner_indices.pop()
        corner_indices.append(index)
    return corner_indices


def _is_above_chord(x: FloatArray, y: FloatArray, first: int, middle: int, last: int) -> bool:
    """Whether the middle point lies on or above the chord from the first to the last, and so is no corner."""
    return bool((x[middle] - x[first]) * (y[last] - y[first]) <= (y[middle] - y[first]) * (x[last] - x[first]))
