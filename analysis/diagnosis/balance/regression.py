"""Products of all laws' columns, block by block, from which any sum of laws is fitted and tested without new passes.

The base of each balance is mass, damping and stiffness along every measured motion and a constant. Errors are those
of the force within the band. A fold's error is that of numbers fitted to all other folds (Stone, J. R. Stat. Soc. B
36:111, 1974).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.balance.blocks import (
    RIDGE,
    Block,
    blocks_of,
    column_scale,
    error_of,
    part_of_block,
    shrunk,
    solved,
    total,
)
from analysis.diagnosis.balance.law import Law
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

RIDGES = tuple(10.0**exponent for exponent in range(-8, 1))
"""Of the mean power of a column: shrinkages of the sum of all laws, of which folds choose."""


@dataclass(frozen=True, slots=True, eq=False)
class Regression:
    """One axis's balance."""

    motions: tuple[Motion, ...]
    axis: int
    laws: tuple[Law, ...]
    base: int
    """Columns of mass, damping, stiffness and constant, which come first."""
    positive: tuple[int, ...]
    """Columns among them whose weights may not be below zero, and once more: so often a fit is solved at most."""
    places: tuple[slice, ...]
    """Of each law's columns."""
    scale: FloatArray
    """(k,): rms of each column, which the products are without."""
    columns: tuple[FloatArray, ...]
    """Per motion, (kept samples, k)"""
    force: tuple[FloatArray, ...]
    """Per motion, (kept samples,)"""
    fit: tuple[Block, ...]
    test: tuple[Block, ...]

    def chosen(self, laws: Sequence[int]) -> list[int]:
        """Columns of the base and of laws."""
        more = [k for law in laws for k in range(self.places[law].start, self.places[law].stop)]
        return [*range(self.base), *more]

    def weights(self, columns: Sequence[int]) -> FloatArray:
        """(len(columns),): fitted to all blocks to fit, in the columns' own units."""
        return np.asarray(self._fitted(total(self.fit, columns)) / self.scale[list(columns)])

    def crossed(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each block's sum of squares with numbers fitted to the others."""
        whole = total(self.fit, columns)
        found = []
        for block in self.fit:
            own = part_of_block(block, columns)
            rest = (whole[0] - own[0], whole[1] - own[1])
            found.append(error_of(own, self._fitted(rest), block.power))
        return np.array(found)

    def held_out(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each test block's sum of squares."""
        found = self._fitted(total(self.fit, columns))
        return np.array([error_of(part_of_block(block, columns), found, block.power) for block in self.test])

    def _fitted(self, products: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Least squares in which the axis has no mass and no damping below zero."""
        free = np.ones(len(products[1]), dtype=np.bool_)
        found = np.zeros(len(products[1]))
        for _ in self.positive:
            found[:] = 0.0
            found[free] = solved((products[0][np.ix_(free, free)], products[1][free]), RIDGE)
            below = [place for place in self.positive if found[place] < 0]
            if not below:
                break
            free[below] = False
            found[below] = 0.0
        return found

    def remainder(self, columns: Sequence[int]) -> tuple[FloatArray, ...]:
        """Per motion, (kept samples,): the force that the columns do not explain."""
        found = self.weights(columns)
        return tuple(
            force - rows[:, list(columns)] @ found for force, rows in zip(self.force, self.columns, strict=True)
        )


def regression_of(motions: Sequence[Motion], axis: int, laws: Sequence[Law], turns: bool) -> Regression:
    """turns: see `Scales`. Laws whose columns are next to nothing, or not finite, are left out."""
    aims = [one.reduced(one.force[:, [axis]])[:, 0] for one in motions]
    parts = [[_base(one, turns) for one in motions]]
    kept, places, begin = [], [], parts[0][0].shape[1]
    base = begin
    for law in laws:
        columns = [one.reduced(law.columns(one, law.numbers)) for one in motions]
        if all(np.isfinite(each).all() for each in columns) and all(_seen(columns)):
            parts.append(columns)
            kept.append(law)
            places.append(slice(begin, begin + columns[0].shape[1]))
            begin = places[-1].stop
    rows = tuple(np.hstack([part[k] for part in parts]) for k in range(len(motions)))
    fit = [one.kept(one.fit) for one in motions]
    scale = column_scale(rows, fit)
    test = [one.kept(one.test) for one in motions]
    mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
    d, own = len(motions[0].channels), min(axis, len(motions[0].channels) - 1)
    return Regression(
        tuple(motions), axis, tuple(kept), base, (own, d + own, own), tuple(places), scale, rows, tuple(aims),
        blocks_of(rows, aims, fit, (scale, mean)), blocks_of(rows, aims, test, (scale, mean)),
    )  # fmt: skip


def signal_power(blocks: Sequence[Block]) -> float:
    return sum(block.signal for block in blocks)


def of_everything(regression: Regression, columns: Sequence[int]) -> tuple[float, FloatArray]:
    """All of these columns together, shrunk towards the base alone as much as folds ask for: its crossed error, and
    each test block's. What no sum of a few laws should be expected to beat: a ceiling."""
    free = np.array([k < regression.base for k in columns])
    whole = total(regression.fit, columns)

    def crossed(ridge: float) -> float:
        squares = 0.0
        for block in regression.fit:
            own = part_of_block(block, columns)
            weights = shrunk((whole[0] - own[0], whole[1] - own[1]), ridge, free)
            squares += error_of(own, weights, block.power)
        return squares

    errors = [crossed(ridge) for ridge in RIDGES]
    best = int(np.argmin(errors))
    found = shrunk(whole, RIDGES[best], free)
    return errors[best], np.array(
        [error_of(part_of_block(block, columns), found, block.power) for block in regression.test]
    )


def _base(motion: Motion, turns: bool) -> FloatArray:
    """turns: where a shaft goes round and round, no spring holds it."""
    linear = np.hstack([motion.acceleration, motion.velocity, *([] if turns else [motion.position])])
    return np.hstack([motion.reduced(linear), np.ones((len(linear[:: motion.step]), 1))])


def _seen(columns: Sequence[FloatArray]) -> Mask:
    size = np.sqrt(np.mean(np.vstack(columns) ** 2, axis=0))
    return np.asarray(size > 1e-12 * max(float(size.max(initial=0.0)), 1e-290))


def with_law(regression: Regression, number: int, law: Law) -> Regression | None:
    """With another law of as many columns in a law's place; None where its columns are next to nothing."""
    place = regression.places[number]
    columns = [one.reduced(law.columns(one, law.numbers)) for one in regression.motions]
    if columns[0].shape[1] != place.stop - place.start or not all(np.isfinite(each).all() for each in columns):
        return None
    if not all(_seen(columns)):
        return None
    rows = tuple(
        np.hstack([old[:, : place.start], new, old[:, place.stop :]])
        for old, new in zip(regression.columns, columns, strict=True)
    )
    scale = regression.scale.copy()
    scale[place] = column_scale(columns, [one.kept(one.fit) for one in regression.motions])
    laws = (*regression.laws[:number], law, *regression.laws[number + 1 :])
    changed = replace(regression, laws=laws, columns=rows, scale=scale)
    return replace(
        changed,
        fit=tuple(_again(changed, block, place) for block in regression.fit),
        test=tuple(_again(changed, block, place) for block in regression.test),
    )


def of_laws(regression: Regression, laws: Sequence[int]) -> Regression:
    """With these laws alone, in this order."""
    columns = regression.chosen(laws)
    sizes = [regression.places[k].stop - regression.places[k].start for k in laws]
    ends = np.cumsum([regression.base, *sizes]).tolist()
    return replace(
        regression,
        laws=tuple(regression.laws[k] for k in laws),
        places=tuple(slice(begin, end) for begin, end in pairwise(ends)),
        scale=regression.scale[columns],
        columns=tuple(each[:, columns] for each in regression.columns),
        fit=tuple(_part(block, columns) for block in regression.fit),
        test=tuple(_part(block, columns) for block in regression.test),
    )


def _part(block: Block, columns: Sequence[int]) -> Block:
    return replace(block, gram=block.gram[np.ix_(columns, columns)], pull=block.pull[list(columns)])


def _again(regression: Regression, block: Block, place: slice) -> Block:
    """With the products of some columns computed anew."""
    x = regression.columns[block.motion][block.rows] / regression.scale
    gram, pull = block.gram.copy(), block.pull.copy()
    gram[:, place] = x.T @ x[:, place]
    gram[place, :] = gram[:, place].T
    pull[place] = x[:, place].T @ regression.force[block.motion][block.rows]
    return replace(block, gram=gram, pull=pull)
