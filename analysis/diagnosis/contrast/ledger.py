"""What two sets of stretches have in common and what sets them apart, as products of columns.

Both are described by one base, fitted to both at once: so nothing hangs on how a base goes on where only one of them
has been. A fault is what the stretches of one set have and those of the other lack. Rows change by (size of the fault)
x (change of the rows by a size of 1): exactly where the fault is linear, and about a size of 1 elsewhere. Products of
the rows and their changes, block by block, then hold all that is needed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.contrast.fault import Variant
from equalizer.signals.signal import FloatArray

Places = npt.NDArray[np.intp]
RIDGE = 1e-9
"""Of a column's mean power."""
BLOWN_UP = 1e16
"""Of a product of columns of size 1."""
ROUNDS = 3
"""Of Gauss and Newton's steps."""


@dataclass(frozen=True, slots=True, eq=False)
class Grams:
    """(blocks, k, k): products of the columns, and of those that change with each size."""

    blocks: FloatArray
    moved: tuple[Places, ...]
    """Per size, which columns change."""
    width: int

    @property
    def sound(self) -> bool:
        """Undoing has not blown up what was measured."""
        return bool(np.isfinite(self.blocks).all() and np.abs(self.blocks).max(initial=0.0) < BLOWN_UP)

    def spread(self, sizes: FloatArray) -> FloatArray:
        """(width, k): what turns the products into those of the rows with sizes undone."""
        found = np.zeros((self.width, self.blocks.shape[1]))
        found[:, : self.width] = np.eye(self.width)
        begin = self.width
        for size, at in zip(sizes, self.moved, strict=True):
            found[at, begin + np.arange(len(at))] = size
            begin += len(at)
        return found

    def change(self, weights: FloatArray) -> FloatArray:
        """(sizes, k): the error's change with each size, as a sum of columns."""
        found = np.zeros((len(self.moved), self.blocks.shape[1]))
        begin = self.width
        for number, at in enumerate(self.moved):
            found[number, begin : begin + len(at)] = weights[at]
            begin += len(at)
        return found

    def undone(self, sizes: FloatArray) -> FloatArray:
        """(blocks, width, width): of the rows with sizes undone."""
        spread = self.spread(sizes)
        return np.asarray(spread @ self.blocks @ spread.T)

    def part(self, blocks: Sequence[int]) -> FloatArray:
        return np.asarray(self.blocks[list(blocks)].sum(axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Blocks of one stream: those that a fault is asked for, and those that do without it."""

    with_it: Grams
    at: tuple[int, ...]
    without: tuple[FloatArray, ...]
    """Products of plain rows (width, width), one per block."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    sizes: FloatArray
    errors: FloatArray
    """(blocks with, then without): white sums of squares, over all streams."""

    @property
    def error(self) -> float:
        return float(self.errors.sum())


def fitted(pairs: Sequence[Pair], variant: Variant | None) -> Fit:
    """The sizes that leave least, with every base fitted to both sides. variant: None = no fault."""
    sizes = np.zeros(0) if variant is None else _start(variant)
    for _ in range(0 if variant is None else ROUNDS):
        assert variant is not None
        pulls, grams = np.zeros(len(sizes)), np.zeros((len(sizes), len(sizes)))
        for pair in pairs:
            pull, gram = _step(pair, sizes)
            pulls += pull
            grams += gram
        grams += 1e-9 * max(float(np.trace(grams)) / len(grams), 1e-300) * np.eye(len(grams))
        moved = np.clip(sizes - np.linalg.solve(grams, pulls), variant.least, variant.most)
        if np.allclose(moved, sizes, rtol=1e-6, atol=1e-12):
            sizes = moved
            break
        sizes = moved
    return Fit(sizes, sum((_errors(pair, sizes) for pair in pairs), np.zeros(1)))


def left_with(pairs: Sequence[Pair], sizes: FloatArray) -> float:
    """What these sizes leave."""
    return float(sum(_errors(pair, sizes).sum() for pair in pairs))


def _start(variant: Variant) -> FloatArray:
    count = len(variant.undo)
    return np.ones(count) if variant.least > 0 else np.zeros(count)


def weights_of(plain: FloatArray) -> FloatArray:
    """(width,): 1, and minus what the columns tell of it."""
    gram, pull = plain[1:, 1:], plain[1:, 0]
    found = np.linalg.solve(_ridged(gram), pull)
    return np.concatenate([[1.0], -found])


def left_by_own(gram: FloatArray) -> float:
    """By weights that are fitted to these products alone."""
    weights = weights_of(gram)
    return max(float(weights @ gram @ weights), 0.0)


def _joined(pair: Pair, sizes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    whole, spread = pair.with_it.part(pair.at), pair.with_it.spread(_padded(pair, sizes))
    return whole, spread, np.asarray(spread @ whole @ spread.T + sum(pair.without))


def _padded(pair: Pair, sizes: FloatArray) -> FloatArray:
    return sizes if len(sizes) else np.zeros(len(pair.with_it.moved))


def _step(pair: Pair, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of the sizes alone, the base's own numbers fitted along: half the error's slope and curvature."""
    whole, spread, joined = _joined(pair, sizes)
    weights = weights_of(joined)
    change = pair.with_it.change(weights)
    slope = change @ whole @ (spread.T @ weights)
    cross = change @ whole @ spread.T[:, 1:]
    own = change @ whole @ change.T
    return np.asarray(slope), np.asarray(own - cross @ np.linalg.solve(_ridged(joined[1:, 1:]), cross.T))


def _ridged(gram: FloatArray) -> FloatArray:
    return np.asarray(gram + (RIDGE * float(np.trace(gram)) / len(gram) + 1e-300) * np.eye(len(gram)))


def _errors(pair: Pair, sizes: FloatArray) -> FloatArray:
    _, spread, joined = _joined(pair, sizes)
    weights = weights_of(joined)
    at = spread.T @ weights
    blocks = pair.with_it.blocks[list(pair.at)]
    with_it = np.einsum("i,bij,j->b", at, blocks, at)
    without = [float(weights @ plain @ weights) for plain in pair.without]
    return np.asarray(np.maximum(np.concatenate([with_it, np.array(without)]), 0.0))


def foretold(pairs: Sequence[Pair], sizes: FloatArray, block: int) -> float:
    """The error of a block that is not among those that a fault was asked for; sizes and bases are of the others."""
    found = 0.0
    for pair in pairs:
        _, spread, joined = _joined(pair, sizes)
        at = spread.T @ weights_of(joined)
        found += max(float(at @ pair.with_it.blocks[block] @ at), 0.0)
    return found
