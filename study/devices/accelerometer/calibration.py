"""Six-position calibration of an accelerometer under gravity: bias, sensitivity with cross-axis terms, and noise.

raw = sensitivity a + bias is solved by least squares for six known directions of gravity. An accelerometer measures
specific force: at rest it reads +g along the axis that points up. `six_positions` calls `calibrate`.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray

GRAVITY_MPS2 = 9.80665
"""Standard gravity (m/s^2)."""

POSITIONS = ("+x up", "-x up", "+y up", "-y up", "+z up", "-z up")
"""Names of the positions, by the axis that points up, in the order of the rows of `UP_DIRECTIONS`."""
UP_DIRECTIONS = np.kron(np.eye(3), np.array([[1.0], [-1.0]]))
"""(6, 3): unit vector along the axis that points up, in each position."""

MAX_RESIDUAL_G = 0.05
"""Largest accepted residual, in g; chosen. Six readings of three channels and twelve unknowns leave six degrees of
freedom. Tilts of the sensor by 1 to 2 degrees give residuals of 0.02 to 0.04 g, a mistaken position more than 0.5 g."""

MAX_CONDITION_NUMBER = 10.0
"""Largest accepted condition number of the sensitivity matrix; chosen. The channels of an ADXL335 differ by 10 %, which
gives about 1.1; a channel without a signal gives an arbitrarily large number."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Calibration of an accelerometer with three channels: converts raw values to acceleration."""

    bias: FloatArray
    """(3,), raw value at zero acceleration."""
    sensitivity: FloatArray
    """(3, 3), raw value per m/s²: row = channel, column = axis."""
    noise_mps2: FloatArray
    """(3,), standard deviation at rest, m/s²."""
    residual_g: float
    """Largest residual of a position (norm over the channels, divided by the largest singular value of the
    sensitivity), in g."""

    def to_acceleration(self, raw: FloatArray) -> FloatArray:
        """Convert raw values (n, 3) or (3,) to accelerations of the same shape, m/s², gravity included."""
        transposed = np.linalg.solve(self.sensitivity, (np.asarray(raw, dtype=np.float64) - self.bias).T)
        return np.asarray(transposed.T, dtype=np.float64)

    @property
    def cross_axis(self) -> float:
        """Largest cross-axis sensitivity of a channel, relative to its sensitivity to its own axis."""
        main_sensitivity = np.abs(np.diag(self.sensitivity))
        cross_terms = np.abs(self.sensitivity - np.diag(np.diag(self.sensitivity)))
        return float((cross_terms / main_sensitivity[:, None]).max())


def calibrate(position_samples: tuple[FloatArray, ...]) -> Calibration:
    """Fit bias and sensitivity matrix by least squares to six positions under gravity, and compute the noise.
    position_samples: raw samples (n, 3), n >= 2, at rest in each of `POSITIONS`.

    Raises ValueError for missing positions or samples, for a position whose residual exceeds `MAX_RESIDUAL_G` (the
    message names it), and for a channel that hardly responds to gravity.
    """
    if len(position_samples) != len(POSITIONS) or any(len(samples) < 2 for samples in position_samples):
        raise ValueError(f"{len(POSITIONS)} positions are needed, each with two samples or more")
    mean_readings = np.array([np.mean(samples, axis=0) for samples in position_samples])
    design_matrix = np.hstack((GRAVITY_MPS2 * UP_DIRECTIONS, np.ones((len(UP_DIRECTIONS), 1))))
    solution = np.linalg.lstsq(design_matrix, mean_readings, rcond=None)[0]
    sensitivity, bias = solution[:3].T, solution[3]
    largest_sensitivity = float(np.linalg.norm(sensitivity, 2))
    if not largest_sensitivity > 0:
        raise ValueError("no channel responds to gravity: check the wiring")
    residuals_g = np.linalg.norm(mean_readings - design_matrix @ solution, axis=1) / (
        largest_sensitivity * GRAVITY_MPS2
    )
    worst_position = int(np.argmax(residuals_g))
    if residuals_g[worst_position] > MAX_RESIDUAL_G:
        raise ValueError(
            f"'{POSITIONS[worst_position]}' is off by {residuals_g[worst_position]:.2f} g: lay the sensor down again"
        )
    if np.linalg.cond(sensitivity) > MAX_CONDITION_NUMBER:
        raise ValueError("a channel hardly responds to gravity: check its wiring")
    deviations = np.concatenate([samples - np.mean(samples, axis=0) for samples in position_samples])
    noise_mps2 = np.linalg.solve(sensitivity, deviations.T).T.std(axis=0)
    return Calibration(bias, sensitivity, noise_mps2, float(residuals_g.max()))
