"""Quantisation noise: differences between repeats show only a part of it, because equal motions are rounded alike.

For a motion over many steps of size 1, with noise of variance v before rounding, the rounding error has variance 1/12.
The part of it that repeats is a saw tooth blurred by the noise; with the power of its Fourier series,

    repeating = sum over k >= 1 of exp(-4 pi² k² v) / (2 pi² k²),        between repeats = v + 1/12 - repeating

(Widrow and Kollar, Quantization Noise, 2008). `undo_rounding` solves this for v, and so finds the total noise.
Tolerances are chosen by hand.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray

_FOURIER_TERMS = np.arange(1, 200)
"""Terms k of the Fourier series."""
_MAX_EXAMINED_SAMPLES, _BISECTIONS = 20_000, 40
"""Number of samples, from the first on, in which a step is searched for, to limit the computing time; number of
bisections, each of which halves the interval."""
_TOLERANCE = 1e-3
"""Deviation from multiples of a step that storage as float32 may add to a tenth of a step, relative to the step."""


@dataclass(frozen=True, slots=True)
class RoundedNoise:
    """Variances of one channel, in its unit squared."""

    total: float
    """Total noise, rounding included."""
    repeating: float
    """Part of the total that is the same in each repeat."""


def find_rounding_step(samples: FloatArray) -> float:
    """Find the step of which all values of a channel are multiples, apart from an offset. 0 where there is none, for
    fewer than three values, and where the distinct values number half of the samples or more. samples: (n,), in any
    unit; the step has the same unit. Deviations from multiples of up to a tenth of a step are tolerated."""
    finite_samples = samples[np.isfinite(samples)][:_MAX_EXAMINED_SAMPLES]
    distinct_values = np.unique(finite_samples)
    if len(distinct_values) < 3:
        return 0.0
    gaps = np.diff(distinct_values)
    # Values that should be equal differ by rounding in storage: far less than the usual gap.
    gaps = gaps[gaps > 1e-3 * np.median(gaps)]
    # Gaps of one step: up to 1.5 times the smallest one, as two steps are twice as large.
    step = float(np.median(gaps[gaps <= 1.5 * gaps.min()]))
    step_numbers = np.round((distinct_values - distinct_values[0]) / step)
    tolerance = max(_TOLERANCE * step, float(np.spacing(np.float32(np.abs(distinct_values).max()))))
    is_regular = bool(
        np.max(np.abs(distinct_values - distinct_values[0] - step * step_numbers)) < 0.1 * step + tolerance
    )
    # A fine-grained float also has a smallest gap, but a rounded channel returns to each of its values.
    return step if is_regular and len(distinct_values) < 0.5 * len(finite_samples) else 0.0


def undo_rounding(repeat_variance: float, step: float) -> RoundedNoise:
    """Compute the total noise, rounding included. repeat_variance: variance between repeats of a motion over many
    steps, in the step's unit squared. step: 0 = not rounded. Variances above step² are not corrected, because noise
    then blurs the saw tooth completely."""
    if step == 0:
        return RoundedNoise(repeat_variance, 0.0)
    scaled_variance = repeat_variance / step**2
    if scaled_variance > 1.0:
        return RoundedNoise(repeat_variance, 0.0)
    repeating = _compute_repeating_variance(_solve_variance_before_rounding(scaled_variance)) * step**2
    return RoundedNoise(repeat_variance + repeating, repeating)


def _solve_variance_before_rounding(repeat_variance: float) -> float:
    """Solve for v from the variance between repeats, both for steps of 1: bisection, as one grows with the other."""
    low, high = 0.0, 1.0 if repeat_variance > 0 else 0.0
    for _ in range(_BISECTIONS):
        midpoint = (low + high) / 2
        low, high = (
            (midpoint, high)
            if midpoint + 1 / 12 - _compute_repeating_variance(midpoint) < repeat_variance
            else (low, midpoint)
        )
    return high


def _compute_repeating_variance(variance: float) -> float:
    """Compute the variance of the repeating part for steps of 1 (module docstring). variance: v. Without noise, the sum
    of all further terms is added."""
    term_powers = np.exp(-4 * np.pi**2 * _FOURIER_TERMS**2 * variance) / _FOURIER_TERMS**2
    omitted_terms = 0.0 if variance > 0 else np.pi**2 / 6 - float(np.sum(1 / _FOURIER_TERMS**2))
    return float((np.sum(term_powers) + omitted_terms) / (2 * np.pi**2))
