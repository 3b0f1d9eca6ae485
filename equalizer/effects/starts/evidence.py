"""Data class of the signals from which the starting values of an effect are estimated: one recording and its residuals.

Made by the error measures of `analysis.diagnosis`, read by the effects (`Effect.starts`). Sizes: n samples, m driven
axes, p response channels, d position channels. SI units; on rotational axes N stands for N m and m for rad.
"""

from dataclasses import dataclass

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Signals of one recording, with their predictions; in a balance of forces, `response` is the force required."""

    model: MechanicalModel
    """Re-tuned model whose predictions are compared with the recording."""
    sample_rate_hz: float
    command: FloatArray
    """(n, m): commands, N."""
    axis_position: FloatArray
    """(n, m): estimated position along each driven axis, m; it includes the motion due to `axis_force`."""
    axis_velocity: FloatArray
    """(n, m): velocity along each driven axis, m/s, in the same way."""
    axis_force: FloatArray
    """(n, m): estimated missing force at each driven axis, N: it would explain the residual."""
    response: FloatArray
    """(n, p): measured response; where samples are missing, the predicted response."""
    predicted: FloatArray
    """(n, p): response that the model predicts."""
    noise: FloatArray
    """(p,): rms of the noise of the response."""
    used: FloatArray
    """(n,): 1 for samples that may be used for estimation, else 0."""
    position: FloatArray | None = None
    """(n, d): measured position, filled like `response`; None where no position is compared."""
    predicted_position: FloatArray | None = None
    """(n, d): position that the model predicts; None where no position is compared."""
    position_noise: FloatArray | None = None
    """(d,): rms of the noise of the position; None where no position is compared."""
