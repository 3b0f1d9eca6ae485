"""Convergence test of iterative learning control, before anything is played.

On a linear device with response G, a correction of the forces u <- u + beta L e, with the learning operator L (the
inverse of a model) and the gain beta, leaves the error (I - beta G L) e. The largest singular value of this matrix at a
spectral line is the worst-case share of the error that remains. Where it is below 1 at every line, the 2-norm of the
error decreases monotonically.

Reference: Bristow, Tharayil and Alleyne, A Survey of Iterative Learning Control, IEEE Control Systems 26 (2006), 96.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Convergence:
    """Predicted convergence of iterative learning with the gain beta: worst-case share of the error that remains after
    one correction, at each line."""

    frequency_hz: FloatArray
    """(lines,): frequencies within the band."""
    remaining_share: FloatArray
    """(lines,): largest singular value of I - beta G L, the largest of all draws where several responses were given."""
    beta: float
    """Gain of the correction."""
    safe_beta: float
    """Upper bound of the gains with which every error decreases at every line, in any direction; 0 where no gain does,
    limited to 2."""

    @property
    def converges(self) -> bool:
        """Whether every error decreases at every line, in any direction."""
        return bool(self.remaining_share.max() < 1)

    @property
    def worst_hz(self) -> float:
        """Frequency (Hz) of the line at which the largest share of an error remains."""
        return float(self.frequency_hz[self.remaining_share.argmax()])


def predict_convergence(
    inverse: ComplexArray,
    response: ComplexArray,
    frequency_hz: FloatArray,
    band_hz: tuple[float, float],
    beta: float = 1.0,
) -> Convergence:
    """Predict the convergence of learning with the operator L = `inverse`, (lines, p, p), N per m/s², on a device with
    the response G = `response`, (lines, p, p) or (draws, lines, p, p), m/s² per N: a second measurement, or draws from
    the model's uncertainty. frequency_hz: (lines,); beta: gain of the correction. L may be singular: the error in one
    direction is then not corrected, and no gain converges. Raises ValueError for other shapes, and where no line is in
    the band.
    """
    response = np.asarray(response)[np.newaxis] if np.ndim(response) == 3 else np.asarray(response)
    if inverse.ndim != 3 or inverse.shape[1] != inverse.shape[2] or response.shape[1:] != inverse.shape:
        raise ValueError(
            f"inverse and response have shapes {inverse.shape} and {response.shape[1:]}; both must be (lines, p, p): "
            "as many forces as responses"
        )
    is_in_band = (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
    if not is_in_band.any():
        raise ValueError(f"no line lies in the band of {band_hz[0]:g} to {band_hz[1]:g} Hz")
    loop_response = np.asarray(response[:, is_in_band] @ inverse[is_in_band], dtype=np.complex128)
    remaining_shares = np.linalg.svd(np.eye(inverse.shape[1]) - beta * loop_response, compute_uv=False)[..., 0]
    return Convergence(frequency_hz[is_in_band], remaining_shares.max(axis=0), beta, _compute_safe_beta(loop_response))


def _compute_safe_beta(loop_response: ComplexArray) -> float:
    """Compute the upper bound, 0 to 2, of the gains with |I - beta T| < 1 (2-norm) for all T = G L of `loop_response`,
    (..., lines, p, p). As matrix inequalities the condition is T + T* > beta T* T, hence T⁻¹ + T⁻* > beta I: the
    smallest eigenvalue is the bound. 0 where a T is singular to rounding: in one direction the device then does not
    move, or the error is not corrected, so that no gain reduces every error."""
    if np.any(np.linalg.cond(loop_response) > 1 / np.finfo(float).eps):
        return 0.0
    inverse = np.linalg.inv(loop_response)
    smallest_eigenvalue = np.linalg.eigvalsh(inverse + inverse.conj().swapaxes(-1, -2))[..., 0].min()
    return float(np.clip(smallest_eigenvalue, 0.0, 2.0))
