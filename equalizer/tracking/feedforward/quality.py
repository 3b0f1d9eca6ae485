"""Quality of an equalized response: flatness, coupling between axes, and direction error.

T, (lines, p, p), is the response from reference to delivered accelerations; ideally it is the identity. A sinusoid
along axis i is delivered as the ellipse Re(T[:, i] exp(j omega t)), j² = -1, whose major axis is the first left
singular vector of the real p x 2 matrix (Re T[:, i], Im T[:, i]).
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray


@dataclass(frozen=True, slots=True)
class ResponseQuality:
    """Worst values over all spectral lines and axes; the ideal values are 0 dB, -infinity dB and 0 degrees."""

    flatness_db: float
    """Largest |20 log10 |T_ii||: deviation of the delivered level along the reference axis, up or down; infinity where
    T_ii is 0."""
    coupling_db: float
    """Largest 20 log10(|T_ji| / |T_ii|), j != i: response along another axis relative to that along the reference axis;
    -infinity without coupling, as with one axis; NaN where the column i of T is 0."""
    axis_error_deg: float
    """Largest angle between the reference axis and the major axis of the delivered ellipse."""


def measure_quality(delivered: ComplexArray) -> ResponseQuality:
    """Measure flatness, coupling and direction error of an equalized response. delivered: T, (lines, p, p), with at
    least one line; column i is the response to a command along axis i."""
    direct_gain = np.abs(np.einsum("lii->li", delivered))
    off_axis = np.abs(delivered * (1 - np.eye(delivered.shape[1])))
    with np.errstate(divide="ignore"):
        flatness_db = float(np.abs(20 * np.log10(direct_gain)).max())
        coupling_db = float(20 * np.log10((off_axis.max(axis=1) / direct_gain).max()))
    errors_deg = (_compute_axis_error_deg(delivered[:, :, axis], axis) for axis in range(delivered.shape[1]))
    return ResponseQuality(flatness_db, coupling_db, max(errors_deg))


def _compute_axis_error_deg(phasors: ComplexArray, axis: int) -> float:
    """Compute the largest angle (degrees) between `axis` and the major axis of the ellipse over the lines. phasors:
    (lines, p), T[:, axis] of each line."""
    ellipses = np.stack([phasors.real, phasors.imag], axis=-1)
    major_axes = np.linalg.svd(ellipses)[0][:, :, 0]
    return float(np.degrees(np.arccos(np.minimum(1.0, np.abs(major_axes[:, axis])))).max())
