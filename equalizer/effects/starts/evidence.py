"""Evidence for the starting values of an effect: motion, commands, and residuals of a re-tuned model.

Sizes: n samples, m driven axes, p response channels, d position channels. SI units; on rotational axes N stands for N m
and m for rad.
"""

from dataclasses import dataclass

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Arrays of one recording; the first dimension is time (n samples)."""

    model: MechanicalModel
    """The model after re-tuning to the recording, to which the residuals belong."""
    sample_rate_hz: float
    command: FloatArray
    """(n, m): commands, N."""
    axis_position: FloatArray
    """(n, m): positions along the driven axes, m, as measured and smoothed by the model."""
    axis_velocity: FloatArray
    """(n, m): velocities along the driven axes, m/s."""
    axis_force: FloatArray
    """(n, m): the additional force at each driven axis that would explain the residual, N."""
    response: FloatArray
    """(n, p): response as measured."""
    predicted: FloatArray
    """(n, p): response that the model predicts."""
    noise: FloatArray
    """(p,): rms of the noise, estimated from the part of the response that does not repeat."""
    used: FloatArray
    """(n,): 1 for samples that count, else 0."""
    position: FloatArray | None = None
    """(n, d): position as measured; None where no position was recorded."""
    predicted_position: FloatArray | None = None
    """(n, p): predicted position of each response channel; compared with `position` where d = p."""
    position_noise: FloatArray | None = None
    """(d,): rms of the position noise."""
