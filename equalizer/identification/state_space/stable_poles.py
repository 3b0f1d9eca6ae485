"""Stabilisation of poles: inside the unit circle, and with a decay within a given time.

A pole at 0.99999 does not change a fit over 5 to 35 Hz, but makes simulations drift.
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

Radius = float | FloatArray
"""Largest radius of all pairs of poles, or one per pair."""


def largest_radius(longest_decay_s: float, sample_rate_hz: float) -> float:
    """Radius of a pole that decays to 1/e in that time."""
    return float(np.exp(-1 / (longest_decay_s * sample_rate_hz)))


def stabilise_poles(poles: ComplexArray | FloatArray, radius: Radius) -> ComplexArray:
    """Unstable poles are reflected at the unit circle, then all are moved inside the radius; frequencies stay. poles:
    any shape."""
    size = np.abs(poles)
    wanted = np.minimum(np.where(size > 1, 1 / np.maximum(size, 1e-300), size), radius)
    return np.asarray(poles * wanted / np.maximum(size, 1e-300), dtype=np.complex128)


def stabilise_blocks(a: FloatArray, b: FloatArray, radius: Radius) -> tuple[FloatArray, FloatArray]:
    """`stabilise_poles` for pole pairs a ± sqrt(b), both of shape (pairs,)."""
    root = np.sqrt(b.astype(np.complex128))
    first, second = stabilise_poles(a + root, radius), stabilise_poles(a - root, radius)
    return ((first + second) / 2).real, (((first - second) / 2) ** 2).real
