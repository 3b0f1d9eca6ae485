"""Stabilisation of discrete-time poles: inside the unit circle, and with a time constant up to a given bound.

The free response of a pole p decays as |p|^k; a time constant T corresponds to |p| = exp(-1 / (T sample rate)). The
bound is needed because a superfluous pole at 0.99999 does not change a fit over 5 to 35 Hz, but makes simulations
drift. Used by the fit of state-space models.
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

Radius = float | FloatArray
"""Largest magnitude of the poles: common to all pairs, or (pairs,)."""


def compute_pole_radius(longest_decay_s: float, sample_rate_hz: float) -> float:
    """Compute the magnitude of a discrete-time pole whose free response decays to 1/e in longest_decay_s seconds."""
    return float(np.exp(-1 / (longest_decay_s * sample_rate_hz)))


def stabilise_poles(poles: ComplexArray | FloatArray, radius: Radius) -> ComplexArray:
    """Stabilise poles of any shape: unstable poles are reflected at the unit circle (p becomes 1 / conj(p)), then all
    magnitudes are limited to the radius. Angles, and thus frequencies, are unchanged."""
    # 1e-300 avoids a division by zero for a pole at the origin, which stays there.
    magnitude = np.abs(poles)
    stable_magnitude = np.minimum(np.where(magnitude > 1, 1 / np.maximum(magnitude, 1e-300), magnitude), radius)
    return np.asarray(poles * stable_magnitude / np.maximum(magnitude, 1e-300), dtype=np.complex128)


def stabilise_blocks(a: FloatArray, b: FloatArray, radius: Radius) -> tuple[FloatArray, FloatArray]:
    """Apply `stabilise_poles` to the pole pairs a ± sqrt(b) of the modal form, complex where b < 0. a, b: (pairs,).
    Returns the stabilised a and b, (pairs,) each."""
    half_difference = np.sqrt(b.astype(np.complex128))
    first, second = stabilise_poles(a + half_difference, radius), stabilise_poles(a - half_difference, radius)
    return ((first + second) / 2).real, (((first - second) / 2) ** 2).real
