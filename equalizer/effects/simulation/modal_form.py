"""Real block-diagonal (modal) form of a discrete-time state transition: 2 x 2 blocks, each of a pair of eigenvalues.

With x = W z, the step x[k+1] = A x[k] becomes z[k+1] = W^-1 A W z[k]. Each pair of columns of W spans the invariant
plane of two eigenvalues of A (a complex pair, or two real ones), so that a step costs O(s) instead of O(s²). A is
balanced first. `stepping` calls `build_step_form`; `linear_step_kernel` computes the steps.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import matrix_balance

from equalizer.signals.signal import FloatArray

LARGEST_CONDITION = 1e4
"""Condition number of W for the balanced matrix at or above which rounding errors would be too large, and the full
matrix is used. Chosen."""
LARGEST_COUPLING = 1e-12
"""Largest coupling between the pairs (magnitude of the elements outside the blocks) that is neglected. Chosen."""
PARALLEL_RATIO = 1e-3
"""Ratio of the singular values of a pair's two directions below which they count as parallel; they are then replaced by
a basis of the invariant plane. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class StepForm:
    """Modal coordinates z with x = state_from_modal z and z = modal_from_state x, and the matrix of one step without
    inputs in these coordinates. s: number of states."""

    step_matrix: FloatArray
    """Pairs: (4, s / 2), with elements a: z_i becomes a_0i z_i + a_1i z_j, and z_j becomes a_2i z_i + a_3i z_j, where
    j = i + s / 2. Full matrix: (s, s), transposed."""
    state_from_modal: FloatArray
    """(s, s): from z to x."""
    modal_from_state: FloatArray
    """(s, s): from x to z."""


def build_step_form(transition: FloatArray) -> StepForm:
    """Build the form for computing x[k+1] = transition x[k]. transition: (s, s), s even. Returns pairs if W is
    well-conditioned and decouples them; else, and for a matrix that is not finite, the full matrix."""
    size = len(transition)
    full_form = StepForm(np.ascontiguousarray(transition.T), np.eye(size), np.eye(size))
    if not np.isfinite(transition).all():
        return full_form
    balanced, balancing = matrix_balance(transition, permute=False, separate=True)
    # Columns: the first directions of all planes, then all second ones, as `StepForm.step_matrix` pairs them.
    basis = np.stack(list(_iterate_invariant_planes(balanced)), axis=2).reshape(size, size)
    if not np.linalg.cond(basis) < LARGEST_CONDITION:
        return full_form
    inverse_basis = np.linalg.inv(basis)
    transformed = inverse_basis @ balanced @ basis
    pair_indices = np.arange(size // 2)
    first, second = pair_indices, pair_indices + size // 2
    blocks = np.array(
        [transformed[first, first], transformed[first, second], transformed[second, first], transformed[second, second]]
    )
    for rows, columns in ((first, first), (first, second), (second, first), (second, second)):
        transformed[rows, columns] = 0.0
    if np.abs(transformed).max() > LARGEST_COUPLING:
        return full_form
    return StepForm(blocks, balancing[0][:, None] * basis, inverse_basis / balancing[0])


def _iterate_invariant_planes(transition: FloatArray) -> Iterator[FloatArray]:
    """Iterate over orthonormal bases (s, 2) of the invariant planes of pairs of eigenvalues: complex pairs first, then
    real eigenvalues, paired in ascending order."""
    eigenvalues, eigenvectors = np.linalg.eig(transition)
    complex_indices = np.flatnonzero(eigenvalues.imag > 0)
    real_indices = np.flatnonzero(eigenvalues.imag == 0)
    real_indices = real_indices[np.argsort(eigenvalues[real_indices].real)]
    pairs = [
        (eigenvectors[:, i].real, eigenvectors[:, i].imag, eigenvalues[i], eigenvalues[i].conj())
        for i in complex_indices
    ]
    pairs += [
        (eigenvectors[:, i].real, eigenvectors[:, j].real, eigenvalues[i], eigenvalues[j])
        for i, j in zip(real_indices[::2], real_indices[1::2], strict=False)
    ]
    for first_vector, second_vector, first_eigenvalue, second_eigenvalue in pairs:
        plane, singular_values, _ = np.linalg.svd(np.column_stack([first_vector, second_vector]), full_matrices=False)
        if singular_values[1] < PARALLEL_RATIO * singular_values[0]:
            # Null space of (A - a I)(A - b I), for the eigenvalues a and b of nearly parallel eigenvectors.
            annihilator = (
                transition @ transition
                - (first_eigenvalue + second_eigenvalue).real * transition
                + (first_eigenvalue * second_eigenvalue).real * np.eye(len(transition))
            )
            plane = np.linalg.svd(annihilator)[2][-2:].T
        yield plane
