"""Quantisation noise: differences between repeats show only a part of it, because equal motions are rounded alike.

With a movement over many steps, the rounding error has variance step² / 12 and does not depend on the noise before it.
Its part that repeats has the Fourier series of a saw tooth, blurred by the noise (Widrow and Kollar 2008).
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray

_TERMS = np.arange(1, 200)
_EXAMINED, _HALVES = 20_000, 40
_TOLERANCE = 1e-3
"""Largest deviation from multiples of a step, relative to the step: float32 storage leaves no exact multiples."""


@dataclass(frozen=True, slots=True)
class RoundedNoise:
    """Variances of one channel, in its unit squared."""

    total: float
    repeating: float
    """Part of the total that is the same in each repeat."""


def rounding_step(samples: FloatArray) -> float:
    """The step of which all values of a channel are multiples, up to an offset; 0 where there is none. samples: (n,)"""
    values = np.unique(samples[np.isfinite(samples)][:_EXAMINED])
    if len(values) < 3:
        return 0.0
    gaps = np.diff(values)
    # Values that should be equal differ by rounding in storage.
    gaps = gaps[gaps > 1e-3 * np.median(gaps)]
    step = float(np.median(gaps[gaps <= 1.5 * gaps.min()]))
    steps = np.round((values - values[0]) / step)
    within = max(_TOLERANCE * step, float(np.spacing(np.float32(np.abs(values).max()))))
    regular = bool(np.max(np.abs(values - values[0] - step * steps)) < 0.1 * step + within)
    # A fine-grained float also has a smallest gap, but a rounded channel returns to each of its values.
    return step if regular and len(values) < 0.5 * min(len(samples), _EXAMINED) else 0.0


def undo_rounding(between_repeats: float, step: float) -> RoundedNoise:
    """Total noise, rounding included, from the variance between repeats of a movement over many steps. step: 0 = not
    rounded."""
    if step == 0:
        return RoundedNoise(between_repeats, 0.0)
    seen = between_repeats / step**2
    if seen > 1.0:
        return RoundedNoise(between_repeats, 0.0)
    repeating = _compute_repeating_variance(_variance_before_rounding(seen)) * step**2
    return RoundedNoise(between_repeats + repeating, repeating)


def _variance_before_rounding(seen: float) -> float:
    """The noise's variance before rounding, by bisection: the variance between repeats grows with it. For steps of
    1."""
    low, high = 0.0, 1.0 if seen > 0 else 0.0
    for _ in range(_HALVES):
        middle = (low + high) / 2
        low, high = (middle, high) if middle + 1 / 12 - _compute_repeating_variance(middle) < seen else (low, middle)
    return high


def _compute_repeating_variance(variance: float) -> float:
    """Variance of the repeating part for steps of 1. variance: of the noise before rounding."""
    blurred = np.exp(-4 * np.pi**2 * _TERMS**2 * variance) / _TERMS**2
    left_out = 0.0 if variance > 0 else np.pi**2 / 6 - float(np.sum(1 / _TERMS**2))
    return float((np.sum(blurred) + left_out) / (2 * np.pi**2))
