"""Joint least squares of one base model on two sets of stretches, one of them with a fault of unknown size.

The base is fitted to both sets at once, so that it is never extrapolated to states that only one set has visited.
Undoing a fault changes the rows of one set by (size) x (change for size 1): exactly where the fault is linear, and to
first order about size 1 elsewhere. The products of the rows and of their changes, block by block, are sufficient
statistics.
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
ROUNDS = 3
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

    def spread(self, sizes: FloatArray) -> FloatArray:
        """(width, k): the matrix that turns the products into those of the rows with faults of these sizes undone."""
        matrix = np.zeros((self.width, self.blocks.shape[1]))
        matrix[:, : self.width] = np.eye(self.width)
        first = self.width
        for size, columns in zip(sizes, self.changed_columns, strict=True):
            matrix[columns, first + np.arange(len(columns))] = size
            first += len(columns)
        return matrix

    def change(self, weights: FloatArray) -> FloatArray:
        """(sizes, k): the error's change with each size, as a sum of columns."""
        matrix = np.zeros((len(self.changed_columns), self.blocks.shape[1]))
        first = self.width
        for number, columns in enumerate(self.changed_columns):
            matrix[number, first : first + len(columns)] = weights[columns]
            first += len(columns)
        return matrix

    def undo_sizes(self, sizes: FloatArray) -> FloatArray:
        """(blocks, width, width): products of the rows with faults of these sizes undone."""
        spread = self.spread(sizes)
        return np.asarray(spread @ self.blocks @ spread.T)

    def sum_blocks(self, blocks: Sequence[int]) -> FloatArray:
        """(k, k): sum of the products of these blocks."""
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
    """The sizes with the least error, with every base fitted to both sets. variant: None = no fault. Raises
    numpy.linalg.LinAlgError where the normal equations are singular."""
    if variant is None:
        return _fit_at(pairs, np.zeros(0))
    sizes = _find_starting_sizes(variant)
    for _ in range(ROUNDS):
        gradients, grams = np.zeros(len(sizes)), np.zeros((len(sizes), len(sizes)))
        for pair in pairs:
            gradient, gram = _newton_terms(pair, sizes)
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
    return Fit(sizes, sum((_errors(pair, sizes) for pair in pairs), np.zeros(1)))


def error_with_sizes(pairs: Sequence[Pair], sizes: FloatArray) -> float:
    """Sum of squares with faults of these sizes undone."""
    return float(sum(_errors(pair, sizes).sum() for pair in pairs))


def _find_starting_sizes(variant: Variant) -> FloatArray:
    count = len(variant.undo)
    return np.ones(count) if variant.lower_bound > 0 else np.zeros(count)


def weights_of(products: FloatArray) -> FloatArray:
    """(width,): 1, then minus the least-squares weights of the other columns: rows times this vector are residuals."""
    gram, cross = products[1:, 1:], products[1:, 0]
    weights = np.linalg.solve(_add_ridge(gram), cross)
    return np.concatenate([[1.0], -weights])


def error_of_own_fit(gram: FloatArray) -> float:
    """Residual sum of squares with weights fitted to these products alone."""
    weights = weights_of(gram)
    return max(float(weights @ gram @ weights), 0.0)


def _joint_products(pair: Pair, sizes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Products with the fault (k, k), the matrix `Grams.spread`, and (width, width) those of all rows, fault undone."""
    undone_products, spread = pair.undone_sum, pair.undone.spread(_pad_sizes(pair, sizes))
    return undone_products, spread, np.asarray(spread @ undone_products @ spread.T + pair.unchanged_sum)


def _pad_sizes(pair: Pair, sizes: FloatArray) -> FloatArray:
    return sizes if len(sizes) else np.zeros(len(pair.undone.changed_columns))


def _newton_terms(pair: Pair, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Half the gradient and half the Gauss-Newton Hessian of the error by the sizes, with the base's weights eliminated
    (variable projection)."""
    undone_products, spread, joint = _joint_products(pair, sizes)
    weights = weights_of(joint)
    change = pair.undone.change(weights)
    slope = change @ undone_products @ (spread.T @ weights)
    cross = change @ undone_products @ spread.T[:, 1:]
    squares = change @ undone_products @ change.T
    return np.asarray(slope), np.asarray(squares - cross @ np.linalg.solve(_add_ridge(joint[1:, 1:]), cross.T))


def _add_ridge(gram: FloatArray) -> FloatArray:
    return np.asarray(gram + (RIDGE * float(np.trace(gram)) / len(gram) + 1e-300) * np.eye(len(gram)))


def _errors(pair: Pair, sizes: FloatArray) -> FloatArray:
    """(blocks with, then without): sums of squares, with weights fitted to all blocks with the fault undone."""
    _, spread, joint = _joint_products(pair, sizes)
    weights = weights_of(joint)
    extended_weights = spread.T @ weights
    blocks = pair.undone.blocks[list(pair.undone_blocks)]
    undone_errors = np.einsum("i,bij,j->b", extended_weights, blocks, extended_weights) / _growth(pair, spread)
    unchanged_errors = [float(weights @ products @ weights) for products in pair.unchanged]
    return np.asarray(np.maximum(np.concatenate([undone_errors, np.array(unchanged_errors)]), 0.0))


def _growth(pair: Pair, spread: FloatArray) -> float:
    """Factor by which undoing the fault raises the error of the blocks' own base, up to `may_grow`."""
    if pair.may_grow <= 1.0:
        return 1.0
    products = pair.undone_sum[: pair.undone.width, : pair.undone.width]
    growth = error_of_own_fit(spread @ pair.undone_sum @ spread.T) / max(error_of_own_fit(products), 1e-300)
    return float(np.clip(growth, 1.0, pair.may_grow))


def held_out_error(pairs: Sequence[Pair], sizes: FloatArray, left_out: Sequence[int]) -> float:
    """Sum of squares of blocks that were left out, with sizes and base weights of the others."""
    error = 0.0
    for pair in pairs:
        _, spread, joint = _joint_products(pair, sizes)
        extended_weights = spread.T @ weights_of(joint)
        error += max(float(extended_weights @ pair.undone.sum_blocks(left_out) @ extended_weights), 0.0)
    return error
