"""Motion of the handle for a given acceleration: velocity and position by integration in the frequency domain.

The spectrum is divided by 2 pi i f, and by its square, within a band that excludes zero frequency; the position is
therefore relative to the equilibrium.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.band_pass import compute_band_gain, find_padded_length


@dataclass(frozen=True, slots=True, eq=False)
class PlannedMotion:
    """Position, velocity and acceleration, (N, p) each: m, m/s, m/s², or rad, rad/s, rad/s²."""

    position: FloatArray
    """Position relative to the equilibrium, without components outside the band."""
    velocity: FloatArray
    acceleration: FloatArray


def integrate_motion(
    acceleration: FloatArray, sample_rate_hz: float, band_hz: tuple[float, float], lead_s: float = 0.0
) -> PlannedMotion:
    """Compute the motion of accelerations (N, p), m/s², that begin and end at zero, within a band (Hz) and its edges
    (`compute_band_gain`). lead_s: time (s) by which the motion is advanced. Raises ValueError for a band that begins at
    zero: a constant acceleration has no bounded motion."""
    if band_hz[0] <= 0:
        raise ValueError(f"the band begins at {band_hz[0]:g} Hz; a motion about a resting place needs more than 0 Hz")
    padded_length = find_padded_length(len(acceleration), sample_rate_hz)
    lines_hz = np.asarray(np.fft.rfftfreq(padded_length, 1 / sample_rate_hz), dtype=np.float64)
    s = 2j * np.pi * lines_hz
    gain = compute_band_gain(lines_hz, band_hz) * np.exp(s * lead_s)
    s[0] = 1.0  # any finite value: the band has no gain there
    spectrum = np.fft.rfft(acceleration, padded_length, axis=0) * gain[:, np.newaxis]

    def integrate(integration_count: int) -> FloatArray:
        """(N, p): the acceleration in the band, integrated this number of times."""
        motion: FloatArray = np.fft.irfft(spectrum / s[:, np.newaxis] ** integration_count, padded_length, axis=0)[
            : len(acceleration)
        ]
        return motion

    return PlannedMotion(integrate(2), integrate(1), integrate(0))
