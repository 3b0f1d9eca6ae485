"""The virtual spring and damper by which the device's control loop holds the handle at its place.

The input of a model is the total force f that enters the plant. Where the loop adds the force f_s of a spring to the
commands, that force along the planned motion is subtracted from them: u = f - f_s, with f_s = -(k x + b v).
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
        """(lines,), N per m/s²: force of the spring over acceleration of the handle, -(k + b s) / s² with s = 2 pi i f.
        frequency_hz: (lines,), above zero."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(-(self.stiffness_n_per_m + self.damping_n_s_per_m * s) / s**2)


NO_SPRING = VirtualSpring()
"""Zero stiffness and damping."""
