"""Block-diagonal (modal) form of a linear step: pairs of coordinates that are decoupled from all others."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import matrix_balance

from equalizer.signals.signal import FloatArray

LARGEST_CONDITION = 1e4
"""Largest condition number of the pairs' directions, balanced; above it rounding would show, and the full matrix is
used."""
LARGEST_REST = 1e-12
"""Largest residual coupling between the pairs that is neglected."""
NEARLY_ONE = 1e-3
"""Ratio of the singular values of a pair's two directions below which they count as parallel; they are then replaced by
a basis of the invariant plane."""


@dataclass(frozen=True, slots=True, eq=False)
class StepForm:
    """Coordinates z with x = outward z, and one step without forces in them."""

    advance: FloatArray
    """Pairs: (4, s / 2), z_i becomes a_0i z_i + a_1i z_j and z_j becomes a_2i z_i + a_3i z_j, where j = i + s / 2. Else
    (s, s), transposed."""
    outward: FloatArray
    """(s, s)"""
    inward: FloatArray
    """(s, s)"""


def step_form(advance: FloatArray) -> StepForm:
    """Form in which to step. advance: (s, s), s even. In pairs where these are well separated, else the full matrix."""
    size = len(advance)
    dense = StepForm(np.ascontiguousarray(advance.T), np.eye(size), np.eye(size))
    if not np.isfinite(advance).all():
        return dense
    balanced, scale = matrix_balance(advance, permute=False, separate=True)
    # First all planes' first directions, then all second ones.
    basis = np.stack(list(_planes(balanced)), axis=2).reshape(size, size)
    if not np.linalg.cond(basis) < LARGEST_CONDITION:
        return dense
    back = np.linalg.inv(basis)
    moved = back @ balanced @ basis
    half = np.arange(size // 2)
    first, second = half, half + size // 2
    blocks = np.array([moved[first, first], moved[first, second], moved[second, first], moved[second, second]])
    for rows, columns in ((first, first), (first, second), (second, first), (second, second)):
        moved[rows, columns] = 0.0
    if np.abs(moved).max() > LARGEST_REST:
        return dense
    return StepForm(blocks, scale[0][:, None] * basis, back / scale[0])


def _planes(advance: FloatArray) -> Iterator[FloatArray]:
    """(s, 2) each: an orthonormal basis of the plane in which a pair of eigenvalues moves."""
    values, vectors = np.linalg.eig(advance)
    turning = np.flatnonzero(values.imag > 0)
    real = np.flatnonzero(values.imag == 0)
    real = real[np.argsort(values[real].real)]
    pairs = [(vectors[:, i].real, vectors[:, i].imag, values[i], values[i].conj()) for i in turning]
    pairs += [
        (vectors[:, i].real, vectors[:, j].real, values[i], values[j])
        for i, j in zip(real[::2], real[1::2], strict=False)
    ]
    for each, other, first, second in pairs:
        plane, sizes, _ = np.linalg.svd(np.column_stack([each, other]), full_matrices=False)
        if sizes[1] < NEARLY_ONE * sizes[0]:
            square = advance @ advance - (first + second).real * advance + (first * second).real * np.eye(len(advance))
            plane = np.linalg.svd(square)[2][-2:].T
        yield plane
