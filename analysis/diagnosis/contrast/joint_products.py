"""Joint least squares of one base model on two sets of stretches, one of them with a fault of unknown size.

The base is fitted to both sets at once, so that it is never extrapolated to states that only one set has visited.
Undoing a fault changes the rows of one set by (size) x (change for size 1): exactly where the fault is linear, and to
first order about size 1 elsewhere. The products of the rows and of their changes, block by block, are sufficient
statistics. `rank_faults` and `fit_faults` call this.
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
"""Ridge relative to the mean power of the columns. By hand."""
LARGEST_PRODUCT = 1e16
"""Product of columns above which undoing a fault with bounded sizes counts as ill-conditioned. By hand."""
MOST_NEWTON_STEPS = 3
"""Largest number of Gauss-Newton steps."""


@dataclass(frozen=True, slots=True, eq=False)
class Grams:
    """Products of the columns of the rows and of their changes with a fault of size 1 undone, block by block."""

    blocks: FloatArray
    """(blocks, k, k): the columns first, then their changes, size by size."""
    changed_columns: tuple[ColumnIndices, ...]
    """Per size, the columns that change."""
    width: int
    """Number of columns without the changes."""

    def is_well_conditioned(self, variant: Variant) -> bool:
        """Whether undoing the fault is well-conditioned. Unbounded sizes are in SI units (such as a mass of 1 kg on a
        device of 1 mg), so that their products may have any magnitude and are only tested to be finite."""
        limit = LARGEST_PRODUCT if np.isfinite(variant.upper_bound) else np.inf
        return bool(np.isfinite(self.blocks).all() and np.abs(self.blocks).max(initial=0.0) < limit)

    def build_undoing_matrix(self, sizes: FloatArray) -> FloatArray:
        """Build the matrix T (width, k) for which T P T' are the products, with faults of these sizes undone, from the
        products P (k, k) of the columns and their changes."""
        matrix = np.zeros((self.width, self.blocks.shape[1]))
        matrix[:, : self.width] = np.eye(self.width)
        first_column = self.width
        for size, columns in zip(sizes, self.changed_columns, strict=True):
            matrix[columns, first_column + np.arange(len(columns))] = size
            first_column += len(columns)
        return matrix

    def build_error_change(self, weights: FloatArray) -> FloatArray:
        """Build (sizes, k): the derivative of the residual by each size, as weights of the columns and their changes.
        weights: (width,) of the residual."""
        matrix = np.zeros((len(self.changed_columns), self.blocks.shape[1]))
        first_column = self.width
        for size_index, columns in enumerate(self.changed_columns):
            matrix[size_index, first_column : first_column + len(columns)] = weights[columns]
            first_column += len(columns)
        return matrix

    def undo_sizes(self, sizes: FloatArray) -> FloatArray:
        """Compute (blocks, width, width): products of the rows with faults of these sizes undone."""
        undoing = self.build_undoing_matrix(sizes)
        return np.asarray(undoing @ self.blocks @ undoing.T)

    def sum_blocks(self, blocks: Sequence[int]) -> FloatArray:
        """Sum the products of these blocks, (k, k)."""
        return np.asarray(self.blocks[list(blocks)].sum(axis=0))


@dataclass(frozen=True, eq=False)
class Pair:
    """Blocks of a compared base: those in which a fault is undone, and those that are left unchanged."""

    undone: Grams
    undone_blocks: tuple[int, ...]
    """Indices in `undone` of the blocks with the fault."""
    unchanged: tuple[FloatArray, ...]
    """Products (width, width) of the unchanged rows, one matrix per block."""
    may_grow: float = 1.0
    """Factor by which undoing the fault may raise the sum of squares of the first blocks' own base without penalty.
    Where the clean set has larger errors than the faulty one, a faulty sensor may have hidden errors."""

    @cached_property
    def undone_sum(self) -> FloatArray:
        """(k, k): products of the blocks with the fault."""
        return self.undone.sum_blocks(self.undone_blocks)

    @cached_property
    def unchanged_sum(self) -> FloatArray:
        """(width, width): sum of the products of the unchanged blocks."""
        return np.asarray(sum(self.unchanged))


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Fitted sizes of a fault, and the errors of the base with the fault undone by these sizes."""

    sizes: FloatArray
    """(sizes,): one per function in `Variant.undo`; empty without a fault."""
    errors: FloatArray
    """(blocks with, then without): sums of squares of whitened errors, over all compared bases."""

    @property
    def error(self) -> float:
        """Sum of squares over all blocks."""
        return float(self.errors.sum())


def fit_sizes(pairs: Sequence[Pair], variant: Variant | None) -> Fit:
    """Fit the sizes by Gauss-Newton steps, with every base fitted to both sets (variable projection; Golub and Pereyra,
    SIAM J. Numer. Anal. 10:413, 1973). variant: None = no fault. Raises numpy.linalg.LinAlgError where the normal
    equations are singular."""
    if variant is None:
        return _fit_at(pairs, np.zeros(0))
    sizes = _find_starting_sizes(variant)
    for _ in range(MOST_NEWTON_STEPS):
        gradients, grams = np.zeros(len(sizes)), np.zeros((len(sizes), len(sizes)))
        for pair in pairs:
            gradient, gram = _compute_newton_terms(pair, sizes)
            gradients += gradient
            grams += gram
        grams += 1e-9 * max(float(np.trace(grams)) / len(grams), 1e-300) * np.eye(len(grams))
        updated = np.clip(sizes - np.linalg.solve(grams, gradients), variant.lower_bound, variant.upper_bound)
        if np.allclose(updated, sizes, rtol=1e-6, atol=1e-12):
            sizes = updated
            break
        sizes = updated
    return _fit_at(pairs, sizes)


