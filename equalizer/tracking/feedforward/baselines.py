"""Baseline methods of equalization for comparison: each is a matrix, per spectral line, from wanted accelerations to
forces.

Costs are multiply-adds per sample of an implementation that runs sample by sample at the sample rate of the response. A
periodic command that is computed beforehand costs nothing while it is played.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.periodic_inverse import WEIGHT, inverse_response, invert_regularised


@dataclass(frozen=True, slots=True, eq=False)
class Inverse:
    """Matrix from wanted accelerations to forces at each spectral line."""

    name: str
    response: ComplexArray
    """(lines, m, p), N per m/s²."""
    multiply_adds: int
    """Multiply-adds per sample for all channels."""


def baseline_inverses(
    model: IdentifiedModel, measured: FrequencyResponse, frequency_hz: FloatArray
) -> tuple[Inverse, ...]:
    """All baseline inverses from the data of one place; the last is that of the identified model. frequency_hz:
    (lines,), above zero. Raises ValueError where the measured response does not cover them."""
    return (
        no_equalization(model, frequency_hz),
        static_gain(model, frequency_hz),
        acceleration_matching(model, frequency_hz),
        rigid_body(model, frequency_hz),
        raw_estimate(measured, frequency_hz),
        make_identified_inverse(model, frequency_hz),
    )


def no_equalization(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """No equalization: the wanted acceleration in m/s² is commanded as a force in N."""
    return Inverse("nothing", _constant_response(np.eye(*model.D.shape[::-1]), frequency_hz), 0)


def static_gain(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """A common gain for all axes: the inverse of the geometric mean, over lines and axes, of the direct responses'
    magnitude."""
    direct_gains = np.abs(np.einsum("lii->li", model_response(model, frequency_hz)))
    gain = float(np.exp(-np.log(direct_gains).mean()))
    return Inverse(
        "static gain", _constant_response(gain * np.eye(*model.D.shape[::-1]), frequency_hz), model.D.shape[1]
    )


def acceleration_matching(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """Acceleration matching (Kuchenbecker et al. 2006, IEEE Trans. Vis. Comput. Graph. 12:219): the direct response of
    each axis is inverted, and coupling between axes is neglected. Cost: a transfer function of the model's order per
    axis."""
    direct_response = np.einsum("lii->li", model_response(model, frequency_hz))
    inverse = np.einsum("li,ij->lij", 1 / direct_response, np.eye(direct_response.shape[1]))
    return Inverse("acceleration matching", inverse, direct_response.shape[1] * (2 * model.order + 1))


def rigid_body(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """Rigid-body inverse dynamics, force = M a + B v + K x, with matrices fitted by least squares so that the model's
    response to these forces is the wanted acceleration at the given lines."""
    G = model_response(model, frequency_hz)
    lines, p, m = G.shape
    w = 2 * np.pi * frequency_hz
    parts = (np.ones(lines, dtype=complex), 1 / (1j * w), -1 / w**2)
    system = np.concatenate([part[:, None, None] * G for part in parts], axis=2).reshape(lines * p, 3 * m)
    targets = np.tile(np.eye(p), (lines, 1))
    real_system = np.vstack([system.real, system.imag])
    scale = np.linalg.norm(real_system, axis=0)
    matrices = np.linalg.lstsq(real_system / scale, np.vstack([targets, 0 * targets]), rcond=None)[0] / scale[:, None]
    M, B, K = matrices.reshape(3, m, p)
    inverse = sum(part[:, None, None] * matrix for part, matrix in zip(parts, (M, B, K), strict=True))
    # Cost: three matrices, and two integrations per axis.
    return Inverse("rigid-body dynamics", np.asarray(inverse, dtype=complex), 3 * m * p + 2 * p)


def raw_estimate(measured: FrequencyResponse, frequency_hz: FloatArray, weight: float = WEIGHT) -> Inverse:
    """Regularised inverse of the measured response, interpolated linearly between its reliable lines. Cost: FIR filters
    as long as the inverse of the smallest line spacing. Raises ValueError for frequencies outside the lines."""
    lines = measured.select_lines(measured.reliable)
    low, high = (lines.frequency_hz[0], lines.frequency_hz[-1]) if len(lines) else (np.inf, -np.inf)
    if not len(lines) or frequency_hz.min() < low or frequency_hz.max() > high:
        raise ValueError(
            f"the measured response has reliable lines from {low:g} to {high:g} Hz, "
            f"but {frequency_hz.min():g} to {frequency_hz.max():g} Hz is wanted"
        )
    p, m = lines.response.shape[1:]
    entries = [np.interp(frequency_hz, lines.frequency_hz, entry) for entry in lines.response.reshape(-1, p * m).T]
    G = np.stack(entries, axis=1).reshape(-1, p, m)
    taps = round(measured.sample_rate_hz / float(np.diff(lines.frequency_hz).min()))
    return Inverse("raw estimate", invert_regularised(np.asarray(G, dtype=complex), weight), taps * p * m)


def make_identified_inverse(model: IdentifiedModel, frequency_hz: FloatArray, weight: float = WEIGHT) -> Inverse:
    """Regularised inverse of the identified model. Cost: state update and stored gains, with a full state matrix; less
    in modal form."""
    m, p = model.D.shape[1], model.D.shape[0]
    cost = model.order**2 + 2 * model.order * m + m * p
    return Inverse("identified model", inverse_response(model, frequency_hz, weight), cost)


def _constant_response(matrix: FloatArray, frequency_hz: FloatArray) -> ComplexArray:
    """(lines, m, p): the same matrix at every line."""
    return np.broadcast_to(matrix.astype(complex), (len(frequency_hz), *matrix.shape)).copy()
