"""Frequency response and simulation of a discrete state-space model, x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k].

The frequency response is C (zI - A)^-1 B + D at z = exp(2 pi j f / rate), by back substitution in the Schur form of A.
Called by identification, equalization and the identification report. n: order, m: inputs, p: outputs.
"""

import numpy as np
from scipy.linalg import schur

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import ComplexArray, FloatArray


def compute_model_response(model: IdentifiedModel, frequency_hz: FloatArray) -> ComplexArray:
    """Compute the frequency response C (zI - A)^-1 B + D, (lines, p, m), in output unit per input unit. frequency_hz:
    (lines,). A pole exactly at a line gives inf or NaN."""
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / model.sample_rate_hz)
    # Schur form A = Q T Q^H, computed once: with T upper triangular, a line takes n^2 operations instead of n^3.
    T, Q = schur(model.A, output="complex")
    schur_inputs = Q.conj().T @ model.B
    states = np.empty((model.order, len(z), model.B.shape[1]), dtype=np.complex128)
    for row in reversed(range(model.order)):
        coupling = np.tensordot(T[row, row + 1 :], states[row + 1 :], axes=1)
        states[row] = (schur_inputs[row] + coupling) / (z - T[row, row])[:, None]
    outputs = np.tensordot(model.C @ Q, states, axes=1)
    return np.ascontiguousarray(outputs.transpose(1, 0, 2) + model.D)


def simulate(model: IdentifiedModel, commands: FloatArray, state: FloatArray | None = None) -> FloatArray:
    """Simulate the responses (N, p) to commands (N, m). state: (n,), initial state; None = at rest (zero)."""
    A, B, C, D = model.A, model.B, model.C, model.D
    x = np.zeros(model.order) if state is None else np.asarray(state, dtype=np.float64)
    states = np.empty((len(commands), model.order))
    state_inputs = commands @ B.T
    for k in range(len(commands)):
        states[k] = x
        x = A @ x + state_inputs[k]
    responses: FloatArray = states @ C.T + commands @ D.T
    return responses