def _fit_at(pairs: Sequence[Pair], sizes: FloatArray) -> Fit:
    """Fit the bases with faults of these sizes undone; errors are summed over the pairs."""
    return Fit(sizes, sum((_compute_block_errors(pair, sizes) for pair in pairs), np.zeros(1)))


def compute_error(pairs: Sequence[Pair], sizes: FloatArray) -> float:
    """Compute the sum of squares over all blocks with faults of these sizes undone."""
    return float(sum(_compute_block_errors(pair, sizes).sum() for pair in pairs))


def _find_starting_sizes(variant: Variant) -> FloatArray:
    """Starting sizes: 1 about which a variant is linearised (bounds above 0), else 0."""
    count = len(variant.undo)
    return np.ones(count) if variant.lower_bound > 0 else np.zeros(count)


def solve_residual_weights(products: FloatArray) -> FloatArray:
    """Solve the ridge regression of the first column on the others. Returns (width,): 1, then minus their weights, so
    that rows times this vector are residuals. products: (width, width)."""
    gram, cross = products[1:, 1:], products[1:, 0]
    weights = np.linalg.solve(_add_ridge(gram), cross)
    return np.concatenate([[1.0], -weights])


def compute_own_fit_error(gram: FloatArray) -> float:
    """Compute the residual sum of squares with weights fitted to these products (width, width) alone."""
    weights = solve_residual_weights(gram)
    return max(float(weights @ gram @ weights), 0.0)


def _compute_joint_products(pair: Pair, sizes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the products with the fault (k, k), the matrix of `Grams.build_undoing_matrix`, and the products
    (width, width) of all rows with the fault undone."""
    undone_products, undoing = pair.undone_sum, pair.undone.build_undoing_matrix(_pad_sizes(pair, sizes))
    return undone_products, undoing, np.asarray(undoing @ undone_products @ undoing.T + pair.unchanged_sum)


def _pad_sizes(pair: Pair, sizes: FloatArray) -> FloatArray:
    """The sizes; zeros for every size of the pair where `sizes` is empty, as without a fault."""
    return sizes if len(sizes) else np.zeros(len(pair.undone.changed_columns))


def _compute_newton_terms(pair: Pair, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute half the gradient and half the Gauss-Newton Hessian of the error by the sizes, with the base's weights
    eliminated (variable projection)."""
    undone_products, undoing, joint = _compute_joint_products(pair, sizes)
    weights = solve_residual_weights(joint)
    change = pair.undone.build_error_change(weights)
    slope = change @ undone_products @ (undoing.T @ weights)
    cross = change @ undone_products @ undoing.T[:, 1:]
    squares = change @ undone_products @ change.T
    return np.asarray(slope), np.asarray(squares - cross @ np.linalg.solve(_add_ridge(joint[1:, 1:]), cross.T))


def _add_ridge(gram: FloatArray) -> FloatArray:
    """The Gram matrix (k, k) with `RIDGE` times its mean diagonal element added to its diagonal."""
    return np.asarray(gram + (RIDGE * float(np.trace(gram)) / len(gram) + 1e-300) * np.eye(len(gram)))


def _compute_block_errors(pair: Pair, sizes: FloatArray) -> FloatArray:
    """Compute the sum of squares of each block, those with the fault first, then those without, with weights fitted to
    all blocks with the fault undone."""
    _, undoing, joint = _compute_joint_products(pair, sizes)
    weights = solve_residual_weights(joint)
    extended_weights = undoing.T @ weights
    blocks = pair.undone.blocks[list(pair.undone_blocks)]
    undone_errors = np.einsum("i,bij,j->b", extended_weights, blocks, extended_weights) / _compute_error_growth(
        pair, undoing
    )
    unchanged_errors = [float(weights @ products @ weights) for products in pair.unchanged]
    return np.asarray(np.maximum(np.concatenate([undone_errors, np.array(unchanged_errors)]), 0.0))


def _compute_error_growth(pair: Pair, undoing: FloatArray) -> float:
    """Compute the factor (1 to `Pair.may_grow`) by which undoing the fault raises the error of a base that is fitted to
    the blocks with the fault alone."""
    if pair.may_grow <= 1.0:
        return 1.0
    products = pair.undone_sum[: pair.undone.width, : pair.undone.width]
    growth = compute_own_fit_error(undoing @ pair.undone_sum @ undoing.T) / max(compute_own_fit_error(products), 1e-300)
    return float(np.clip(growth, 1.0, pair.may_grow))


def compute_held_out_error(pairs: Sequence[Pair], sizes: FloatArray, held_out_blocks: Sequence[int]) -> float:
    """Compute the sum of squares of the held-out blocks (indices in `Pair.undone`), with weights of the base fitted to
    the blocks of the pairs. sizes: fitted to these pairs."""
    error = 0.0
    for pair in pairs:
        _, undoing, joint = _compute_joint_products(pair, sizes)
        extended_weights = undoing.T @ solve_residual_weights(joint)
        error += max(float(extended_weights @ pair.undone.sum_blocks(held_out_blocks) @ extended_weights), 0.0)
    return error
