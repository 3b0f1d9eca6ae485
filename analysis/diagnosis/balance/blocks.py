"""Normal equations of linear least squares, X'X w = X'y, block by block of consecutive samples.

X (samples, k) holds the columns of a force balance, such as acceleration, velocity and position; y is the force (in
`inverse_balance`, the predicted motion, whose columns include the command). A block keeps the Gram matrix X'X, the
cross products X'y and y'y in place of its samples. Sums of these over blocks give the fit to any subset of blocks and
columns without the samples, which makes cross-validation fast. Weights w leave the residual sum of squares y'y - 2
w'X'y + w'X'X w.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.limits import BALANCE_FOLDS, BALANCE_MOST_SAMPLES
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

RIDGE = 1e-10
"""Ridge, relative to the mean diagonal element of X'X. It keeps the equations solvable where two columns of a block are
equal, or a column holds rounding errors alone. Chosen by hand."""


Prior = tuple[FloatArray, FloatArray] | None
"""Gaussian prior of the first k weights: precision (k,), and precision times mean (k,). None = no prior."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Products of a block of consecutive samples: of its columns with each other and with the force."""

    gram: FloatArray
    """(k, k): X'X."""
    cross: FloatArray
    """(k,): X'y."""
    power: float
    """y'y."""
    centred_power: float
    """Sum of squares of the force about its mean over all fitted samples."""
    motion_index: int
    """Index of the motion to which the block belongs."""
    rows: npt.NDArray[np.intp]
    """Indices of the block's samples among the kept samples of its motion."""


def compute_scale(columns: Sequence[FloatArray], masks: Sequence[Mask]) -> FloatArray:
    """Compute (k,): root mean square of each column over the masked samples of all motions; 1 where that is 0. columns,
    masks: (n, k) and (n,) per motion."""
    rms = np.sqrt(
        np.mean(
            np.vstack([motion_columns[mask] for motion_columns, mask in zip(columns, masks, strict=True)]) ** 2, axis=0
        )
    )
    return np.where(rms > 0, rms, 1.0)


def build_blocks(
    columns: Sequence[FloatArray],
    forces: Sequence[FloatArray],
    masks: Sequence[Mask],
    scale_and_mean: tuple[FloatArray, float],
) -> tuple[Block, ...]:
    """Build about 2 `BALANCE_FOLDS` blocks of the masked samples, from columns divided by their scales; at least one
    block per motion with such samples. columns, forces, masks: (n, k), (n,) and (n,) per motion. scale_and_mean: scales
    (k,), and the mean force for `Block.centred_power`. Of more than `BALANCE_MOST_SAMPLES` samples, only the first part
    of each block is used."""
    scale, mean_force = scale_and_mean
    total_samples = sum(int(mask.sum()) for mask in masks)
    blocks = []
    used_share = min(1.0, BALANCE_MOST_SAMPLES / max(total_samples, 1))
    for motion_index, (motion_columns, force, mask) in enumerate(zip(columns, forces, masks, strict=True)):
        indices = np.flatnonzero(mask)
        block_count = int(
            np.clip(round(2 * BALANCE_FOLDS * len(indices) / max(total_samples, 1)), 1, len(indices) or 1)
        )
        for block_indices in np.array_split(indices, block_count) if len(indices) else []:
            used_indices = block_indices[: max(int(used_share * len(block_indices)), 1)]
            x, y = motion_columns[used_indices] / scale, force[used_indices]
            blocks.append(
                Block(x.T @ x, x.T @ y, float(y @ y), float(np.sum((y - mean_force) ** 2)), motion_index, used_indices)
            )
    return tuple(blocks)


