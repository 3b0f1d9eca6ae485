"""Transfer functions of a mechanical model from forces along its driven axes, on the lines of a discrete Fourier
transform."""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.linear_simulation import linear_steps
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

_WELL_CONDITIONED = 1e8
"""Largest condition number of the mode shapes for which modal coordinates are used."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisTransfer:
    """Transfer functions from a force along each driven axis, held over each sample; each of shape (lines, rows, m)."""

    response: ComplexArray
    """To the response, as the sensor reads it."""
    position: ComplexArray
    axis_position: ComplexArray
    axis_velocity: ComplexArray


def axis_transfer(model: MechanicalModel, sample_rate_hz: float, frequency_hz: FloatArray) -> AxisTransfer:
    """Transfer functions without effects and actuator. frequency_hz: (lines,)."""
    steps = linear_steps(model, 1 / sample_rate_hz)
    m, p = model.inputs, model.outputs
    z = np.exp(2j * np.pi * frequency_hz / sample_rate_hz)
    rows = np.vstack([steps.motion[: 2 * m], steps.response, steps.position])
    responses = _frequency_response(steps.advance, steps.by_axis_force, rows, z)
    # A force takes effect from the next sample on; its direct feedthrough is read one sample late.
    response = responses[:, 2 * m : 2 * m + p] + steps.response_by_axis_force * (1 / z)[:, None, None]
    if model.sensor.bandwidth_hz > 0:
        decay = np.exp(-2 * np.pi * model.sensor.bandwidth_hz / sample_rate_hz)
        response = response * ((1 - decay) / (1 - decay / z))[:, None, None]
    return AxisTransfer(response, responses[:, 2 * m + p :], responses[:, :m], responses[:, m : 2 * m])


def _frequency_response(A: FloatArray, B: FloatArray, C: FloatArray, z: ComplexArray) -> ComplexArray:
    """C (zI - A)^-1 B, (lines, rows, inputs)."""
    poles, shapes = np.linalg.eig(A)
    if np.linalg.cond(shapes) < _WELL_CONDITIONED:
        left, right = C @ shapes, np.linalg.solve(shapes, B.astype(complex))
        return np.asarray(np.einsum("rs,ls,sm->lrm", left, 1 / (z[:, None] - poles), right, optimize=True))
    resolvent = z[:, None, None] * np.eye(len(A)) - A
    return np.asarray(C @ np.linalg.solve(resolvent, np.broadcast_to(B.astype(complex), (len(z), *B.shape))))
