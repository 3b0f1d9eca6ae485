"""Convergence test of iterative learning control, before anything is played.

Forces that are corrected by u <- u + beta Gm⁻¹ e leave the error (I - beta G Gm⁻¹) e on a linear device: its largest
singular value at a line is the worst-case share of the error that remains. Below 1 at every line, the error falls
monotonically in the 2-norm; G is measured, Gm the model whose inverse is played.

Reference: Bristow, Tharayil and Alleyne, A Survey of Iterative Learning Control, IEEE Control Systems 26 (2006), 96.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Convergence:
    """Prediction for iterative learning with gain beta: worst-case share of an error that remains after a
    correction."""

    frequency_hz: FloatArray
    """(lines,): frequencies within the band."""
    surviving: FloatArray
    """(lines,): largest singular value of I - beta G Gm⁻¹; of the worst response where several were given."""
    beta: float
    safe_beta: float
    """Largest gain with which every error decreases at every line, in any direction; 0 where there is none. At most
    2."""

    @property
    def converges(self) -> bool:
        """Whether every error decreases at every line, in any direction."""
        return bool(self.surviving.max() < 1)

    @property
    def worst_hz(self) -> float:
        """Frequency (Hz) of the line at which the largest share of an error remains."""
        return float(self.frequency_hz[self.surviving.argmax()])


def convergence(
    model: ComplexArray,
    device: ComplexArray,
    frequency_hz: FloatArray,
    band_hz: tuple[float, float],
    beta: float = 1.0,
) -> Convergence:
    """Convergence of learning with the inverse of model (lines, p, p) on device (lines, p, p) or (draws, lines, p, p):
    a second measurement, or draws from the model's uncertainty. Raises ValueError on other shapes, and where no line
    lies in the band.
    """
    device = np.asarray(device)[np.newaxis] if np.ndim(device) == 3 else np.asarray(device)
    if model.ndim != 3 or model.shape[1] != model.shape[2] or device.shape[1:] != model.shape:
        raise ValueError(
            f"responses have shapes {model.shape} and {device.shape[1:]}; both must be (lines, p, p): as many forces "
            "as responses"
        )
    inside = (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
    if not inside.any():
        raise ValueError(f"no line lies in the band of {band_hz[0]:g} to {band_hz[1]:g} Hz")
    played = np.asarray(device[:, inside] @ np.linalg.inv(model[inside]), dtype=np.complex128)
    survivors = np.linalg.svd(np.eye(model.shape[1]) - beta * played, compute_uv=False)[..., 0]
    return Convergence(frequency_hz[inside], survivors.max(axis=0), beta, _safe_beta(played))


def _safe_beta(played: ComplexArray) -> float:
    """Largest gain with which |I - beta T| < 1 for all T of played (..., lines, p, p). As matrix inequalities the
    condition reads T + T* > beta T* T, which is T⁻¹ + T⁻* > beta I."""
    inverse = np.linalg.inv(played)
    lowest = np.linalg.eigvalsh(inverse + inverse.conj().swapaxes(-1, -2))[..., 0].min()
    return float(np.clip(lowest, 0.0, 2.0))