def select_products(block: Block, columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Select the Gram matrix (k, k) and cross products (k,) of k columns of a block."""
    indices = list(columns)
    return block.gram[np.ix_(indices, indices)], block.cross[indices]


def stack_products(blocks: Sequence[Block], columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Stack each block's Gram matrix and cross products of k columns: (blocks, k, k) and (blocks, k)."""
    indices = np.asarray(columns, dtype=np.intp)
    grid = indices[:, None], indices[None, :]
    grams = np.array([block.gram[grid] for block in blocks]).reshape(-1, len(indices), len(indices))
    return grams, np.array([block.cross[indices] for block in blocks]).reshape(-1, len(indices))


def sum_products(blocks: Sequence[Block], columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Sum the Gram matrices (k, k) and cross products (k,) of k columns over the blocks."""
    grams, crosses = stack_products(blocks, columns)
    return np.asarray(grams.sum(axis=0)), np.asarray(crosses.sum(axis=0))


def merge_blocks(blocks: Sequence[Block], columns: Sequence[int]) -> Block:
    """Merge blocks, at least one, to one with these columns alone; its samples are those of the first."""
    gram, cross = sum_products(blocks, columns)
    power, centred_power = (sum(block.power for block in blocks), sum(block.centred_power for block in blocks))
    return Block(gram, cross, power, centred_power, blocks[0].motion_index, blocks[0].rows)


def solve_normal_equations(products: tuple[FloatArray, FloatArray], ridge: float) -> FloatArray:
    """Solve for weights (..., c) of stacked systems with Gram matrices (..., c, c) and cross products (..., c). ridge:
    added to the diagonal, relative to its mean, with 1e-300 for a matrix of zeros. Raises LinAlgError where a system is
    singular nevertheless."""
    gram, cross = products
    column_count = gram.shape[-1]
    mean_diagonal = np.trace(gram, axis1=-2, axis2=-1)[..., None, None] / column_count
    return np.asarray(
        np.linalg.solve(gram + (ridge * mean_diagonal + 1e-300) * np.eye(column_count), cross[..., None])[..., 0]
    )


def solve_without_columns(gram: FloatArray, cross: FloatArray, is_excluded: Mask) -> FloatArray:
    """Solve for weights (..., c), zero for the columns in `is_excluded` (c,); otherwise as `solve_normal_equations`."""
    free_columns = np.flatnonzero(~is_excluded)
    weights = np.zeros_like(cross)
    weights[..., free_columns] = solve_normal_equations(
        (gram[..., free_columns[:, None], free_columns], cross[..., free_columns]), RIDGE
    )
    return weights


def solve_ridge(products: tuple[FloatArray, FloatArray], ridge: float, is_unpenalised: Mask) -> FloatArray:
    """Solve for weights (..., c) by ridge regression (Hoerl and Kennard, Technometrics 12:55, 1970). products: Gram
    matrices (..., c, c) and cross products (..., c). ridge: relative to the mean diagonal element; columns that are
    unpenalised (c,) have `RIDGE` instead. Raises LinAlgError where a system is singular nevertheless."""
    gram, cross = products
    mean_diagonal = np.trace(gram, axis1=-2, axis2=-1)[..., None, None] / gram.shape[-1]
    return np.asarray(
        np.linalg.solve(gram + np.diag(np.where(is_unpenalised, RIDGE, ridge)) * mean_diagonal, cross[..., None])[
            ..., 0
        ]
    )


def add_prior(products: tuple[FloatArray, FloatArray], prior: Prior) -> tuple[FloatArray, FloatArray]:
    """Add the prior to the normal equations: its precision to the first diagonal elements of X'X, its precision
    times mean to the first elements of X'y. products: (..., c, c) and (..., c)."""
    if prior is None:
        return products
    gram, cross = products[0].copy(), products[1].copy()
    prior_columns = np.arange(len(prior[0]))
    gram[..., prior_columns, prior_columns] += prior[0]
    cross[..., prior_columns] += prior[1]
    return gram, cross


def compute_squared_error(products: tuple[FloatArray, FloatArray], weights: FloatArray, power: float) -> float:
    """Compute the residual sum of squares of given weights (c,), at least 0. products: Gram matrix (c, c) and cross
    products (c,). power: sum of squares of the fitted force."""
    gram, cross = products
    return max(power - 2 * float(weights @ cross) + float(weights @ gram @ weights), 0.0)


def compute_squared_errors(
    blocks: Sequence[Block], products: tuple[FloatArray, FloatArray], weights: FloatArray
) -> FloatArray:
    """Compute (..., blocks): residual sums of squares. products: `stack_products` of these blocks, (..., blocks, c, c)
    and (..., blocks, c). weights: (c,) or (..., blocks, c)."""
    weights = np.broadcast_to(weights, products[1].shape)
    power = np.array([block.power for block in blocks])
    squares = ((products[0] @ weights[..., None])[..., 0] * weights).sum(axis=-1)
    return np.asarray(np.maximum(power - 2 * (products[1] * weights).sum(axis=-1) + squares, 0.0))
