"""B and D when A and C are known: the response is linear in them, so weighted least squares on the lines."""

import numpy as np

from equalizer.identification.state_space.modal_form import ModalForm
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

RANK = 1e-11
"""Directions weaker than this share of the strongest are left at zero rather than filled with noise."""


def input_matrices(form: ModalForm, lines: WeightedLines) -> tuple[FloatArray, FloatArray]:
    """B (n, m) and D (p, m). Each input is a problem of its own."""
    n, p = form.C.shape[1], form.C.shape[0]
    regressors = weighted_regressors(form, lines)
    measured = by_input(lines.weight * lines.response)
    solved = np.stack([_least_squares(phi, y) for phi, y in zip(regressors, measured, strict=True)], axis=1)
    return solved[:n], solved[n : n + p]


def weighted_regressors(form: ModalForm, lines: WeightedLines) -> FloatArray:
    """(m, 2 lines p, n + p): what one unit of each entry of B and D adds to the weighted response, real parts then
    imaginary ones."""
    states = form.from_states(lines.z)
    p = form.C.shape[0]
    unit = np.broadcast_to(np.eye(p), (len(lines), p, p))
    phi = np.concatenate([states, unit], axis=2)
    weighted = lines.weight.transpose(2, 0, 1)[:, :, :, None] * phi
    flat = weighted.reshape(len(weighted), -1, phi.shape[2])
    return np.concatenate([flat.real, flat.imag], axis=1)


def by_input(values: ComplexArray) -> FloatArray:
    """(lines, p, m) complex as (m, 2 lines p) real, in the rows' order of `weighted_regressors`."""
    flat = values.transpose(2, 0, 1).reshape(values.shape[2], -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _least_squares(phi: FloatArray, y: FloatArray) -> FloatArray:
    size = np.linalg.norm(phi, axis=0)
    size[size == 0] = 1.0
    solved: FloatArray = np.linalg.lstsq(phi / size, y, rcond=RANK)[0] / size
    return solved
