"""Low band of a tracked acceleration: plan a slow motion, then compute its forces by inverse dynamics.

Integrating the reference acceleration twice would let the handle drift out of its workspace. A high-pass filter of
corner w (rad/s) limits the travel. The filtered position x, velocity and acceleration are consistent, and give the
force

    F = M x'' + D x' + K x        of a rigid model (`rigid_model`)

The filter is s² / (s² - w²), without phase error, where the whole acceleration is known beforehand; otherwise it is the
causal s² / (s + w)².
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from equalizer.signals.signal import FloatArray
from equalizer.tracking.bands.rigid_model import RigidModel

CORNER_HZ = 0.5
"""Default corner of the high-pass filter: lower frequencies would move the handle out of its workspace. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class SlowMotion:
    """Position, velocity and acceleration, (N, m) each. They are consistent: the velocity is the derivative of the
    position, the acceleration that of the velocity."""

    position_m: FloatArray
    velocity_mps: FloatArray
    acceleration_mps2: FloatArray
    """The reference acceleration after the high-pass filter."""

    @property
    def travel_m(self) -> float:
        """Largest distance from the origin, in m."""
        return float(np.linalg.norm(self.position_m, axis=1).max(initial=0.0))


def plan_motion(reference: FloatArray, sample_rate_hz: float, corner_hz: float = CORNER_HZ) -> SlowMotion:
    """Plan the slow motion of the low band by a zero-phase filter. reference: (N, m), m/s², known beforehand and zero
    at both ends. Raises ValueError for a corner that is not between zero and half the sample rate.

    x = a / (s² - w²), a convolution with a two-sided exponential kernel. The filter from the reference to the planned
    acceleration, f² / (f² + corner²), is real.
    """
    a, corner_rad_s = np.asarray(reference, dtype=np.float64), _convert_corner_to_rad_per_s(corner_hz, sample_rate_hz)
    # Zeros over eight time constants, after which exp(-8) of the kernel remains: hardly any of it wraps around.
    padding_rows = int(np.ceil(8 * sample_rate_hz / corner_rad_s))
    padded_acceleration = np.pad(a, ((padding_rows, padding_rows), (0, 0)))
    s = 2j * np.pi * np.fft.rfftfreq(len(padded_acceleration), 1 / sample_rate_hz)[:, None]
    position_spectrum = np.fft.rfft(padded_acceleration, axis=0) / (s**2 - corner_rad_s**2)
    position_and_velocity = [
        np.fft.irfft(spectrum, len(padded_acceleration), axis=0)[padding_rows:][: len(a)]
        for spectrum in (position_spectrum, s * position_spectrum)
    ]
    return SlowMotion(
        position_and_velocity[0], position_and_velocity[1], a + corner_rad_s**2 * position_and_velocity[0]
    )


def plan_motion_causally(reference: FloatArray, sample_rate_hz: float, corner_hz: float = CORNER_HZ) -> SlowMotion:
    """Plan the slow motion of the low band by a causal filter. reference: (N, m), m/s², from rest at the first row, as
    after a contact. x = a / (s + w)²: the planned acceleration leads the reference by 2 atan(corner / f). Raises
    ValueError for a corner that is not between zero and half the sample rate."""
    a, corner_rad_s = np.asarray(reference, dtype=np.float64), _convert_corner_to_rad_per_s(corner_hz, sample_rate_hz)
    # 1 / (s + w) by the bilinear transform, s = c (1 - z^-1) / (1 + z^-1).
    c = 2 * sample_rate_hz
    low_pass = np.array([1.0, 1.0]) / (c + corner_rad_s), np.array([1.0, (corner_rad_s - c) / (c + corner_rad_s)])
    once_filtered = lfilter(*low_pass, a, axis=0)
    position = lfilter(*low_pass, once_filtered, axis=0)
    # s / (s + w) = 1 - w / (s + w), applied once for the velocity and twice for the acceleration: all three signals are
    # derivatives of each other by the bilinear transform, to rounding.
    velocity = once_filtered - corner_rad_s * position
    return SlowMotion(position, velocity, a - 2 * corner_rad_s * once_filtered + corner_rad_s**2 * position)


def compute_low_band_forces(motion: SlowMotion, rigid: RigidModel, sample_rate_hz: float) -> FloatArray:
    """Compute forces (N, m) in N by inverse dynamics along the motion, advanced by the rigid model's delay and the half
    sample of the hold, to first order (Taylor), which is enough for a slow band."""
    lead_s = rigid.delay_s + 0.5 / sample_rate_hz
    x, v, a = motion.position_m, motion.velocity_mps, motion.acceleration_mps2
    lead_position, lead_velocity = x + lead_s * v, v + lead_s * a
    lead_acceleration = a + lead_s * np.gradient(a, 1 / sample_rate_hz, axis=0) if len(a) > 1 else a
    force: FloatArray = (
        lead_acceleration @ rigid.mass_kg.T
        + lead_velocity @ rigid.damping_n_s_per_m.T
        + lead_position @ rigid.stiffness_n_per_m.T
    )
    return force


def _convert_corner_to_rad_per_s(corner_hz: float, sample_rate_hz: float) -> float:
    """Convert the corner from Hz to rad/s. Raises ValueError where it is not between zero and half the sample rate."""
    if not 0 < corner_hz < sample_rate_hz / 2:
        raise ValueError(f"corner_hz is {corner_hz}; it must be above zero and below half the sample rate")
    return 2 * np.pi * corner_hz
