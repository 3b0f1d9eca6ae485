"""Data class of the signals from which the starting values of an effect are estimated: one recording and its residuals.

Made by `analysis.diagnosis.errors.evidence_from_residuals`, read by the effects (`Effect.starts`). Sizes: n samples, m
driven axes, p response channels, d position channels. SI units; on rotational axes N stands for N m and m for rad.
"""

from dataclasses import dataclass

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Signals of one recording, with the predictions of the re-tuned model; the first dimension is time (n samples)."""

    model: MechanicalModel
    """Re-tuned model whose predictions are compared with the recording."""
    sample_rate_hz: float
    command: FloatArray
    """(n, m): commands, N."""
    axis_position: FloatArray
    """(n, m): position along each driven axis, m: simulated, plus the motion due to `axis_force`."""
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
    """(n, d): measured position, filled like `response`; None where no position was recorded."""
    predicted_position: FloatArray | None = None
    """(n, d): position that the model predicts; None where no position was recorded."""
    position_noise: FloatArray | None = None
    """(d,): rms of the noise of the position; None where no position was recorded."""
