"""Stabilisation of discrete poles: inside the unit circle, and with a time constant up to a given bound.

A pole p decays as |p|^k; a time constant T corresponds to the radius |p| = exp(-1 / (T rate)). A superfluous pole at
0.99999 does not change a fit over 5 to 35 Hz, but makes simulations drift.
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

Radius = float | FloatArray
"""Largest magnitude of the poles: common to all pairs, or (pairs,)."""


def largest_radius(longest_decay_s: float, sample_rate_hz: float) -> float:
    """Magnitude of a discrete pole whose free response decays to 1/e in longest_decay_s seconds."""
    return float(np.exp(-1 / (longest_decay_s * sample_rate_hz)))


def stabilise_poles(poles: ComplexArray | FloatArray, radius: Radius) -> ComplexArray:
    """Poles of any shape, stabilised: unstable poles are reflected at the unit circle, then all magnitudes are limited
    to the radius. Angles, which are the frequencies, are unchanged."""
    size = np.abs(poles)
    limited = np.minimum(np.where(size > 1, 1 / np.maximum(size, 1e-300), size), radius)
    return np.asarray(poles * limited / np.maximum(size, 1e-300), dtype=np.complex128)


def stabilise_blocks(a: FloatArray, b: FloatArray, radius: Radius) -> tuple[FloatArray, FloatArray]:
    """Apply `stabilise_poles` to the pairs a ± sqrt(b) of the modal form; returns a and b, (pairs,) each."""
    root = np.sqrt(b.astype(np.complex128))
    first, second = stabilise_poles(a + root, radius), stabilise_poles(a - root, radius)
    return ((first + second) / 2).real, (((first - second) / 2) ** 2).real
