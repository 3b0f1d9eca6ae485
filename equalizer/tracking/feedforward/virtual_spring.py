"""The virtual spring that holds the handle at its place, and its share in the forces that are played.

A model's input is the total force that enters the plant. Where a spring adds to the commands, its force along the
planned motion is subtracted from them: u = f - s, with s = -(k x + b v).
"""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True)
class VirtualSpring:
    """Stiffness and damping of the virtual spring, both zero without a spring. Raises ValueError for negative or
    non-finite values."""

    stiffness_n_per_m: float = 0.0
    damping_n_s_per_m: float = 0.0

    def __post_init__(self) -> None:
        for name in ("stiffness_n_per_m", "damping_n_s_per_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"{name} is {value}; it must be a number that is not negative")

    def force_per_acceleration(self, frequency_hz: FloatArray) -> ComplexArray:
        """(lines,), N per m/s²: force of the spring on a handle that oscillates at these frequencies, all above
        zero."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(-(self.stiffness_n_per_m + self.damping_n_s_per_m * s) / s**2)


NO_SPRING = VirtualSpring()
