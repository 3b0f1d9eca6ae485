"""Blocks of samples by their products, which are all that least squares needs of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

FOLDS = 8
"""Blocks of the samples to fit, and as many of those to test by, at least."""
MOST_SAMPLES = 20_000
"""That numbers are fitted to, and as many to test by: of each block, the first."""
RIDGE = 1e-10
"""Of the mean power of a column, against columns that are the same or are nothing but rounding in some blocks."""


Prior = tuple[FloatArray, FloatArray] | None
"""What is known of the first columns' weights: its precision and its pull (k,), as products would hold them."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A stretch of samples: products of columns with themselves and with the force."""

    gram: FloatArray
    """(k, k)"""
    pull: FloatArray
    """(k,)"""
    power: float
    """Sum of squares of the force,"""
    signal: float
    """and of what it differs by from its mean over all that is fitted."""
    motion: int
    rows: npt.NDArray[np.intp]
    """Of the motion's kept samples."""


def column_scale(rows: Sequence[FloatArray], fit: Sequence[Mask]) -> FloatArray:
    size = np.sqrt(np.mean(np.vstack([r[mask] for r, mask in zip(rows, fit, strict=True)]) ** 2, axis=0))
    return np.where(size > 0, size, 1.0)


def blocks_of(
    rows: Sequence[FloatArray], aims: Sequence[FloatArray], masks: Sequence[Mask], units: tuple[FloatArray, float]
) -> tuple[Block, ...]:
    scale, mean = units
    total = sum(int(mask.sum()) for mask in masks)
    found = []
    share = min(1.0, MOST_SAMPLES / max(total, 1))
    for number, (columns, aim, mask) in enumerate(zip(rows, aims, masks, strict=True)):
        places = np.flatnonzero(mask)
        count = int(np.clip(round(2 * FOLDS * len(places) / max(total, 1)), 1, len(places) or 1))
        for whole in np.array_split(places, count) if len(places) else []:
            part = whole[: max(int(share * len(whole)), 1)]
            x, y = columns[part] / scale, aim[part]
            found.append(Block(x.T @ x, x.T @ y, float(y @ y), float(np.sum((y - mean) ** 2)), number, part))
    return tuple(found)


def part_of_block(block: Block, columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    at = list(columns)
    return block.gram[np.ix_(at, at)], block.pull[at]


def parts_of(blocks: Sequence[Block], columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """(blocks, c, c) and (blocks, c): of some columns."""
    at = np.asarray(columns, dtype=np.intp)
    grid = at[:, None], at[None, :]
    grams = np.array([block.gram[grid] for block in blocks]).reshape(-1, len(at), len(at))
    return grams, np.array([block.pull[at] for block in blocks]).reshape(-1, len(at))


def total(blocks: Sequence[Block], columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    grams, pulls = parts_of(blocks, columns)
    return np.asarray(grams.sum(axis=0)), np.asarray(pulls.sum(axis=0))


def solved(products: tuple[FloatArray, FloatArray], ridge: float) -> FloatArray:
    """(..., c), of (..., c, c) and (..., c): each of many systems by itself."""
    gram, pull = products
    count = gram.shape[-1]
    size = np.trace(gram, axis1=-2, axis2=-1)[..., None, None] / count
    return np.asarray(np.linalg.solve(gram + (ridge * size + 1e-300) * np.eye(count), pull[..., None])[..., 0])


def solved_without(gram: FloatArray, pull: FloatArray, fixed: Mask) -> FloatArray:
    """As `solved`, with fixed columns of no weight."""
    free = np.flatnonzero(~fixed)
    found = np.zeros_like(pull)
    found[..., free] = solved((gram[..., free[:, None], free], pull[..., free]), RIDGE)
    return found


def shrunk(products: tuple[FloatArray, FloatArray], ridge: float, free: Mask) -> FloatArray:
    """As `solved`, with columns that are not free shrunk."""
    gram, pull = products
    size = np.trace(gram, axis1=-2, axis2=-1)[..., None, None] / gram.shape[-1]
    return np.asarray(np.linalg.solve(gram + np.diag(np.where(free, RIDGE, ridge)) * size, pull[..., None])[..., 0])


def with_prior(products: tuple[FloatArray, FloatArray], prior: Prior) -> tuple[FloatArray, FloatArray]:
    """As if so much had been seen of the first columns' weights. products: (..., c, c) and (..., c)."""
    if prior is None:
        return products
    gram, pull = products[0].copy(), products[1].copy()
    first = np.arange(len(prior[0]))
    gram[..., first, first] += prior[0]
    pull[..., first] += prior[1]
    return gram, pull


def error_of(own: tuple[FloatArray, FloatArray], weights: FloatArray, power: float) -> float:
    gram, pull = own
    return max(power - 2 * float(weights @ pull) + float(weights @ gram @ weights), 0.0)


def errors_of(blocks: Sequence[Block], own: tuple[FloatArray, FloatArray], weights: FloatArray) -> FloatArray:
    """(blocks,): sums of squares. own: `parts_of` these blocks. weights: (c,), or (blocks, c) for each its own."""
    weights = np.broadcast_to(weights, own[1].shape)
    power = np.array([block.power for block in blocks])
    squares = ((own[0] @ weights[..., None])[..., 0] * weights).sum(axis=-1)
    return np.asarray(np.maximum(power - 2 * (own[1] * weights).sum(axis=-1) + squares, 0.0))
