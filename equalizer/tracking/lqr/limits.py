"""Force limits: forces above a cap are refused, with the scale that would fit, and never clipped.

Clipping would distort the wanted acceleration without notice. The cap (N) limits the Euclidean norm of the force vector
of each row, so that it holds in every direction. `project_to_cap` is a step of the constrained solver (`constrained`).
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray


class ForceLimitError(ValueError):
    """Forces exceed the cap. `peaks`: by how much, and where."""

    def __init__(self, message: str, peaks: "Peaks") -> None:
        super().__init__(message)
        self.peaks = peaks


@dataclass(frozen=True, slots=True)
class Peaks:
    """Largest norm of the force vector over all rows, and the cap. Forces in N."""

    cap_n: float
    peak_n: float
    at_sample: int
    """First row with the largest norm."""
    share_over: float
    """Share of the rows above the cap, 0 to 1."""

    @property
    def fits(self) -> bool:
        """Whether no force exceeds the cap; a force equal to it fits."""
        return self.peak_n <= self.cap_n

    @property
    def largest_scale(self) -> float:
        """Largest factor on the wanted acceleration with which the forces fit; infinite without forces."""
        return self.cap_n / self.peak_n if self.peak_n > 0 else float("inf")


def force_peaks(forces: FloatArray, cap_n: float) -> Peaks:
    """Peaks of forces (N, m), in N. Raises ValueError for a cap that is not a positive number and for forces that are
    not finite."""
    require_cap(cap_n)
    lengths = np.linalg.norm(forces, axis=1)
    if not np.isfinite(lengths).all():
        raise ValueError("forces hold values that are not finite numbers; check the model and the trajectory")
    if not len(lengths):
        return Peaks(cap_n, 0.0, 0, 0.0)
    return Peaks(cap_n, float(lengths.max()), int(lengths.argmax()), float((lengths > cap_n).mean()))


def require_under_cap(forces: FloatArray, cap_n: float, sample_rate_hz: float) -> Peaks:
    """Check that forces (N, m), in N, are under the cap, and return their peaks. Raises ForceLimitError where the norm
    of a row exceeds the cap, and what `force_peaks` raises."""
    peaks = force_peaks(forces, cap_n)
    if not peaks.fits:
        # Rounded down, so that the printed factor still fits.
        scale = np.floor(peaks.largest_scale * 1e4) / 1e4
        raise ForceLimitError(
            f"the forces reach {peaks.peak_n:.3g} N at {peaks.at_sample / sample_rate_hz:.3f} s, above the cap of "
            f"{peaks.cap_n:g} N ({peaks.share_over:.1%} of the time above it); nothing was clipped. The trajectory "
            f"fits when scaled by {scale:.4g} or less; or use the constrained solution, which states its loss",
            peaks,
        )
    return peaks


def require_cap(cap_n: float) -> float:
    """The cap itself. Raises ValueError unless it is a positive, finite number."""
    if not (np.isfinite(cap_n) and cap_n > 0):
        raise ValueError(f"cap_n is {cap_n}; it must be a positive number")
    return cap_n


def project_to_cap(forces: FloatArray, cap_n: float) -> FloatArray:
    """Euclidean projection of forces (N, m) on the cap: each row with a larger norm is scaled down to the cap."""
    lengths = np.linalg.norm(forces, axis=1, keepdims=True)
    # Slightly below the cap, so that rounding leaves no row above it.
    shorter = cap_n * (1 - 8 * np.finfo(np.float64).eps) / np.maximum(lengths, cap_n)
    return np.asarray(np.where(lengths > cap_n, forces * shorter, forces))
