"""Evidence for an effect's starting values: motion, commands, and the residuals of a re-tuned model."""

from dataclasses import dataclass

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Arrays of one recording, time first, all of length n, at all driven axes."""

    model: MechanicalModel
    """The re-tuned model, to which the residuals belong."""
    sample_rate_hz: float
    command: FloatArray
    """(n, m)"""
    axis_position: FloatArray
    """(n, m): as measured, smoothed by the model."""
    axis_velocity: FloatArray
    """(n, m)"""
    axis_force: FloatArray
    """(n, m): the additional force at each driven axis that would explain the residual, N."""
    response: FloatArray
    """(n, p): as measured."""
    predicted: FloatArray
    """(n, p)"""
    noise: FloatArray
    """(p,): rms of the noise, estimated from what does not repeat."""
    used: FloatArray
    """(n,): 1 where samples count, else 0."""
    position: FloatArray | None = None
    """(n, d): as measured; None where no position was recorded."""
    predicted_position: FloatArray | None = None
    """(n, p): of the response's rows; compared where d = p."""
    position_noise: FloatArray | None = None
    """(d,): rms"""
