"""The force along each driven axis that would explain a model's residual, and the motion that it causes.

Deconvolution through the model, regularised by the noise (Wiener filter): for each spectral line, with the residuals r
and the model's transfer H from the m forces to the c channels, both in units of the noise (`unit`),

    f = (H* H + diag(1 / s²))^-1 H* r        s: expected rms of the force

This f is the posterior mean of a white Gaussian force of variance s² (a latent force in the sense of Rogers and Friis,
Mech. Syst. Signal Process. 2021).
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

_SETTLING_S = 2.0
"""Length (s) of the zeros appended to the record: the discrete Fourier transform is periodic, and without them the
motion at the record's end would wrap around to its start. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class MissingForce:
    """Estimated missing force along m driven axes, and the motion that it causes."""

    force: FloatArray
    """(n, m), N (N m)."""
    position: FloatArray
    """(n, m), m (rad): contribution of that force to the positions of the driven axes."""
    velocity: FloatArray
    """(n, m), m/s (rad/s): contribution of that force to the velocities of the driven axes."""


def estimate_missing_force(
    model: MechanicalModel, residuals: FloatArray, unit: FloatArray, sample_rate_hz: float, expected_rms_n: FloatArray
) -> MissingForce:
    """Estimate the force along each driven axis that explains the residuals (Wiener filter). residuals: (n, c), divided
    by `unit` (c,), the rms of what counts as noise here (sensor noise, model error); channels of the response, then of
    the position. expected_rms_n: (m,), expected rms s of the force, N (N m); a larger value passes more force and more
    noise."""
    n, c = residuals.shape
    padded_length = next_fast_len(n + int(_SETTLING_S * sample_rate_hz), real=True)
    transfer = compute_axis_transfer(model, sample_rate_hz, rfftfreq(padded_length, 1 / sample_rate_hz))
    channel_transfer = np.concatenate([transfer.response, transfer.position], axis=1)[:, :c] / unit[:c, None]
    spectrum = rfft(residuals, padded_length, axis=0)
    adjoint = np.conj(np.swapaxes(channel_transfer, 1, 2))
    normal_matrix = adjoint @ channel_transfer + np.diag(1 / expected_rms_n**2)
    force = np.linalg.solve(normal_matrix, adjoint @ spectrum[:, :, None])
    time_series = [
        irfft(force_or_motion[:, :, 0], padded_length, axis=0)[:n]
        for force_or_motion in (force, transfer.axis_position @ force, transfer.axis_velocity @ force)
    ]
    return MissingForce(*time_series)


_LARGEST_CONDITION = 1e8
"""Largest condition number of the eigenvectors with which the modal form is used; beyond it, rounding errors would
dominate, and each spectral line is solved for directly. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisTransfer:
    """Transfer functions from a force along each driven axis, held over each sample; each of shape (lines, rows, m)."""

    response: ComplexArray
    """To the response, as the sensor reads it."""
    position: ComplexArray
    """To the position channels."""
    axis_position: ComplexArray
    """To the positions of the driven axes."""
    axis_velocity: ComplexArray
    """To the velocities of the driven axes."""


def compute_axis_transfer(model: MechanicalModel, sample_rate_hz: float, frequency_hz: FloatArray) -> AxisTransfer:
    """Compute transfer functions of the linear mechanism, without effects and actuator; the sensor's low-pass acts on
    the response. frequency_hz: (lines,)."""
    discrete_model = discretise_model(model, 1 / sample_rate_hz)
    m, p = model.inputs, model.outputs
    z = np.exp(2j * np.pi * frequency_hz / sample_rate_hz)
    output_matrix = np.vstack([discrete_model.motion[: 2 * m], discrete_model.response, discrete_model.position])
    responses = _compute_frequency_response(
        discrete_model.transition, discrete_model.state_by_port_force, output_matrix, z
    )
    # A force takes effect from the next sample on; its direct feedthrough is read one sample late.
    response = responses[:, 2 * m : 2 * m + p] + discrete_model.response_by_port_force * (1 / z)[:, None, None]
    if model.sensor.bandwidth_hz > 0:
        decay = np.exp(-2 * np.pi * model.sensor.bandwidth_hz / sample_rate_hz)
        response = response * ((1 - decay) / (1 - decay / z))[:, None, None]
    return AxisTransfer(response, responses[:, 2 * m + p :], responses[:, :m], responses[:, m : 2 * m])


def _compute_frequency_response(A: FloatArray, B: FloatArray, C: FloatArray, z: ComplexArray) -> ComplexArray:
    """Compute C (zI - A)^-1 B, (lines, rows, inputs); by the eigenvectors of A where they are well conditioned. z:
    (lines,)."""
    poles, eigenvectors = np.linalg.eig(A)
    if np.linalg.cond(eigenvectors) < _LARGEST_CONDITION:
        output_modes, input_modes = C @ eigenvectors, np.linalg.solve(eigenvectors, B.astype(complex))
        return np.asarray(
            np.einsum("rs,ls,sm->lrm", output_modes, 1 / (z[:, None] - poles), input_modes, optimize=True)
        )
    resolvent = z[:, None, None] * np.eye(len(A)) - A
    return np.asarray(C @ np.linalg.solve(resolvent, np.broadcast_to(B.astype(complex), (len(z), *B.shape))))
