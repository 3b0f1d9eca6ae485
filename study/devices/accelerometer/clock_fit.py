"""Fit of the microcontroller's clock to the host's: a sample arrives some time after it was taken, never before.

So the line from device time to host time lies below all arrivals, and of all such lines that one is taken which lies
closest to them on average: an edge of the lower convex hull, no constant needed.
Source: S. B. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay measurements,
INFOCOM 1999.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class ClockFit:
    """host_s = at_host_s + rate (device_s - at_device_s). The least delay of an arrival cannot be seen: it is in it."""

    at_device_s: float
    at_host_s: float
    rate: float
    """Host seconds in a second of the device."""
    longest_delay_s: float
    """Largest delay of an arrival beyond the smallest one."""

    @property
    def drift_ppm(self) -> float:
        """> 0: the device's clock is slow."""
        return 1e6 * (self.rate - 1.0)

    def host_s(self, device_s: FloatArray) -> FloatArray:
        """Host times (s) of device times (s), any shape."""
        return self.at_host_s + self.rate * (np.asarray(device_s) - self.at_device_s)


def fit_clock(device_s: FloatArray, arrived_s: FloatArray) -> ClockFit:
    """Fit the device's clock to the host's: a line through the earliest arrivals. device_s (n,), rising: when samples
    were taken, by the device; arrived_s (n,): when they came, by the host.

    Raises ValueError for fewer than two samples, or device times that do not rise.
    """
    device, arrived = np.asarray(device_s, dtype=float), np.asarray(arrived_s, dtype=float)
    if len(device) < 2 or not (np.diff(device) > 0).all() or not np.isfinite(arrived).all():
        raise ValueError("a clock needs two samples or more, with device times that rise")
    # Later than the first by nearly the same on both clocks: the difference keeps its digits.
    behind = (arrived - arrived[0]) - (device - device[0])
    hull = _lower_hull(device - device[0], behind)
    middle = float(np.mean(device - device[0]))
    right = int(np.searchsorted(device[hull] - device[0], middle).clip(1, len(hull) - 1))
    first, second = hull[right - 1], hull[right]
    slope = float((behind[second] - behind[first]) / (device[second] - device[first]))
    at_host_s = float(arrived[0] + behind[first] + (device[first] - device[0]))
    fit = ClockFit(float(device[first]), at_host_s, 1.0 + slope, 0.0)
    return ClockFit(fit.at_device_s, at_host_s, fit.rate, float((arrived - fit.host_s(device)).max()))


def _lower_hull(x: FloatArray, y: FloatArray) -> list[int]:
    """Indices of its corners, from left to right; x rises."""
    hull: list[int] = []
    for k in range(len(x)):
        while len(hull) > 1 and _not_left(x, y, hull[-2], hull[-1], k):
            hull.pop()
        hull.append(k)
    return hull


def _not_left(x: FloatArray, y: FloatArray, a: int, b: int, c: int) -> bool:
    return bool((x[b] - x[a]) * (y[c] - y[a]) <= (y[b] - y[a]) * (x[c] - x[a]))
