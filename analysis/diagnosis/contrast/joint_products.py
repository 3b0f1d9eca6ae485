"""Joint least squares of a linear model (base) on two sets of recordings, one with a fault of unknown size.

A row z = (y, x) holds the predicted signal y and its regressors x; with the base's weights w, the residual is z' v with
v = (1, -w). Undoing a fault of size s in one set changes its rows to z + s d, with the change d for size 1: exactly
where the fault is linear, and to first order about size 1 elsewhere. The base is fitted to both sets at once, so that
it is never extrapolated beyond the states of one set. Gram matrices P of the columns (z, d), summed over each block of
rows, are sufficient statistics: with T = [I, s D], where D assigns the changes to their columns, T P T' is the Gram
matrix of the rows with the fault undone. Sizes are found by variable projection (Golub and Pereyra, SIAM J. Numer.
Anal. 10:413, 1973). Called by `fit_faults` and `rank_faults`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.contrast.fault import Variant
from equalizer.signals.signal import FloatArray

ColumnIndices = npt.NDArray[np.intp]
RIDGE = 1e-9
"""Ridge, relative to the mean diagonal element of a Gram matrix or Hessian. By hand."""
LARGEST_PRODUCT = 1e16
"""Magnitude of an element of a Gram matrix from which undoing a fault counts as ill-conditioned. By hand."""
MOST_NEWTON_STEPS = 3
"""Largest number of Gauss-Newton steps for the sizes. By hand."""


@dataclass(frozen=True, slots=True, eq=False)
class GramBlocks:
    """Gram matrices of the rows of one set and of their changes by undoing a fault of size 1, per block of rows."""

    blocks: FloatArray
    """(blocks, k, k): Gram matrices of the columns of the rows, then of their changes, size by size."""
    changed_columns: tuple[ColumnIndices, ...]
    """Per size, indices of the columns that change."""
    width: int
    """Number of columns of the rows, without the changes."""

    def is_well_conditioned(self, variant: Variant) -> bool:
        """Whether undoing the fault is well-conditioned: all elements are finite and, for sizes bounded above, below
        `LARGEST_PRODUCT`. Unbounded sizes are in SI units (such as 1 kg on a device of 1 mg), so that elements may have
        any magnitude."""
        limit = LARGEST_PRODUCT if np.isfinite(variant.upper_bound) else np.inf
        return bool(np.isfinite(self.blocks).all() and np.abs(self.blocks).max(initial=0.0) < limit)

    def build_undoing_matrix(self, sizes: FloatArray) -> FloatArray:
        """Build the matrix T (width, k) for which T P T' is the Gram matrix with faults of these sizes undone. sizes:
        (sizes,)."""
        undoing_matrix = np.zeros((self.width, self.blocks.shape[1]))
        undoing_matrix[:, : self.width] = np.eye(self.width)
        first_column = self.width
        for size, columns in zip(sizes, self.changed_columns, strict=True):
            undoing_matrix[columns, first_column + np.arange(len(columns))] = size
            first_column += len(columns)
        return undoing_matrix

    def build_residual_derivative(self, weights: FloatArray) -> FloatArray:
        """Build the derivative of the residual with respect to each size, (sizes, k), as weights of the columns and
        their changes. weights: (width,), v of the residual."""
        derivative = np.zeros((len(self.changed_columns), self.blocks.shape[1]))
        first_column = self.width
        for size_index, columns in enumerate(self.changed_columns):
            derivative[size_index, first_column : first_column + len(columns)] = weights[columns]
            first_column += len(columns)
        return derivative

    def undo_fault(self, sizes: FloatArray) -> FloatArray:
        """Compute the Gram matrices with faults of these sizes undone, (blocks, width, width)."""
        undoing_matrix = self.build_undoing_matrix(sizes)
        return np.asarray(undoing_matrix @ self.blocks @ undoing_matrix.T)

    def sum_blocks(self, blocks: Sequence[int]) -> FloatArray:
        """Sum the Gram matrices of these blocks, (k, k). blocks: indices."""
        return np.asarray(self.blocks[list(blocks)].sum(axis=0))


@dataclass(frozen=True, eq=False)
class SetPair:
    """Both sets of one base: blocks in which a fault is undone, and blocks that remain unchanged."""

    undone: GramBlocks
    undone_blocks: tuple[int, ...]
    """Indices in `undone` of the blocks with the fault."""
    unchanged: tuple[FloatArray, ...]
    """Gram matrices (width, width) of the unchanged blocks, at least one."""
    error_growth_limit: float = 1.0
    """Factor by which undoing the fault may raise the error of a base that is fitted to the undone blocks alone without
    penalty; at most 1 = not at all. Where the clean set has larger errors than the faulty one, a fault of the sensor,
    such as a low gain, may have reduced the errors."""

    @cached_property
    def undone_sum(self) -> FloatArray:
        """(k, k): Gram matrix of the blocks with the fault."""
        return self.undone.sum_blocks(self.undone_blocks)

    @cached_property
    def unchanged_sum(self) -> FloatArray:
        """(width, width): Gram matrix of all unchanged blocks."""
        return np.asarray(sum(self.unchanged))


@dataclass(frozen=True, slots=True, eq=False)
class SizeFit:
    """Fitted sizes of a fault, and the errors of the bases with faults of these sizes undone."""

    sizes: FloatArray
    """(sizes,): one per function in `Variant.undo`; empty without a fault."""
    errors: FloatArray
    """(blocks,): sums of squares of whitened errors over all bases; undone blocks first, then unchanged ones."""

    @property
    def error(self) -> float:
        """Sum of squares over all blocks."""
        return float(self.errors.sum())


def fit_sizes(pairs: Sequence[SetPair], variant: Variant | None) -> SizeFit:
    """Fit the sizes by at most `MOST_NEWTON_STEPS` Gauss-Newton steps within the variant's bounds, with every base
    fitted to both sets, until the sizes change by less than 1e-6 (relative). variant: None = no fault. Raises
    numpy.linalg.LinAlgError where the normal equations are singular."""
    if variant is None:
        return _fit_bases(pairs, np.zeros(0))
    sizes = _find_starting_sizes(variant)
    for _ in range(MOST_NEWTON_STEPS):
        gradient_sum, hessian_sum = np.zeros(len(sizes)), np.zeros((len(sizes), len(sizes)))
        for pair in pairs:
            gradient, hessian = _compute_newton_terms(pair, sizes)
            gradient_sum += gradient
            hessian_sum += hessian
        hessian_sum += RIDGE * max(float(np.trace(hessian_sum)) / len(hessian_sum), 1e-300) * np.eye(len(hessian_sum))
        updated_sizes = np.clip(
            sizes - np.linalg.solve(hessian_sum, gradient_sum), variant.lower_bound, variant.upper_bound
        )
        if np.allclose(updated_sizes, sizes, rtol=1e-6, atol=1e-12):
            sizes = updated_sizes
            break
        sizes = updated_sizes
    return _fit_bases(pairs, sizes)


def _fit_bases(pairs: Sequence[SetPair], sizes: FloatArray) -> SizeFit:
    """Fit the bases with faults of these sizes undone; errors are summed over the pairs."""
    return SizeFit(sizes, sum((_compute_block_errors(pair, sizes) for pair in pairs), np.zeros(1)))


def compute_error(pairs: Sequence[SetPair], sizes: FloatArray) -> float:
    """Compute the sum of squares over all blocks and bases with faults of these sizes undone."""
    return float(sum(_compute_block_errors(pair, sizes).sum() for pair in pairs))


def _find_starting_sizes(variant: Variant) -> FloatArray:
    """Find the starting sizes: 1 where the variant is linearised about size 1 (lower bound above 0), else 0."""
    count = len(variant.undo)
    return np.ones(count) if variant.lower_bound > 0 else np.zeros(count)


def solve_residual_weights(products: FloatArray) -> FloatArray:
    """Solve the ridge regression of the first column on the others. Returns v (width,): 1, then minus the weights; rows
    times v are residuals. products: Gram matrix (width, width)."""
    gram, cross = products[1:, 1:], products[1:, 0]
    weights = np.linalg.solve(_add_ridge(gram), cross)
    return np.concatenate([[1.0], -weights])


def compute_residual_squares(gram: FloatArray) -> float:
    """Compute the residual sum of squares of the ridge regression on this Gram matrix (width, width); at least 0."""
    weights = solve_residual_weights(gram)
    return max(float(weights @ gram @ weights), 0.0)


def _compute_joint_products(pair: SetPair, sizes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the Gram matrix (k, k) of the blocks with the fault, the matrix T of `GramBlocks.build_undoing_matrix`,
    and the Gram matrix (width, width) of both sets with the fault undone."""
    undone_gram, undoing_matrix = pair.undone_sum, pair.undone.build_undoing_matrix(_pad_sizes(pair, sizes))
    return undone_gram, undoing_matrix, np.asarray(undoing_matrix @ undone_gram @ undoing_matrix.T + pair.unchanged_sum)


