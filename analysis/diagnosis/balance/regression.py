"""Products of all laws' columns, block by block, from which any sum of laws is fitted and tested without new passes.

The base of each balance is mass, damping and stiffness along every measured motion, linear dynamics of a higher order
where there are any (`Beside`), and a constant. Errors are those of the force within the band. A fold's error is that of
numbers fitted to all other folds (Stone, J. R. Stat. Soc. B 36:111, 1974).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.balance.blocks import (
    RIDGE,
    Block,
    Prior,
    blocks_of,
    column_scale,
    errors_of,
    parts_of,
    solved,
    solved_without,
    total,
    with_prior,
)
from analysis.diagnosis.balance.law import Beside, Law
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Regression:
    """One axis's balance."""

    motions: tuple[Motion, ...]
    axis: int
    laws: tuple[Law, ...]
    beside: Beside
    base: int
    """Columns of mass, damping, stiffness, of laws beside them, and a constant, which come first."""
    matrices: int
    """Of mass, damping and stiffness alone."""
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
    prior: Prior = None
    """Of a given model's numbers."""
    mass: float | None = None
    """Of a given model; None = the weight of the own acceleration."""

    def chosen(self, laws: Sequence[int]) -> list[int]:
        """Columns of the base and of laws; one of the command, below zero, has none."""
        more = [k for law in laws if law >= 0 for k in range(self.places[law].start, self.places[law].stop)]
        return [*range(self.base), *more]

    def weights(self, columns: Sequence[int]) -> FloatArray:
        """(len(columns),): fitted to all blocks to fit, in the columns' own units."""
        return np.asarray(self._fitted(total(self.fit, columns)) / self.scale[list(columns)])

    def crossed(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each block's sum of squares with numbers fitted to the others."""
        own = parts_of(self.fit, columns)
        weights = self._fitted((own[0].sum(axis=0) - own[0], own[1].sum(axis=0) - own[1]))
        return errors_of(self.fit, own, weights)

    def held_out(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each test block's sum of squares."""
        return errors_of(self.test, parts_of(self.test, columns), self._fitted(total(self.fit, columns)))

    def _fitted(self, products: tuple[FloatArray, FloatArray]) -> FloatArray:
        """(..., c), of (..., c, c) and (..., c): least squares in which the axis has no mass and no damping below
        zero."""
        gram, pull = products = with_prior(products, self.prior)
        found = solved(products, RIDGE)
        places = list(self.positive)
        bound: Mask = np.zeros_like(found, dtype=np.bool_)
        for _ in range(len(places) - 1):
            below = found[..., places] < 0
            if not below.any():
                break
            bound[..., places] |= below
            for fixed in np.unique(bound.reshape(-1, bound.shape[-1]), axis=0):
                if fixed.any():
                    at = (bound == fixed).all(axis=-1)
                    found[at] = solved_without(gram[at], pull[at], fixed)
        return np.where(bound, 0.0, found)

    def remainder(self, columns: Sequence[int]) -> tuple[FloatArray, ...]:
        """Per motion, (kept samples,): the force that the columns do not explain."""
        found = self.weights(columns)
        return tuple(
            force - rows[:, list(columns)] @ found for force, rows in zip(self.force, self.columns, strict=True)
        )


def regression_of(
    motions: Sequence[Motion],
    axis: int,
    laws: Sequence[Law],
    turns: bool,
    beside: Beside | None = None,
    bases: Sequence[FloatArray] | None = None,
) -> Regression:
    """turns: see `Scales`. beside: None = the force drives the motion of its own number. bases: per motion (n, k), in
    place of mass, damping and stiffness. Laws whose columns are next to nothing, or not finite, are left out.
    """
    d = len(motions[0].channels)
    beside = beside or Beside(min(axis, d - 1))
    aims = [each.reduced(each.force[:, [axis]])[:, 0] for each in motions]
    linear = [_linear(each, turns, beside.laws) for each in motions] if bases is None else bases
    parts = [[_based(each, columns) for each, columns in zip(motions, linear, strict=True)]]
    kept, places, begin = [], [], parts[0][0].shape[1]
    base = begin
    for law in laws:
        columns = _columns(motions, law)
        if columns is not None:
            parts.append(columns)
            kept.append(law)
            places.append(slice(begin, begin + columns[0].shape[1]))
            begin = places[-1].stop
    rows = tuple(np.hstack([part[k] for part in parts]) for k in range(len(motions)))
    fit = [each.kept(each.fit) for each in motions]
    scale = column_scale(rows, fit)
    test = [each.kept(each.test) for each in motions]
    mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
    own = beside.own
    return Regression(
        tuple(motions), axis, tuple(kept), beside, base, (2 if turns else 3) * d if bases is None else base - 1,
        (own, d + own, own) if bases is None else (0,), tuple(places),
        scale, rows, tuple(aims),
        blocks_of(rows, aims, fit, (scale, mean)), blocks_of(rows, aims, test, (scale, mean)),
    )  # fmt: skip


def signal_power(blocks: Sequence[Block]) -> float:
    return sum(block.signal for block in blocks)


def _linear(motion: Motion, turns: bool, beside: Sequence[Law]) -> FloatArray:
    """turns: where a shaft goes round and round, no spring holds it."""
    more = [law.columns(motion, law.numbers) for law in beside]
    return np.hstack([motion.acceleration, motion.velocity, *([] if turns else [motion.position]), *more])


def _based(motion: Motion, linear: FloatArray) -> FloatArray:
    return np.hstack([motion.reduced(linear), np.ones((len(linear[:: motion.step]), 1))])


def _columns(motions: Sequence[Motion], law: Law) -> list[FloatArray] | None:
    """Per motion; None where they are next to nothing, or not finite."""
    columns = [motion.reduced(law.columns(motion, law.numbers)) for motion in motions]
    told = all(np.isfinite(each).all() for each in columns) and all(_seen(columns))
    return columns if told else None


def _seen(columns: Sequence[FloatArray]) -> Mask:
    size = np.sqrt(np.mean(np.vstack(columns) ** 2, axis=0))
    return np.asarray(size > 1e-12 * max(float(size.max(initial=0.0)), 1e-290))


def with_law(regression: Regression, number: int, law: Law) -> Regression | None:
    """With another law of as many columns in a law's place; None where its columns are next to nothing."""
    place = regression.places[number]
    columns = _columns(regression.motions, law)
    if columns is None or columns[0].shape[1] != place.stop - place.start:
        return None
    rows = tuple(
        np.hstack([old[:, : place.start], new, old[:, place.stop :]])
        for old, new in zip(regression.columns, columns, strict=True)
    )
    scale = regression.scale.copy()
    scale[place] = column_scale(columns, [each.kept(each.fit) for each in regression.motions])
    laws = (*regression.laws[:number], law, *regression.laws[number + 1 :])
    changed = replace(regression, laws=laws, columns=rows, scale=scale)
    return replace(
        changed,
        fit=tuple(_again(changed, block, place) for block in regression.fit),
        test=tuple(_again(changed, block, place) for block in regression.test),
    )


def with_laws(regression: Regression, laws: Sequence[Law]) -> Regression:
    """With more laws after those that it has, whose columns are kept."""
    kept, rows = [], [[each] for each in regression.columns]
    ends = [regression.columns[0].shape[1]]
    for law in laws:
        columns = _columns(regression.motions, law)
        if columns is not None:
            kept.append(law)
            ends.append(ends[-1] + columns[0].shape[1])
            for held, new in zip(rows, columns, strict=True):
                held.append(new)
    more = tuple(np.hstack(each) for each in rows)
    fit = [motion.kept(motion.fit) for motion in regression.motions]
    test = [motion.kept(motion.test) for motion in regression.motions]
    scale = np.concatenate([regression.scale, column_scale([each[:, ends[0] :] for each in more], fit)])
    mean = np.concatenate([aim[mask] for aim, mask in zip(regression.force, fit, strict=True)]).mean()
    units = scale, float(mean)
    return replace(
        regression,
        laws=(*regression.laws, *kept),
        places=(*regression.places, *(slice(begin, end) for begin, end in pairwise(ends))),
        scale=scale,
        columns=more,
        fit=blocks_of(more, regression.force, fit, units),
        test=blocks_of(more, regression.force, test, units),
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
