"""Rigid-body model of a device, force = M a + D v + K x, and its least-squares fit to a frequency response.

Below the first resonance the device moves as a rigid body. At a spectral line, with s = 2 pi i f,

    force per acceleration = M + D / s + K / s²        (m x m, N per m/s²)
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

MAX_CONDITION = 1e6
"""Largest condition number of a response that is inverted. Chosen: a larger one suggests an axis that is not driven."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidModel:
    """Mass, damping and stiffness matrices, (m, m) each. Raises ValueError for inconsistent shapes."""

    mass_kg: FloatArray
    damping_n_s_per_m: FloatArray
    stiffness_n_per_m: FloatArray
    delay_s: float = 0.0
    """Delay (s) from a command to its acceleration, without the half sample of the zero-order hold."""

    def __post_init__(self) -> None:
        shapes = {np.shape(matrix) for matrix in (self.mass_kg, self.damping_n_s_per_m, self.stiffness_n_per_m)}
        if len(shapes) != 1 or (shape := next(iter(shapes))) != shape[:1] * 2:
            raise ValueError(f"mass, damping and stiffness must be square matrices of one shape, not {sorted(shapes)}")

    def compute_force_per_acceleration(self, frequency_hz: FloatArray) -> ComplexArray:
        """Compute the inverse response (lines, m, m), N per m/s², with the delay compensated. frequency_hz: (lines,),
        above zero."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)[:, None, None]
        force_per_acceleration = self.mass_kg + self.damping_n_s_per_m / s + self.stiffness_n_per_m / s**2
        return np.asarray(force_per_acceleration * np.exp(s * self.delay_s))


def fit_rigid_model(
    frequency_hz: FloatArray, response: ComplexArray, sample_rate_hz: float, delay_s: float = 0.0
) -> RigidModel:
    """Fit a rigid-body model to a measured response, by linear least squares on the inverse response, each line
    weighted by the reciprocal of its norm.

    frequency_hz: (lines,), above zero, below the first resonance; response: (lines, m, m), m/s² per N, with the delay
    of the hold. delay_s is given, not fitted: at low frequencies it cannot be distinguished from damping and mass.
    Raises ValueError for fewer than two lines, a frequency that is not above zero, or a condition number of the
    response above `MAX_CONDITION`.
    """
    frequency_hz = np.asarray(frequency_hz, dtype=np.float64)
    if len(frequency_hz) < 2 or not (frequency_hz > 0).all():
        raise ValueError("a rigid model needs the response at two or more frequencies above zero")
    if np.linalg.cond(response).max() > MAX_CONDITION:
        raise ValueError(
            "the response at a line does not move all axes, so that it has no inverse; identify with all axes driven"
        )
    m, s = response.shape[1], 2j * np.pi * frequency_hz
    # A zero-order hold delays a command by half a sample on average.
    delay_factor = np.exp(-s * (delay_s + 0.5 / sample_rate_hz))[:, None, None]
    inverse = np.linalg.inv(response / delay_factor)
    weight = 1 / np.linalg.norm(inverse, axis=(1, 2))
    weighted_inverse = inverse.reshape(len(s), -1) * weight[:, None]
    regressors = np.stack([np.ones_like(s), 1 / s, 1 / s**2], axis=1) * weight[:, None]
    real_regressors, real_target = (
        np.vstack([regressors.real, regressors.imag]),
        np.vstack([weighted_inverse.real, weighted_inverse.imag]),
    )
    scale = np.linalg.norm(real_regressors, axis=0)
    matrices = np.linalg.lstsq(real_regressors / scale, real_target, rcond=None)[0] / scale[:, None]
    mass, damping, stiffness = matrices.reshape(3, m, m)
    return RigidModel(mass, damping, stiffness, delay_s)
