"""Products of all laws' columns, block by block, from which any sum of laws is fitted and tested without new passes.

The base of each balance is mass, damping and stiffness along every measured motion and a constant. Errors are those of
the force within the band. A fold's error is that of numbers fitted to all other folds (Stone, J. R. Stat. Soc. B 36:111,
1974).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.balance.laws import Law
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

FOLDS = 8
"""Blocks of the samples to fit, and as many of those to test by, at least."""
MOST_SAMPLES = 20_000
"""That numbers are fitted to, and as many to test by: of each block, the first."""
_RIDGE = 1e-10
"""Of a column's own power, against columns that are the same."""
RIDGES = tuple(10.0**exponent for exponent in range(-8, 1))
"""Of the mean power of a column: shrinkages of the sum of all laws, of which folds choose."""


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
        return np.asarray(self._fitted(_total(self.fit, columns)) / self.scale[list(columns)])

    def crossed(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each block's sum of squares with numbers fitted to the others."""
        whole = _total(self.fit, columns)
        found = []
        for block in self.fit:
            own = _of(block, columns)
            rest = (whole[0] - own[0], whole[1] - own[1])
            found.append(_error(own, self._fitted(rest), block.power))
        return np.array(found)

    def held_out(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each test block's sum of squares."""
        found = self._fitted(_total(self.fit, columns))
        return np.array([_error(_of(block, columns), found, block.power) for block in self.test])

    def _fitted(self, products: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Least squares in which the axis has no mass and no damping below zero."""
        free = np.ones(len(products[1]), dtype=np.bool_)
        found = np.zeros(len(products[1]))
        for _ in self.positive:
            found[:] = 0.0
            found[free] = _solved((products[0][np.ix_(free, free)], products[1][free]), _RIDGE)
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
    scale = _scale(rows, fit)
    test = [one.kept(one.test) for one in motions]
    mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
    d, own = len(motions[0].channels), min(axis, len(motions[0].channels) - 1)
    return Regression(
        tuple(motions), axis, tuple(kept), base, (own, d + own, own), tuple(places), scale, rows, tuple(aims),
        _blocks(rows, aims, fit, (scale, mean)), _blocks(rows, aims, test, (scale, mean)),
    )  # fmt: skip


def signal_power(blocks: Sequence[Block]) -> float:
    return sum(block.signal for block in blocks)


def of_everything(regression: Regression, columns: Sequence[int]) -> tuple[float, FloatArray]:
    """All of these columns together, shrunk towards the base alone as much as folds ask for: its crossed error, and
    each test block's. What no sum of a few laws should be expected to beat: a ceiling."""
    free = np.array([k < regression.base for k in columns])
    whole = _total(regression.fit, columns)

    def crossed(ridge: float) -> float:
        total = 0.0
        for block in regression.fit:
            own = _of(block, columns)
            shrunk = _shrunk((whole[0] - own[0], whole[1] - own[1]), ridge, free)
            total += _error(own, shrunk, block.power)
        return total

    errors = [crossed(ridge) for ridge in RIDGES]
    best = int(np.argmin(errors))
    found = _shrunk(whole, RIDGES[best], free)
    return errors[best], np.array([_error(_of(block, columns), found, block.power) for block in regression.test])


def _base(motion: Motion, turns: bool) -> FloatArray:
    """turns: where a shaft goes round and round, no spring holds it."""
    linear = np.hstack([motion.acceleration, motion.velocity, *([] if turns else [motion.position])])
    return np.hstack([motion.reduced(linear), np.ones((len(linear[:: motion.step]), 1))])


def _seen(columns: Sequence[FloatArray]) -> Mask:
    size = np.sqrt(np.mean(np.vstack(columns) ** 2, axis=0))
    return np.asarray(size > 1e-12 * max(float(size.max(initial=0.0)), 1e-290))


def _scale(rows: Sequence[FloatArray], fit: Sequence[Mask]) -> FloatArray:
    size = np.sqrt(np.mean(np.vstack([r[mask] for r, mask in zip(rows, fit, strict=True)]) ** 2, axis=0))
    return np.where(size > 0, size, 1.0)


def _blocks(
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


def _of(block: Block, columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    at = list(columns)
    return block.gram[np.ix_(at, at)], block.pull[at]


def _total(blocks: Sequence[Block], columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    at = list(columns)
    gram = sum((block.gram[np.ix_(at, at)] for block in blocks), np.zeros((len(at), len(at))))
    pull = sum((block.pull[at] for block in blocks), np.zeros(len(at)))
    return np.asarray(gram), np.asarray(pull)


def _solved(products: tuple[FloatArray, FloatArray], ridge: float) -> FloatArray:
    gram, pull = products
    return np.asarray(np.linalg.solve(gram + np.diag(ridge * np.diagonal(gram) + 1e-300), pull))


def _shrunk(products: tuple[FloatArray, FloatArray], ridge: float, free: Mask) -> FloatArray:
    gram, pull = products
    size = float(np.trace(gram)) / len(gram)
    return np.asarray(np.linalg.solve(gram + np.diag(np.where(free, _RIDGE, ridge) * size), pull))


def _error(own: tuple[FloatArray, FloatArray], weights: FloatArray, power: float) -> float:
    gram, pull = own
    return max(power - 2 * float(weights @ pull) + float(weights @ gram @ weights), 0.0)


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
    scale[place] = _scale(columns, [one.kept(one.fit) for one in regression.motions])
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
