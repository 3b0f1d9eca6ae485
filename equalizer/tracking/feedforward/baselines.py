"""Baseline methods of equalization for comparison: each is a matrix, per spectral line, from reference accelerations to
forces.

`study.evaluation.reproduction.reproduce_baselines` compares them with the identified model's inverse;
`make_static_gain_inverse` is also used by `study.workflows.equalizer.play_contact`. Costs are multiply-adds per sample
of an implementation that runs sample by sample at the sample rate of the response.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.periodic_inverse import (
    FORCE_WEIGHT,
    compute_regularised_inverse,
    invert_regularised,
)


@dataclass(frozen=True, slots=True, eq=False)
class Inverse:
    """Matrix from reference accelerations to forces at each spectral line, with its computational cost."""

    name: str
    response: ComplexArray
    """(lines, m, p), N per m/s²."""
    multiply_adds: int
    """Multiply-adds per sample for all channels."""


def compute_baseline_inverses(
    model: IdentifiedModel, measured_response: FrequencyResponse, frequency_hz: FloatArray
) -> tuple[Inverse, ...]:
    """Compute all baseline inverses from the model and the measured response of one place; the last is that of the
    identified model. frequency_hz: (lines,), above zero. Raises ValueError where the reliable lines of the measured
    response do not cover them."""
    return (
        make_identity_inverse(model, frequency_hz),
        make_static_gain_inverse(model, frequency_hz),
        make_acceleration_matching_inverse(model, frequency_hz),
        fit_rigid_body_inverse(model, frequency_hz),
        invert_measured_response(measured_response, frequency_hz),
        make_identified_inverse(model, frequency_hz),
    )


def make_identity_inverse(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """Make the inverse without equalization: the reference acceleration in m/s² is commanded as a force in N, axis by
    axis. Cost 0."""
    return Inverse("nothing", _repeat_over_lines(np.eye(*model.D.shape[::-1]), frequency_hz), 0)


def make_static_gain_inverse(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """Make a common gain (N per m/s²) for all axes: the inverse of the geometric mean, over lines and axes, of the
    magnitude of the direct responses (diagonal elements). Cost: one multiplication per axis."""
    direct_gains = np.abs(np.einsum("lii->li", compute_model_response(model, frequency_hz)))
    static_gain = float(np.exp(-np.log(direct_gains).mean()))
    return Inverse(
        "static gain", _repeat_over_lines(static_gain * np.eye(*model.D.shape[::-1]), frequency_hz), model.D.shape[1]
    )


def make_acceleration_matching_inverse(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """Make the inverse of acceleration matching (Kuchenbecker et al. 2006, IEEE Trans. Vis. Comput. Graph. 12:219): the
    direct response of each axis (diagonal element) is inverted, and coupling between axes is neglected. Cost: a
    transfer function of the model's order per axis. For as many forces as accelerations."""
    direct_response = np.einsum("lii->li", compute_model_response(model, frequency_hz))
    inverse = np.einsum("li,ij->lij", 1 / direct_response, np.eye(direct_response.shape[1]))
    return Inverse("acceleration matching", inverse, direct_response.shape[1] * (2 * model.order + 1))


def fit_rigid_body_inverse(model: IdentifiedModel, frequency_hz: FloatArray) -> Inverse:
    """Fit rigid-body inverse dynamics, force = M a + B v + K x, with matrices (m, p) fitted by least squares so that
    the model's response to these forces is the reference acceleration at the given lines. Velocity and position are the
    accelerations divided by i w and -w²."""
    G = compute_model_response(model, frequency_hz)
    line_count, p, m = G.shape
    angular_frequency = 2 * np.pi * frequency_hz
    integrators = (np.ones(line_count, dtype=complex), 1 / (1j * angular_frequency), -1 / angular_frequency**2)
    design_matrix = np.concatenate([integrator[:, None, None] * G for integrator in integrators], axis=2).reshape(
        line_count * p, 3 * m
    )
    targets = np.tile(np.eye(p), (line_count, 1))
    real_design_matrix = np.vstack([design_matrix.real, design_matrix.imag])
    column_norms = np.linalg.norm(real_design_matrix, axis=0)
    matrices = (
        np.linalg.lstsq(real_design_matrix / column_norms, np.vstack([targets, 0 * targets]), rcond=None)[0]
        / column_norms[:, None]
    )
    M, B, K = matrices.reshape(3, m, p)
    inverse = sum(integrator[:, None, None] * matrix for integrator, matrix in zip(integrators, (M, B, K), strict=True))
    # Cost: three matrices, and two integrations per axis.
    return Inverse("rigid-body dynamics", np.asarray(inverse, dtype=complex), 3 * m * p + 2 * p)


def invert_measured_response(
    measured_response: FrequencyResponse, frequency_hz: FloatArray, weight: float = FORCE_WEIGHT
) -> Inverse:
    """Compute the regularised inverse of the measured response, interpolated linearly between its reliable lines.
    weight: of |force|², (m/s² per N)². Cost: FIR filters whose length in seconds is the inverse of the smallest line
    spacing. Raises ValueError for frequencies outside the reliable lines, or for fewer than two such lines."""
    reliable_response = measured_response.select_lines(measured_response.reliable)
    lowest_hz, highest_hz = (
        (reliable_response.frequency_hz[0], reliable_response.frequency_hz[-1])
        if len(reliable_response)
        else (np.inf, -np.inf)
    )
    if not len(reliable_response) or frequency_hz.min() < lowest_hz or frequency_hz.max() > highest_hz:
        raise ValueError(
            f"the measured response has reliable lines from {lowest_hz:g} to {highest_hz:g} Hz, "
            f"but {frequency_hz.min():g} to {frequency_hz.max():g} Hz is required"
        )
    p, m = reliable_response.response.shape[1:]
    entries = [
        np.interp(frequency_hz, reliable_response.frequency_hz, entry)
        for entry in reliable_response.response.reshape(-1, p * m).T
    ]
    G = np.stack(entries, axis=1).reshape(-1, p, m)
    tap_count = round(measured_response.sample_rate_hz / float(np.diff(reliable_response.frequency_hz).min()))
    return Inverse("raw estimate", invert_regularised(np.asarray(G, dtype=complex), weight), tap_count * p * m)


def make_identified_inverse(model: IdentifiedModel, frequency_hz: FloatArray, weight: float = FORCE_WEIGHT) -> Inverse:
    """Make the regularised inverse of the identified model. weight: of |force|², (m/s² per N)². Cost: state update and
    stored gains, with a full state matrix; less in modal form."""
    m, p = model.D.shape[1], model.D.shape[0]
    multiply_adds = model.order**2 + 2 * model.order * m + m * p
    return Inverse("identified model", compute_regularised_inverse(model, frequency_hz, weight), multiply_adds)


def _repeat_over_lines(matrix: FloatArray, frequency_hz: FloatArray) -> ComplexArray:
    """Repeat the same matrix (m, p) at every line: (lines, m, p)."""
    return np.broadcast_to(matrix.astype(complex), (len(frequency_hz), *matrix.shape)).copy()
