"""Force limit (cap): forces above it are refused, with the largest scale that is allowed; they are not clipped.

Clipping would distort the reference acceleration without notice. The cap (N) limits the Euclidean norm of the force
vector of each row, so that it holds in every direction. `project_to_cap` is the projection step of the iteration in
`constrained` (ADMM), whose result satisfies the cap. Forces are arrays (N, m) in newtons: N rows (samples), m axes.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray


class ForceLimitError(ValueError):
    """Forces exceed the cap. `peaks`: the largest force, where it occurs, and the cap."""

    def __init__(self, message: str, peaks: "ForcePeaks") -> None:
        super().__init__(message)
        self.peaks = peaks


@dataclass(frozen=True, slots=True)
class ForcePeaks:
    """Largest norm of the force vector over all rows, compared with the cap."""

    cap_n: float
    peak_n: float
    """Largest norm (N); 0 for no rows."""
    peak_row: int
    """First row with the largest norm."""
    share_above: float
    """Share of the rows above the cap, 0 to 1."""

    @property
    def is_under_cap(self) -> bool:
        """Whether no force exceeds the cap; a force equal to the cap is allowed."""
        return self.peak_n <= self.cap_n

    @property
    def largest_scale(self) -> float:
        """Largest factor on the reference acceleration at which no force exceeds the cap; infinite for forces of 0."""
        return self.cap_n / self.peak_n if self.peak_n > 0 else float("inf")


def find_force_peaks(forces: FloatArray, cap_n: float) -> ForcePeaks:
    """Find the largest norm of forces (N, m). Raises ValueError for a cap that is not a positive number and for forces
    that are not finite."""
    require_cap(cap_n)
    norms = np.linalg.norm(forces, axis=1)
    if not np.isfinite(norms).all():
        raise ValueError("forces hold values that are not finite numbers; check the model and the trajectory")
    if not len(norms):
        return ForcePeaks(cap_n, 0.0, 0, 0.0)
    return ForcePeaks(cap_n, float(norms.max()), int(norms.argmax()), float((norms > cap_n).mean()))


def require_under_cap(forces: FloatArray, cap_n: float, sample_rate_hz: float) -> ForcePeaks:
    """Check that no row of forces (N, m) has a norm above the cap, and return their peaks. Raises ForceLimitError if
    one has, ValueError as `find_force_peaks`."""
    peaks = find_force_peaks(forces, cap_n)
    if not peaks.is_under_cap:
        scale = round_scale_down(peaks.largest_scale)
        raise ForceLimitError(
            f"the forces reach {peaks.peak_n:.3g} N at {peaks.peak_row / sample_rate_hz:.3f} s, above the cap of "
            f"{peaks.cap_n:g} N ({peaks.share_above:.1%} of the time above it); nothing was clipped. The trajectory "
            f"fits when scaled by {scale:.4g} or less; or use the constrained solution, which states its loss",
            peaks,
        )
    return peaks


def round_scale_down(scale: float) -> float:
    """Round a factor above 0 down to four significant digits, so that it still fits when it is printed."""
    unit = 10.0 ** (np.floor(np.log10(scale)) - 3)
    return float(np.floor(scale / unit) * unit)


def require_cap(cap_n: float) -> float:
    """Return the cap (N) unchanged. Raises ValueError unless it is a positive, finite number."""
    if not (np.isfinite(cap_n) and cap_n > 0):
        raise ValueError(f"cap_n is {cap_n}; it must be a positive number")
    return cap_n


def project_to_cap(forces: FloatArray, cap_n: float) -> FloatArray:
    """Project forces (N, m) on the ball of radius `cap_n`: a row with a larger norm is scaled down to the cap."""
    norms = np.linalg.norm(forces, axis=1, keepdims=True)
    # Slightly below the cap, so that rounding leaves no row above it.
    scale_factors = cap_n * (1 - 8 * np.finfo(np.float64).eps) / np.maximum(norms, cap_n)
    return np.asarray(np.where(norms > cap_n, forces * scale_factors, forces))
