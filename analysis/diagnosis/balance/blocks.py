"""Normal equations of linear least squares, X'X w = X'y, block by block of consecutive samples.

X (samples, k) holds the columns of a force balance, such as acceleration, velocity and position; y is the force. A
block keeps the Gram matrix X'X and the cross products X'y only. Sums of these over blocks give the fit to any subset of
blocks and columns without the samples, which makes cross-validation fast. The residual sum of squares of weights w is
y'y - 2 w'X'y + w'X'X w.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.settings import BALANCE_FOLDS, BALANCE_MOST_SAMPLES
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

RIDGE = 1e-10
"""Ridge, relative to the mean diagonal element of X'X. It keeps the equations solvable where two columns of a block are
equal, or a column holds rounding errors alone."""


Prior = tuple[FloatArray, FloatArray] | None
"""Gaussian prior of the first k weights: precision (k,), and precision times mean (k,). None = no prior."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Products of a block of consecutive samples: of its columns with each other and with the force."""

    gram: FloatArray
    """(k, k): X'X of the columns X."""
    cross: FloatArray
    """(k,): X'y, the cross products of the columns with the force y."""
    power: float
    """Sum of squares of the force."""
    signal: float
    """Sum of squares of the force about its mean over all fitted samples."""
    motion: int
    """Index of the motion to which the block belongs."""
    rows: npt.NDArray[np.intp]
    """Indices of the block's samples among the kept samples of its motion."""


def column_scale(rows: Sequence[FloatArray], fit: Sequence[Mask]) -> FloatArray:
    """(k,): root mean square of each column over the masked samples of all motions; 1 where that is 0."""
    size = np.sqrt(np.mean(np.vstack([r[mask] for r, mask in zip(rows, fit, strict=True)]) ** 2, axis=0))
    return np.where(size > 0, size, 1.0)


def blocks_of(
    rows: Sequence[FloatArray], forces: Sequence[FloatArray], masks: Sequence[Mask], units: tuple[FloatArray, float]
) -> tuple[Block, ...]:
    """Blocks of the masked samples, about twice `BALANCE_FOLDS` in all, from columns divided by their scales. units:
    scales (k,), and the mean about which `Block.signal` is taken. Of more than `BALANCE_MOST_SAMPLES` samples, only the
    first part of each block is used."""
    scale, mean = units
    total = sum(int(mask.sum()) for mask in masks)
    blocks = []
    share = min(1.0, BALANCE_MOST_SAMPLES / max(total, 1))
    for number, (columns, force, mask) in enumerate(zip(rows, forces, masks, strict=True)):
        indices = np.flatnonzero(mask)
        count = int(np.clip(round(2 * BALANCE_FOLDS * len(indices) / max(total, 1)), 1, len(indices) or 1))
        for block_indices in np.array_split(indices, count) if len(indices) else []:
            part = block_indices[: max(int(share * len(block_indices)), 1)]
            x, y = columns[part] / scale, force[part]
            blocks.append(Block(x.T @ x, x.T @ y, float(y @ y), float(np.sum((y - mean) ** 2)), number, part))
    return tuple(blocks)


def block_products(block: Block, columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Gram matrix (k, k) and cross products (k,) of k chosen columns of a block."""
    indices = list(columns)
    return block.gram[np.ix_(indices, indices)], block.cross[indices]


def products_per_block(blocks: Sequence[Block], columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """(blocks, c, c) and (blocks, c): each block's Gram matrix and cross products of c columns."""
    indices = np.asarray(columns, dtype=np.intp)
    grid = indices[:, None], indices[None, :]
    grams = np.array([block.gram[grid] for block in blocks]).reshape(-1, len(indices), len(indices))
    return grams, np.array([block.cross[indices] for block in blocks]).reshape(-1, len(indices))


def sum_products(blocks: Sequence[Block], columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Gram matrix (k, k) and cross products (k,) of k chosen columns, summed over the blocks."""
    grams, crosses = products_per_block(blocks, columns)
    return np.asarray(grams.sum(axis=0)), np.asarray(crosses.sum(axis=0))


def solve_normal_equations(products: tuple[FloatArray, FloatArray], ridge: float) -> FloatArray:
    """Weights (..., c) of stacked systems with Gram matrices (..., c, c) and cross products (..., c). ridge: added to
    the diagonal, relative to its mean. Raises LinAlgError where a system is singular nevertheless."""
    gram, cross = products
    count = gram.shape[-1]
    size = np.trace(gram, axis1=-2, axis2=-1)[..., None, None] / count
    return np.asarray(np.linalg.solve(gram + (ridge * size + 1e-300) * np.eye(count), cross[..., None])[..., 0])


def solve_without_columns(gram: FloatArray, cross: FloatArray, fixed: Mask) -> FloatArray:
    """Weights (..., c), with those of the `fixed` (c,) columns held at zero; see `solve_normal_equations`."""
    free = np.flatnonzero(~fixed)
    weights = np.zeros_like(cross)
    weights[..., free] = solve_normal_equations((gram[..., free[:, None], free], cross[..., free]), RIDGE)
    return weights


def solve_ridge(products: tuple[FloatArray, FloatArray], ridge: float, free: Mask) -> FloatArray:
    """Weights (..., c) by ridge regression. ridge: relative to the mean diagonal element, on the columns that are not
    `free` (c,); these have `RIDGE`."""
    gram, cross = products
    size = np.trace(gram, axis1=-2, axis2=-1)[..., None, None] / gram.shape[-1]
    return np.asarray(np.linalg.solve(gram + np.diag(np.where(free, RIDGE, ridge)) * size, cross[..., None])[..., 0])


def with_prior(products: tuple[FloatArray, FloatArray], prior: Prior) -> tuple[FloatArray, FloatArray]:
    """The normal equations with the prior added: its precision to the first diagonal elements of X'X, its precision
    times mean to the first elements of X'y. products: (..., c, c) and (..., c)."""
    if prior is None:
        return products
    gram, cross = products[0].copy(), products[1].copy()
    first = np.arange(len(prior[0]))
    gram[..., first, first] += prior[0]
    cross[..., first] += prior[1]
    return gram, cross


def compute_squared_error(products: tuple[FloatArray, FloatArray], weights: FloatArray, power: float) -> float:
    """Residual sum of squares of given weights (c,), at least 0. products: Gram matrix (c, c) and cross products (c,).
    power: sum of squares of the fitted force."""
    gram, cross = products
    return max(power - 2 * float(weights @ cross) + float(weights @ gram @ weights), 0.0)


def compute_squared_errors(
    blocks: Sequence[Block], products: tuple[FloatArray, FloatArray], weights: FloatArray
) -> FloatArray:
    """(blocks,): residual sums of squares. products: `products_per_block` of these blocks. weights: (c,) or
    (blocks, c)."""
    weights = np.broadcast_to(weights, products[1].shape)
    power = np.array([block.power for block in blocks])
    squares = ((products[0] @ weights[..., None])[..., 0] * weights).sum(axis=-1)
    return np.asarray(np.maximum(power - 2 * (products[1] * weights).sum(axis=-1) + squares, 0.0))
