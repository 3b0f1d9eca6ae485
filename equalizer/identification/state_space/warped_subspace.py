"""Poles and output shapes from a frequency response, by subspace identification in the frequency domain.

Method: McKelvey, Akçay and Ljung, IEEE Trans. Autom. Control 41:960 (1996), with two changes for noisy data. The
bilinear (all-pass) map zeta = (z - c) / (1 - c z) warps the frequency axis, so that the centre of the band lies at a
quarter turn of the unit circle; and block rows are whitened before their singular values are compared. With p outputs
and powers zeta^q, q < horizon, the rows zeta^q G are projected onto the complement of the input's rows; the left
singular vectors of the result span the extended observability matrix, whose shift structure gives the poles. The
horizon is short, because with a long horizon the noise covers the singular values that show the order. Called by
`candidates` and `order_report`.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.state_space.modal_form import ModalForm, build_form_from_poles
from equalizer.identification.state_space.stable_poles import stabilise_poles
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Subspace:
    """Extended observability matrix with its singular values, before an order is chosen."""

    directions: FloatArray
    """(horizon p, horizon p): columns span the extended observability matrix, in order of falling singular value; the
    whitening is undone."""
    singular_values: FloatArray
    """(horizon p,): of the whitened data; about 1 and falling slowly where there is only noise."""
    outputs: int
    """p: number of outputs."""
    warp: float
    """c of the bilinear map."""


def choose_horizon(order: int, outputs: int) -> int:
    """Choose the number of block rows: as many as the order needs, and three more (chosen) to average noise."""
    return -(-order // outputs) + 3


def compute_warp_coefficient(centre_hz: float, sample_rate_hz: float) -> float:
    """Compute c of the map zeta = (z - c) / (1 - c z) that puts centre_hz at a quarter turn of the unit circle."""
    half_angle = np.pi * centre_hz / sample_rate_hz
    return float((1 - np.tan(half_angle)) / (1 + np.tan(half_angle)))


def estimate_subspace(lines: WeightedLines, horizon: int, centre_hz: float) -> Subspace:
    """Estimate the extended observability matrix of a measured response, warped about centre_hz. horizon: number of
    block rows."""
    c = compute_warp_coefficient(centre_hz, lines.sample_rate_hz)
    zeta = (lines.z - c) / (1 - c * lines.z)
    powers = zeta[:, None] ** np.arange(horizon)
    p, m = lines.response.shape[1:]
    # The noise is modelled as a factor per output times a factor per line and input, so that dividing by both gives
    # all entries equal noise.
    noise_sd = 1 / lines.weight
    output_deviation = np.exp(np.log(noise_sd).mean(axis=(0, 2)))
    column_deviation = np.exp(np.log(noise_sd / output_deviation[:, None]).mean(axis=1))
    scaled_response = lines.response / output_deviation[:, None] / column_deviation[:, None, :]
    input_rows = np.einsum("lq,lj,jk->qklj", powers, 1 / column_deviation, np.eye(m)).reshape(horizon * m, -1)
    output_rows = np.einsum("lq,lij->qilj", powers, scaled_response).reshape(horizon * p, -1)
    residual_rows = _project_out_inputs(input_rows, output_rows)
    noise_factor = np.kron(np.linalg.cholesky((powers.T @ powers.conj()).real / len(zeta)), np.eye(p))
    left_vectors, singular_values, _ = np.linalg.svd(np.linalg.solve(noise_factor, residual_rows))
    directions = np.tile(output_deviation, horizon)[:, None] * (noise_factor @ left_vectors)
    return Subspace(directions, singular_values / np.sqrt(len(zeta) * m), p, c)


def _project_out_inputs(input_rows: ComplexArray, output_rows: ComplexArray) -> FloatArray:
    """Project the span of the inputs' rows out of the outputs' rows; returns the result (horizon p, horizon p),
    compressed by an LQ decomposition of real and imaginary parts."""
    rows = np.concatenate([input_rows, output_rows])
    real_rows = np.concatenate([rows.real, rows.imag], axis=1)
    triangle = np.asarray(np.linalg.qr(real_rows.T, mode="r"))
    return np.asarray(triangle[len(input_rows) :, len(input_rows) :].T, dtype=np.float64)


def extract_poles_and_shapes(subspace: Subspace, order: int, radius: float) -> ModalForm:
    """Extract the poles in the z plane (all within the radius) and output shapes of a model of this order from the
    strongest directions: least-squares solution of the shift equation, then the inverse map z = (zeta + c) / (1 + c
    zeta)."""
    observability = subspace.directions[:, :order]
    p, c = subspace.outputs, subspace.warp
    output_norms = np.linalg.norm(observability.reshape(-1, p, order), axis=(0, 2))
    normalised_observability = observability / np.tile(output_norms, len(observability) // p)[:, None]
    shift_matrix = np.linalg.lstsq(normalised_observability[:-p], normalised_observability[p:], rcond=None)[0]
    eigenvalues, eigenvectors = np.linalg.eig(shift_matrix)
    # The map also changes B and D, which are fitted afterwards; C is kept.
    return build_form_from_poles(
        stabilise_poles((eigenvalues + c) / (1 + c * eigenvalues), radius), observability[:p] @ eigenvectors
    )
