"""Products of all laws' columns, block by block, from which any sum of laws is fitted and tested without another pass
over the samples.

The base of each balance is mass, damping and stiffness along every measured motion, linear dynamics of a higher order
where there are any (`BaseTerms`), and a constant. Errors are those of the force within the band. A fold's error is that
of parameters fitted to all other folds (Stone, J. R. Stat. Soc. B 36:111, 1974).
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
    compute_squared_errors,
    products_per_block,
    solve_normal_equations,
    solve_ridge,
    solve_without_columns,
    sum_products,
    with_prior,
)
from analysis.diagnosis.balance.law import BaseTerms, Law
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

RIDGES = tuple(10.0**exponent for exponent in range(-8, 1))
"""Ridge parameters relative to the mean power of a column; cross-validation chooses among them."""


@dataclass(frozen=True, slots=True, eq=False)
class Regression:
    """The force balance of one axis as a linear regression: force = columns times weights."""

    motions: tuple[Motion, ...]
    axis: int
    laws: tuple[Law, ...]
    beside: BaseTerms
    base: int
    """Number of columns of the base, which come first: mass, damping, stiffness, further linear laws, and a
    constant."""
    matrices: int
    """Number of mass, damping and stiffness columns."""
    positive: tuple[int, ...]
    """Columns whose weights must not be negative. A single one is listed twice: the length also limits the active-set
    steps."""
    places: tuple[slice, ...]
    """Each law's columns."""
    scale: FloatArray
    """(k,): rms of each column, by which the columns are divided in the products."""
    columns: tuple[FloatArray, ...]
    """Per motion, (kept samples, k)"""
    force: tuple[FloatArray, ...]
    """Per motion, (kept samples,)"""
    fit: tuple[Block, ...]
    test: tuple[Block, ...]
    prior: Prior = None
    """Prior of a given model's free parameters."""
    mass: float | None = None
    """Mass of a given model in kg (kg m^2); None = the weight of the driven motion's acceleration."""

    def columns_of(self, laws: Sequence[int]) -> list[int]:
        """Column indices of the base and of these laws. A law of the command, numbered below zero, has none."""
        more = [k for law in laws if law >= 0 for k in range(self.places[law].start, self.places[law].stop)]
        return [*range(self.base), *more]

    def weights(self, columns: Sequence[int]) -> FloatArray:
        """(len(columns),): weights fitted to all fit blocks, in the columns' own units."""
        return np.asarray(self._solve_nonnegative(sum_products(self.fit, columns)) / self.scale[list(columns)])

    def cross_validated_errors(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each fit block's sum of squares with weights fitted to the other blocks (leave one block out)."""
        own = products_per_block(self.fit, columns)
        weights = self._solve_nonnegative((own[0].sum(axis=0) - own[0], own[1].sum(axis=0) - own[1]))
        return compute_squared_errors(self.fit, own, weights)

    def held_out_errors(self, columns: Sequence[int]) -> FloatArray:
        """(blocks,): each test block's sum of squares."""
        return compute_squared_errors(
            self.test,
            products_per_block(self.test, columns),
            self._solve_nonnegative(sum_products(self.fit, columns)),
        )

    def _solve_nonnegative(self, products: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Weights (..., c) from products (..., c, c) and (..., c): least squares with mass and damping of the driven
        motion held at zero where they would be negative (active set)."""
        gram, cross = products = with_prior(products, self.prior)
        found = solve_normal_equations(products, RIDGE)
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
                    found[at] = solve_without_columns(gram[at], cross[at], fixed)
        return np.where(bound, 0.0, found)

    def remainder(self, columns: Sequence[int]) -> tuple[FloatArray, ...]:
        """Per motion, (kept samples,): the residual force."""
        found = self.weights(columns)
        return tuple(
            force - rows[:, list(columns)] @ found for force, rows in zip(self.force, self.columns, strict=True)
        )


def regression_of(
    motions: Sequence[Motion],
    axis: int,
    laws: Sequence[Law],
    turns: bool,
    beside: BaseTerms | None = None,
    bases: Sequence[FloatArray] | None = None,
) -> Regression:
    """The regression of the force of one axis on mass, damping, stiffness and laws. turns: see `Scales`. beside: None =
    the force drives the motion of its own number. bases: per motion (n, k), in place of mass, damping and stiffness.
    Laws whose columns vanish or are not finite are left out."""
    d = len(motions[0].channels)
    beside = beside or BaseTerms(min(axis, d - 1))
    aims = [each.decimate(each.force[:, [axis]])[:, 0] for each in motions]
    linear = [_linear_columns(each, turns, beside.laws) for each in motions] if bases is None else bases
    parts = [[_base_columns(each, columns) for each, columns in zip(motions, linear, strict=True)]]
    kept, places, begin = [], [], parts[0][0].shape[1]
    base = begin
    for law in laws:
        columns = _law_columns(motions, law)
        if columns is not None:
            parts.append(columns)
            kept.append(law)
            places.append(slice(begin, begin + columns[0].shape[1]))
            begin = places[-1].stop
    rows = tuple(np.hstack([part[k] for part in parts]) for k in range(len(motions)))
    fit = [each.valid_samples(each.fit) for each in motions]
    scale = column_scale(rows, fit)
    test = [each.valid_samples(each.test) for each in motions]
    mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
    own = beside.own
    return Regression(
        tuple(motions), axis, tuple(kept), beside, base, (2 if turns else 3) * d if bases is None else base - 1,
        (own, d + own, own) if bases is None else (0,), tuple(places),
        scale, rows, tuple(aims),
        blocks_of(rows, aims, fit, (scale, mean)), blocks_of(rows, aims, test, (scale, mean)),
    )  # fmt: skip


def signal_power(blocks: Sequence[Block]) -> float:
    """Sum of squares of the force about its mean, over the blocks."""
    return sum(block.signal for block in blocks)


def _linear_columns(motion: Motion, turns: bool, beside: Sequence[Law]) -> FloatArray:
    """(n, k): acceleration, velocity, position and linear laws. turns: a freely rotating shaft has no spring."""
    more = [law.columns(motion, law.numbers) for law in beside]
    return np.hstack([motion.acceleration, motion.velocity, *([] if turns else [motion.position]), *more])


def _base_columns(motion: Motion, linear: FloatArray) -> FloatArray:
    return np.hstack([motion.decimate(linear), np.ones((len(linear[:: motion.step]), 1))])


def _law_columns(motions: Sequence[Motion], law: Law) -> list[FloatArray] | None:
    """A law's columns per motion; None where they vanish or are not finite."""
    columns = [motion.decimate(law.columns(motion, law.numbers)) for motion in motions]
    usable = all(np.isfinite(each).all() for each in columns) and all(_has_size(columns))
    return columns if usable else None


def _has_size(columns: Sequence[FloatArray]) -> Mask:
    size = np.sqrt(np.mean(np.vstack(columns) ** 2, axis=0))
    return np.asarray(size > 1e-12 * max(float(size.max(initial=0.0)), 1e-290))


def replace_law(regression: Regression, number: int, law: Law) -> Regression | None:
    """The regression with a law replaced by another with as many columns; None where its columns vanish."""
    place = regression.places[number]
    columns = _law_columns(regression.motions, law)
    if columns is None or columns[0].shape[1] != place.stop - place.start:
        return None
    rows = tuple(
        np.hstack([old[:, : place.start], new, old[:, place.stop :]])
        for old, new in zip(regression.columns, columns, strict=True)
    )
    scale = regression.scale.copy()
    scale[place] = column_scale(columns, [each.valid_samples(each.fit) for each in regression.motions])
    laws = (*regression.laws[:number], law, *regression.laws[number + 1 :])
    changed = replace(regression, laws=laws, columns=rows, scale=scale)
    return replace(
        changed,
        fit=tuple(_renew_products(changed, block, place) for block in regression.fit),
        test=tuple(_renew_products(changed, block, place) for block in regression.test),
    )


def append_laws(regression: Regression, laws: Sequence[Law]) -> Regression:
    """The regression with more laws after those that it has."""
    kept, rows = [], [[each] for each in regression.columns]
    ends = [regression.columns[0].shape[1]]
    for law in laws:
        columns = _law_columns(regression.motions, law)
        if columns is not None:
            kept.append(law)
            ends.append(ends[-1] + columns[0].shape[1])
            for held, new in zip(rows, columns, strict=True):
                held.append(new)
    more = tuple(np.hstack(each) for each in rows)
    fit = [motion.valid_samples(motion.fit) for motion in regression.motions]
    test = [motion.valid_samples(motion.test) for motion in regression.motions]
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


def keep_laws(regression: Regression, laws: Sequence[int]) -> Regression:
    """The regression with these laws alone, in this order."""
    columns = regression.columns_of(laws)
    sizes = [regression.places[k].stop - regression.places[k].start for k in laws]
    ends = np.cumsum([regression.base, *sizes]).tolist()
    return replace(
        regression,
        laws=tuple(regression.laws[k] for k in laws),
        places=tuple(slice(begin, end) for begin, end in pairwise(ends)),
        scale=regression.scale[columns],
        columns=tuple(each[:, columns] for each in regression.columns),
        fit=tuple(_select_columns(block, columns) for block in regression.fit),
        test=tuple(_select_columns(block, columns) for block in regression.test),
    )


def _select_columns(block: Block, columns: Sequence[int]) -> Block:
    return replace(block, gram=block.gram[np.ix_(columns, columns)], cross=block.cross[list(columns)])


def _renew_products(regression: Regression, block: Block, place: slice) -> Block:
    """The block with the products of the columns in `place` recomputed."""
    x = regression.columns[block.motion][block.rows] / regression.scale
    gram, cross = block.gram.copy(), block.cross.copy()
    gram[:, place] = x.T @ x[:, place]
    gram[place, :] = gram[:, place].T
    cross[place] = x[:, place].T @ regression.force[block.motion][block.rows]
    return replace(block, gram=gram, cross=cross)


def fit_all_laws(regression: Regression, columns: Sequence[int]) -> tuple[float, FloatArray]:
    """Sum of squares with all these columns, the laws' weights shrunk by the ridge that cross-validation chooses: the
    cross-validated one, and that of each test block (blocks,). A lower bound for sums of a few laws."""
    free = np.array([k < regression.base for k in columns])
    own = products_per_block(regression.fit, columns)
    whole = own[0].sum(axis=0), own[1].sum(axis=0)
    rest = with_prior((whole[0] - own[0], whole[1] - own[1]), regression.prior)
    whole = with_prior(whole, regression.prior)
    errors = [
        float(compute_squared_errors(regression.fit, own, solve_ridge(rest, ridge, free)).sum()) for ridge in RIDGES
    ]
    best = int(np.argmin(errors))
    found = solve_ridge(whole, RIDGES[best], free)
    return errors[best], compute_squared_errors(regression.test, products_per_block(regression.test, columns), found)
