"""Gain and lag between two channels, from their averaged cross spectrum.

Two channels that show the same quantity differ by a gain g, negative where a sign is reversed, and by a lag of L
samples: Y(f) = g X(f) exp(-2j pi f L / f_s). Per spectral line, |g| is the square root of the ratio of the powers and L
follows from the slope of the cross spectrum's phase over frequency. Only coherent lines count, each weighted with its
share of the second channel's power. A wrong unit shows as a wrong gain, a reversed sign as a negative gain, and a
clock error or a filter as a lag.

Reference: Bendat and Piersol, Random Data (4th ed., 2010), chapters 5 and 6 (cross spectra, coherence, time delays).
"""

from dataclasses import dataclass

import numpy as np

from analysis.look.cross_spectra import CrossSpectra
from equalizer.signals.signal import ComplexArray, FloatArray

COHERENT = 0.9
"""Least magnitude-squared coherence of a line whose phase and magnitude count."""
LONGEST_LAG = 20.0
"""Longest lag that is searched for, in samples, of either sign."""
_HIGHEST_LINE = 0.25
"""Highest line that is compared, as a share of the sample rate: above, finite differences and the filters of sensors
change phase and gain."""
_LAG_PENALTY = 0.01
"""Penalty on the score (0 to 1) at the longest lag, in proportion to the lag: of two lags that fit equally well the
shorter is chosen."""
_LAG_STEP = 0.1
"""Step of the search over lags, in samples; a least-squares slope then refines the best."""


@dataclass(frozen=True, slots=True)
class GainAndLag:
    """Gain and lag of a second channel relative to a first, and the evidence for them."""

    gain: float
    """Unit of the second channel per unit of the first; negative where the sign is reversed."""
    gain_spread: float
    """Power-weighted standard deviation of the natural logarithm of the single lines' gains."""
    lag_samples: float
    """Above 0 where the second channel is later."""
    coherent_share: float
    """Share, 0 to 1, of the second channel's power, up to the highest line, that lies in coherent lines."""


def estimate_gain_and_lag(
    spectra: CrossSpectra, first: int, second: int, difference_gain: FloatArray | None = None
) -> GainAndLag | None:
    """Gain and lag of channel `second` relative to channel `first`, which are indices; None where no line is coherent.

    difference_gain: (lines,), gain that a finite difference gave the first channel; the result is corrected for it.
    """
    # With windows of an even length the last line is at half the sample rate.
    power_first, power_second = spectra.power(first), spectra.power(second)
    nyquist_hz = float(spectra.frequency_hz[-1])
    usable = spectra.frequency_hz <= 2 * _HIGHEST_LINE * nyquist_hz
    is_coherent = usable & (spectra.coherence(first, second) > COHERENT) & (power_first > 0)
    if not is_coherent.any() or power_second[usable].sum() <= 0:
        return None
    weight = power_second[is_coherent] / power_second[is_coherent].sum()
    gains = np.sqrt(power_second[is_coherent] / power_first[is_coherent])
    if difference_gain is not None:
        gains = gains * difference_gain[is_coherent]
    order = np.argsort(gains)
    median = float(gains[order][np.searchsorted(np.cumsum(weight[order]), 0.5)])
    spread = float(np.sqrt(np.sum(weight * np.log(gains / median) ** 2)))
    cross = spectra.matrix[is_coherent, first, second]
    cycles = spectra.frequency_hz[is_coherent] / (2 * nyquist_hz)
    sign, lag = _sign_and_lag(cross / np.abs(cross), cycles, weight)
    return GainAndLag(sign * median, spread, lag, float(power_second[is_coherent].sum() / power_second[usable].sum()))


def _sign_and_lag(phasors: ComplexArray, cycles: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Sign of the gain, and lag in samples.

    phasors: (lines,), cross spectrum over its magnitude. cycles: (lines,), frequency in cycles per sample. weight:
    (lines,), of sum 1. The lag L maximises |Re sum(weight phasor exp(2j pi cycles L))|, which is 1 for a pure lag.
    """
    lags = np.arange(-LONGEST_LAG, LONGEST_LAG + _LAG_STEP / 2, _LAG_STEP)
    aligned = np.exp(2j * np.pi * np.outer(lags, cycles)) @ (weight * phasors)
    score = np.abs(aligned.real) - _LAG_PENALTY * np.abs(lags) / LONGEST_LAG
    best = int(np.argmax(score))
    sign = 1.0 if aligned.real[best] >= 0 else -1.0
    remaining_phase = np.angle(sign * phasors * np.exp(2j * np.pi * lags[best] * cycles))
    # Weighted least squares of phase = -2 pi cycles dL, a line through the origin.
    correction = -float(np.sum(weight * cycles * remaining_phase) / (2 * np.pi * np.sum(weight * cycles**2)))
    return sign, float(lags[best]) + correction
