"""Gain and lag between two channels, from their averaged cross spectrum.

Two channels that show the same quantity differ by a gain g, negative where a sign is reversed, and by a lag of L
samples: Y(f) = g X(f) exp(-2j pi f L / f_s). Each spectral line gives |g| as the square root of the ratio of the
powers; the result is the weighted median. L follows from the slope of the cross spectrum's phase over frequency. Only
coherent lines count, each weighted with its share of the second channel's power. A wrong unit shows as a wrong gain, a
reversed sign as a negative gain, and a clock error or a filter as a lag. All limits are chosen.

Reference: Bendat and Piersol, Random Data (4th ed., 2010), chapters 5 and 6 (cross spectra, coherence, time delays).
"""

from dataclasses import dataclass

import numpy as np

from analysis.look.cross_spectra import CrossSpectra
from equalizer.signals.signal import ComplexArray, FloatArray

LEAST_COHERENCE = 0.9
"""Magnitude-squared coherence above which a line counts as coherent."""
LONGEST_LAG_SAMPLES = 20.0
"""Longest lag that is searched for, in samples, of either sign."""
_HIGHEST_RELATIVE_FREQUENCY = 0.25
"""Highest frequency that is compared, relative to the sample rate: above, finite differences and the filters of sensors
change phase and gain."""
_LAG_PENALTY = 0.01
"""Penalty on the score (0 to 1) at the longest lag, in proportion to the lag: of two lags that fit equally well the
shorter is chosen."""
_LAG_STEP_SAMPLES = 0.1
"""Step of the search over lags, in samples; least squares then refines the best."""


@dataclass(frozen=True, slots=True)
class GainAndLag:
    """Gain and lag of a second channel relative to a first, and the evidence for them."""

    gain: float
    """Unit of the second channel per unit of the first; negative where the sign is reversed."""
    gain_spread: float
    """Power-weighted root mean square of ln(gain of a line / weighted median gain)."""
    lag_samples: float
    """Above 0 where the second channel is later."""
    coherent_share: float
    """Share, 0 to 1, of the second channel's power, up to the highest compared frequency, that lies in coherent
    lines."""


def estimate_gain_and_lag(
    spectra: CrossSpectra, first: int, second: int, difference_gain: FloatArray | None = None
) -> GainAndLag | None:
    """Estimate gain and lag of channel `second` relative to channel `first`, which are indices; None where no line is
    coherent, or the second channel has no power.

    difference_gain: (lines,), gain of the finite difference that made the first channel, relative to the exact
    derivative; the result is corrected for it.
    """
    # With windows of an even length the last line is at half the sample rate.
    power_first, power_second = spectra.get_power_density(first), spectra.get_power_density(second)
    nyquist_hz = float(spectra.frequency_hz[-1])
    is_below_limit = spectra.frequency_hz <= 2 * _HIGHEST_RELATIVE_FREQUENCY * nyquist_hz
    is_coherent = is_below_limit & (spectra.compute_coherence(first, second) > LEAST_COHERENCE) & (power_first > 0)
    if not is_coherent.any() or power_second[is_below_limit].sum() <= 0:
        return None
    weight = power_second[is_coherent] / power_second[is_coherent].sum()
    gains = np.sqrt(power_second[is_coherent] / power_first[is_coherent])
    if difference_gain is not None:
        gains = gains * difference_gain[is_coherent]
    ascending = np.argsort(gains)
    median_gain = float(gains[ascending][np.searchsorted(np.cumsum(weight[ascending]), 0.5)])
    log_gain_sd = float(np.sqrt(np.sum(weight * np.log(gains / median_gain) ** 2)))
    cross = spectra.matrix[is_coherent, first, second]
    cycles_per_sample = spectra.frequency_hz[is_coherent] / (2 * nyquist_hz)
    sign, lag_samples = _estimate_sign_and_lag(cross / np.abs(cross), cycles_per_sample, weight)
    return GainAndLag(
        sign * median_gain,
        log_gain_sd,
        lag_samples,
        float(power_second[is_coherent].sum() / power_second[is_below_limit].sum()),
    )


def _estimate_sign_and_lag(
    phasors: ComplexArray, cycles_per_sample: FloatArray, weight: FloatArray
) -> tuple[float, float]:
    """Estimate the sign of the gain, and the lag in samples.

    phasors: (lines,), cross spectrum over its magnitude. cycles_per_sample: (lines,), frequency. weight: (lines,), of
    sum 1. The lag L maximises |Re sum(weight phasor exp(2j pi cycles_per_sample L))|, which is 1 for a pure lag, minus
    the penalty `_LAG_PENALTY`; a line fitted to the remaining phase refines it.
    """
    lags_samples = np.arange(-LONGEST_LAG_SAMPLES, LONGEST_LAG_SAMPLES + _LAG_STEP_SAMPLES / 2, _LAG_STEP_SAMPLES)
    aligned = np.exp(2j * np.pi * np.outer(lags_samples, cycles_per_sample)) @ (weight * phasors)
    score = np.abs(aligned.real) - _LAG_PENALTY * np.abs(lags_samples) / LONGEST_LAG_SAMPLES
    best_index = int(np.argmax(score))
    sign = 1.0 if aligned.real[best_index] >= 0 else -1.0
    remaining_phase = np.angle(sign * phasors * np.exp(2j * np.pi * lags_samples[best_index] * cycles_per_sample))
    # Weighted least squares of phase = -2 pi cycles_per_sample correction, a line through the origin.
    lag_correction = -float(
        np.sum(weight * cycles_per_sample * remaining_phase) / (2 * np.pi * np.sum(weight * cycles_per_sample**2))
    )
    return sign, float(lags_samples[best_index]) + lag_correction
