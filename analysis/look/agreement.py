"""Gain and lag between two channels, from magnitudes and phase slope of their coherent lines."""

from dataclasses import dataclass

import numpy as np

from analysis.look.cross_spectra import CrossSpectra
from equalizer.signals.signal import FloatArray

COHERENT = 0.9
"""Coherence of a line from which its phase and magnitude count."""
LONGEST_LAG = 20.0
"""Samples, either way."""
_HIGHEST = 0.25
"""Share of the sample rate up to which channels are compared: above, differences and sensors distort the result."""
_NEARER = 0.01
"""Penalty of the longest lag, as a share of the score, so that the shorter of two equally good lags is chosen."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Gain and lag of a second signal relative to a first, and the evidence for them."""

    factor: float
    """Gain of the second signal relative to the first; negative where the sign is reversed."""
    spread: float
    """Standard deviation of the logarithm of single lines' factors."""
    lag_samples: float
    """Above 0 where the second is later."""
    share: float
    """Share of the second signal's power in the lines that were compared."""


def agreement(spectra: CrossSpectra, first: int, second: int, gain: FloatArray | None = None) -> Agreement | None:
    """Agreement of two channels; None where no line is coherent. gain: (lines,), known attenuation of the first
    channel, as by a difference."""
    power_first, power = spectra.power(first), spectra.power(second)
    nyquist_hz = float(spectra.frequency_hz[-1])
    usable = spectra.frequency_hz <= 2 * _HIGHEST * nyquist_hz
    good = usable & (spectra.coherence(first, second) > COHERENT) & (power_first > 0)
    if not good.any() or power[usable].sum() <= 0:
        return None
    weight = power[good] / power[good].sum()
    ratios = np.sqrt(power[good] / power_first[good]) * (1.0 if gain is None else gain[good])
    order = np.argsort(ratios)
    middle = float(ratios[order][np.searchsorted(np.cumsum(weight[order]), 0.5)])
    spread = float(np.sqrt(np.sum(weight * np.log(ratios / middle) ** 2)))
    across = spectra.matrix[good, first, second]
    turns = spectra.frequency_hz[good] / (2 * nyquist_hz)
    sign, lag = _sign_and_lag(across / np.abs(across), turns, weight)
    return Agreement(sign * middle, spread, lag, float(power[good].sum() / power[usable].sum()))


def _sign_and_lag(phases: np.ndarray, turns: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Sign and lag in samples of the weighted phases (lines,). turns: (lines,), cycles per sample of each line."""
    lags = np.arange(-LONGEST_LAG, LONGEST_LAG + 0.05, 0.1)
    together = np.exp(2j * np.pi * np.outer(lags, turns)) @ (weight * phases)
    score = np.abs(together.real) - _NEARER * np.abs(lags) / LONGEST_LAG
    best = int(np.argmax(score))
    sign = 1.0 if together.real[best] >= 0 else -1.0
    left = np.angle(sign * phases * np.exp(2j * np.pi * lags[best] * turns))
    by_slope = -float(np.sum(weight * turns * left) / (2 * np.pi * np.sum(weight * turns**2)))
    return sign, float(lags[best]) + by_slope