def _pad_sizes(pair: SetPair, sizes: FloatArray) -> FloatArray:
    """Replace empty sizes (no fault) by a zero for each size of the pair; others are returned unchanged."""
    return sizes if len(sizes) else np.zeros(len(pair.undone.changed_columns))


def _compute_newton_terms(pair: SetPair, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute half the gradient (sizes,) and half the Gauss-Newton Hessian (sizes, sizes) of the sum of squares with
    respect to the sizes, with the base's weights eliminated (variable projection)."""
    undone_gram, undoing_matrix, joint_gram = _compute_joint_products(pair, sizes)
    weights = solve_residual_weights(joint_gram)
    residual_derivative = pair.undone.build_residual_derivative(weights)
    gradient = residual_derivative @ undone_gram @ (undoing_matrix.T @ weights)
    cross = residual_derivative @ undone_gram @ undoing_matrix.T[:, 1:]
    squares = residual_derivative @ undone_gram @ residual_derivative.T
    return np.asarray(gradient), np.asarray(squares - cross @ np.linalg.solve(_add_ridge(joint_gram[1:, 1:]), cross.T))


def _add_ridge(gram: FloatArray) -> FloatArray:
    """Add `RIDGE` times the mean diagonal element to the diagonal of a Gram matrix (k, k), and 1e-300 against a zero
    matrix."""
    return np.asarray(gram + (RIDGE * float(np.trace(gram)) / len(gram) + 1e-300) * np.eye(len(gram)))


def _compute_block_errors(pair: SetPair, sizes: FloatArray) -> FloatArray:
    """Compute the sum of squares of each block, (blocks,), at least 0: undone blocks first, divided by
    `_compute_error_growth`, then unchanged ones. The base is fitted to all of them."""
    _, undoing_matrix, joint_gram = _compute_joint_products(pair, sizes)
    weights = solve_residual_weights(joint_gram)
    extended_weights = undoing_matrix.T @ weights
    blocks = pair.undone.blocks[list(pair.undone_blocks)]
    undone_errors = np.einsum("i,bij,j->b", extended_weights, blocks, extended_weights) / _compute_error_growth(
        pair, undoing_matrix
    )
    unchanged_errors = [float(weights @ gram @ weights) for gram in pair.unchanged]
    return np.asarray(np.maximum(np.concatenate([undone_errors, np.array(unchanged_errors)]), 0.0))


def _compute_error_growth(pair: SetPair, undoing_matrix: FloatArray) -> float:
    """Compute the factor (1 to `SetPair.error_growth_limit`) by which undoing the fault raises the error of a base that
    is fitted to the undone blocks alone."""
    if pair.error_growth_limit <= 1.0:
        return 1.0
    gram = pair.undone_sum[: pair.undone.width, : pair.undone.width]
    growth = compute_residual_squares(undoing_matrix @ pair.undone_sum @ undoing_matrix.T) / max(
        compute_residual_squares(gram), 1e-300
    )
    return float(np.clip(growth, 1.0, pair.error_growth_limit))


def compute_held_out_error(pairs: Sequence[SetPair], sizes: FloatArray, held_out_blocks: Sequence[int]) -> float:
    """Compute the sum of squares of the held-out blocks (indices in `SetPair.undone`) with the fault undone, summed
    over the pairs. The bases are fitted to the blocks of the pairs; sizes: fitted to these pairs."""
    error = 0.0
    for pair in pairs:
        _, undoing_matrix, joint_gram = _compute_joint_products(pair, sizes)
        extended_weights = undoing_matrix.T @ solve_residual_weights(joint_gram)
        error += max(float(extended_weights @ pair.undone.sum_blocks(held_out_blocks) @ extended_weights), 0.0)
    return error
