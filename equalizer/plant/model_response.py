"""What a discrete model answers at given frequencies."""

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray


def model_response(model: IdentifiedModel, frequency_hz: FloatArray) -> ComplexArray:
    """C (zI - A)^-1 B + D on the unit circle, shape (lines, p, m). frequency_hz: (lines,)."""
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / model.sample_rate_hz)
    resolvent = z[:, None, None] * np.eye(model.order) - model.A
    states = np.linalg.solve(resolvent, np.broadcast_to(model.B.astype(complex), (len(z), *model.B.shape)))
    return np.asarray(model.C @ states + model.D, dtype=np.complex128)


def simulate(model: IdentifiedModel, commands: FloatArray, state: FloatArray | None = None) -> FloatArray:
    """Responses (N, p) to commands (N, m) from a state (n,); at rest if None."""
    A, B, C, D = model.A, model.B, model.C, model.D
    x = np.zeros(model.order) if state is None else np.asarray(state, dtype=np.float64)
    states = np.empty((len(commands), model.order))
    driven = commands @ B.T
    for k in range(len(commands)):
        states[k] = x
        x = A @ x + driven[k]
    responses: FloatArray = states @ C.T + commands @ D.T
    return responses
