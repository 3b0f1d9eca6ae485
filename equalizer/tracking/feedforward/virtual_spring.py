"""The virtual spring and damper by which the device's control loop keeps the handle at its centre position.

The input of an identified model is the total force f on the plant. Where the control loop adds the force f_s of the
spring to the command u, the command is u = f - f_s with f_s = -(k x + b v), where x and v are the planned displacement
and velocity of the handle, k is the stiffness and b the damping. Used by the equalizers that subtract the spring's
force from the commands.
"""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True)
class VirtualSpring:
    """Stiffness k and damping b of the virtual spring, both zero without a spring. Raises ValueError for negative or
    non-finite values."""

    stiffness_n_per_m: float = 0.0
    damping_n_s_per_m: float = 0.0

    def __post_init__(self) -> None:
        for name in ("stiffness_n_per_m", "damping_n_s_per_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"{name} is {value}; it must be a number that is not negative")

    def compute_force_per_acceleration(self, frequency_hz: FloatArray) -> ComplexArray:
        """Compute the transfer function (lines,) from the handle's acceleration to the spring's force, N per m/s²:
        -(k + b s) / s² with s = 2 pi i f. frequency_hz: (lines,), above zero."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(-(self.stiffness_n_per_m + self.damping_n_s_per_m * s) / s**2)


NO_SPRING = VirtualSpring()
"""No virtual spring: zero stiffness and damping."""
