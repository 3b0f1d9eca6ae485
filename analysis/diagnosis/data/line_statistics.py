"""Tests of line power against noise: the power beyond the noise, and its p-value."""

import numpy as np
import numpy.typing as npt
from scipy.special import fdtrc

from equalizer.signals.signal import FloatArray

_TINY = np.finfo(np.float64).tiny
_LARGEST = 1e300
"""Upper limit of an F ratio: SciPy returns NaN for infinity."""


def noncentral_f_sf(
    ratio: npt.ArrayLike, lines: npt.ArrayLike, freedom: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> FloatArray:
    """P(F >= ratio) with 2 `lines` and `freedom` degrees of freedom, by Patnaik's central F of equal moments (1949).

    Exact for noncentrality 0. Chosen over the series because it holds for noncentralities of millions, too.
    """
    degrees = 2 * np.asarray(lines, dtype=np.float64)
    shift = np.asarray(noncentrality, dtype=np.float64)
    equal = (degrees + shift) * ((degrees + shift) / (degrees + 2 * shift))
    scaled = np.asarray(ratio, dtype=np.float64) * degrees / (degrees + shift)
    return np.asarray(fdtrc(equal, freedom, np.minimum(scaled, _LARGEST)), dtype=np.float64)


def excess(power: FloatArray, noise: FloatArray, freedom: float) -> tuple[float, float, float]:
    """Summed power beyond noise, its detection limit (two standard errors of the noise), and the p-value.

    power: (lines,) squared magnitudes. noise: (lines,) their expectation without a signal, known with `freedom`.
    """
    if len(power) == 0 or not np.isfinite(noise).all():
        return 0.0, 0.0, 1.0
    ratio = float(np.mean(power / np.maximum(noise, _TINY)))
    p_value = float(fdtrc(2 * len(power), max(freedom, 1.0), min(ratio, _LARGEST)))
    limit = 2 * float(np.sqrt(np.sum(noise**2) + 2 * np.sum(noise) ** 2 / max(freedom, 1.0)))
    return float(np.sum(power - noise)), limit, p_value
