"""Linear regression of the force of one axis, f = X w + e, on a base and on the columns of candidate laws (`law.py`).

The products X'X and X'f of all columns are computed once per block of samples (`blocks.py`). From them any sum of laws
is fitted and tested without another pass over the samples.

The base is mass, damping and stiffness along every measured motion and linear dynamics of a higher order where there
are any (`BaseTerms`), or given columns, and a constant. Errors are sums of squares of the residual force within the
band. In cross-validation, the error of a block is that of weights fitted to all other blocks (Stone, J. R. Stat. Soc. B
36:111, 1974). Begin at `build_regression`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.blocks import (
    RIDGE,
    Block,
    Prior,
    add_prior,
    build_blocks,
    compute_scale,
    compute_squared_errors,
    merge_blocks,
    solve_normal_equations,
    solve_ridge,
    solve_without_columns,
    stack_products,
    sum_products,
)
from analysis.diagnosis.balance.laws.law import BaseTerms, Law
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.limits import BALANCE_FOLDS
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

RIDGE_PARAMETERS = tuple(10.0**exponent for exponent in range(-8, 1))
"""Ridge parameters relative to the mean power of a column; cross-validation selects one. Chosen by hand."""

MOST_RIDGE_FOLDS = 4 * BALANCE_FOLDS
"""Largest number of folds of a fit of all laws, each of which takes a solution per ridge parameter: a recording of
hundreds of short parts has as many blocks. Chosen."""
NUMBERS_AT_ONCE = 100_000
"""Size of the Gram matrices of the selections of columns that are cross-validated together (or those of one selection),
to limit the memory. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Regression:
    """The force balance of one axis as a linear regression: force = columns times weights."""

    motions: tuple[Motion, ...]
    axis: int
    """Index of the force's channel."""
    laws: tuple[Law, ...]
    base_terms: BaseTerms
    """Terms of the base in addition to mass, damping and stiffness."""
    base_column_count: int
    """Number of leading columns, the base: mass, damping, stiffness, further linear laws, and a constant."""
    matrix_column_count: int
    """Number of mass, damping and stiffness columns, or of columns of a given model."""
    nonnegative_columns: tuple[int, ...]
    """Columns whose weights must not be negative: mass and damping of the driven motion; none of a given model, whose
    prior bounds the weights."""
    column_ranges: tuple[slice, ...]
    """Range of columns of each law, by its index in `laws`."""
    scale: FloatArray
    """(k,): rms of each column, by which the columns are divided in the products."""
    columns: tuple[FloatArray, ...]
    """Per motion, (kept samples, k): X, filtered to the band, decimated, in the columns' own units."""
    force: tuple[FloatArray, ...]
    """Per motion, (kept samples,): force in N (N m), filtered and decimated likewise."""
    fit: tuple[Block, ...]
    """Blocks of the samples to fit, with the products of the scaled columns."""
    test: tuple[Block, ...]
    """Blocks of the held-out samples."""
    prior: Prior = None
    """Gaussian prior of a given model's free parameters; None without such a model."""
    mass: float | None = None
    """Mass of a given model in kg (kg m^2); None = it is estimated, as the weight of the driven acceleration."""

    def select_columns(self, law_indices: Sequence[int]) -> list[int]:
        """Select the columns (indices) of the base and of these laws; a law of the command (index < 0) has none."""
        law_columns = [
            k for i in law_indices if i >= 0 for k in range(self.column_ranges[i].start, self.column_ranges[i].stop)
        ]
        return [*range(self.base_column_count), *law_columns]

    def select_one_body_columns(self, law_indices: Sequence[int]) -> list[int]:
        """Select as `select_columns`, without the modes and relaxations of the base."""
        return [
            k
            for k in self.select_columns(law_indices)
            if not self.matrix_column_count <= k < self.base_column_count - 1
        ]

    def fit_weights(self, columns: Sequence[int]) -> FloatArray:
        """Fit weights (len(columns),) to all fit blocks, in the columns' own units."""
        return np.asarray(self._solve_nonnegative(sum_products(self.fit, columns)) / self.scale[list(columns)])

    def cross_validate(self, columns: Sequence[int]) -> FloatArray:
        """Compute (blocks,): residual sum of squares of each fit block, with weights fitted to the other blocks
        (leave-one-block-out cross-validation)."""
        return self.cross_validate_each([columns])[0]

    def cross_validate_each(self, selections: Sequence[Sequence[int]]) -> list[FloatArray]:
        """Cross-validate several selections of columns; selections of equal length are computed together."""
        errors: list[FloatArray] = [np.empty(0)] * len(selections)
        for size in {len(columns) for columns in selections}:
            indices = [index for index, columns in enumerate(selections) if len(columns) == size]
            stride = max(NUMBERS_AT_ONCE // max(len(self.fit) * size**2, 1), 1)
            for first in range(0, len(indices), stride):
                chosen = indices[first : first + stride]
                stacked = [stack_products(self.fit, selections[index]) for index in chosen]
                grams, crosses = np.stack([gram for gram, _ in stacked]), np.stack([cross for _, cross in stacked])
                training = grams.sum(axis=1, keepdims=True) - grams, crosses.sum(axis=1, keepdims=True) - crosses
                squares = compute_squared_errors(self.fit, (grams, crosses), self._solve_nonnegative(training))
                for index, block_errors in zip(chosen, squares, strict=True):
                    errors[index] = block_errors
        return errors

    def compute_test_errors(self, columns: Sequence[int]) -> FloatArray:
        """Compute (blocks,): residual sum of squares of each test block, with weights fitted to all fit blocks."""
        return compute_squared_errors(
            self.test,
            stack_products(self.test, columns),
            self._solve_nonnegative(sum_products(self.fit, columns)),
        )

    def fit_weight_by_motion(self, columns: Sequence[int], column: int) -> tuple[FloatArray, FloatArray]:
        """Fit one of these columns with a weight for each motion, and the others with common weights. Returns the
        weights (motions,) in the column's own unit, and the residual sum of squares of each test block (blocks,)."""
        common_columns = [k for k in columns if k != column]
        size = len(common_columns) + len(self.motions)

        def separate_products(blocks: Sequence[Block]) -> tuple[FloatArray, FloatArray]:
            """Stack the products as `stack_products`, with the column at the place of its motion: (blocks, size, size)
            and (blocks, size)."""
            gram, cross = np.zeros((len(blocks), size, size)), np.zeros((len(blocks), size))
            products = zip(*stack_products(blocks, [*common_columns, column]), strict=True)
            for block_index, (block, (block_gram, block_cross)) in enumerate(zip(blocks, products, strict=True)):
                places = [*range(len(common_columns)), len(common_columns) + block.motion_index]
                gram[block_index][np.ix_(places, places)], cross[block_index, places] = block_gram, block_cross
            return gram, cross

        gram, cross = separate_products(self.fit)
        weights = solve_normal_equations(add_prior((gram.sum(axis=0), cross.sum(axis=0)), self.prior), RIDGE)
        errors = compute_squared_errors(self.test, separate_products(self.test), weights)
        return weights[len(common_columns) :] / self.scale[column], errors

    def _solve_nonnegative(self, products: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Solve for weights (..., c) from products (..., c, c) and (..., c): least squares in which mass and damping of
        the driven motion are fixed at zero where they would be negative (active-set method). A fixed weight is not
        freed again."""
        gram, cross = products = add_prior(products, self.prior)
        weights = solve_normal_equations(products, RIDGE)
        nonnegative = list(self.nonnegative_columns)
        is_fixed: Mask = np.zeros_like(weights, dtype=np.bool_)
        for _ in nonnegative:
            is_negative = weights[..., nonnegative] < 0
            if not is_negative.any():
                break
            is_fixed[..., nonnegative] |= is_negative
            for fixed_columns in np.unique(is_fixed.reshape(-1, is_fixed.shape[-1]), axis=0):
                if fixed_columns.any():
                    matches = (is_fixed == fixed_columns).all(axis=-1)
                    weights[matches] = solve_without_columns(gram[matches], cross[matches], fixed_columns)
        return np.where(is_fixed, 0.0, weights)

    def compute_residuals(self, columns: Sequence[int]) -> tuple[FloatArray, ...]:
        """Compute, per motion, (kept samples,): the residual force f - X w, with weights fitted to all fit blocks."""
        weights = self.fit_weights(columns)
        return tuple(
            force - rows[:, list(columns)] @ weights for force, rows in zip(self.force, self.columns, strict=True)
        )


def build_regression(
    motions: Sequence[Motion],
    axis: int,
    laws: Sequence[Law],
    turns_freely: bool,
    base_terms: BaseTerms | None = None,
    bases: Sequence[FloatArray] | None = None,
) -> Regression:
    """Build the regression of one axis's force on mass, damping, stiffness and laws. turns_freely: whether the axis has
    no stiffness (`Scales.turns_freely`). base_terms: further terms of the base; None = none, and the force drives the
    motion channel of the same index, or the last. bases: columns (n, k) per motion that replace all of the base but the
    constant. Laws whose columns vanish or are not finite are left out."""
    channel_count = len(motions[0].channels)
    base_terms = base_terms or BaseTerms(min(axis, channel_count - 1))
    forces = [motion.decimate(motion.force[:, [axis]])[:, 0] for motion in motions]
    linear = (
        [_make_linear_columns(motion, turns_freely, base_terms.laws) for motion in motions] if bases is None else bases
    )
    column_parts = [[_make_base_columns(motion, columns) for motion, columns in zip(motions, linear, strict=True)]]
    kept_laws, column_ranges, next_column = [], [], column_parts[0][0].shape[1]
    base_column_count = next_column
    for law in laws:
        columns = make_law_columns(motions, law)
        if columns is not None:
            column_parts.append(columns)
            kept_laws.append(law)
            column_ranges.append(slice(next_column, next_column + columns[0].shape[1]))
            next_column = column_ranges[-1].stop
    rows = tuple(np.hstack([part[motion_index] for part in column_parts]) for motion_index in range(len(motions)))
    fit_masks = [motion.mask_valid_samples(motion.fit) for motion in motions]
    scale = compute_scale(rows, fit_masks)
    test_masks = [motion.mask_valid_samples(motion.test) for motion in motions]
    mean = float(np.concatenate([target[mask] for target, mask in zip(forces, fit_masks, strict=True)]).mean())
    driven = base_terms.driven_channel
    return Regression(
        tuple(motions), axis, tuple(kept_laws), base_terms, base_column_count,
        (2 if turns_freely else 3) * channel_count if bases is None else base_column_count - 1,
        (driven, channel_count + driven) if bases is None else (), tuple(column_ranges),
        scale, rows, tuple(forces),
        build_blocks(rows, forces, fit_masks, (scale, mean)), build_blocks(rows, forces, test_masks, (scale, mean)),
    )  # fmt: skip


def compute_signal_power(blocks: Sequence[Block]) -> float:
    """Sum the squares of the force about its mean over the blocks."""
    return sum(block.centred_power for block in blocks)


def _make_linear_columns(motion: Motion, turns_freely: bool, linear_laws: Sequence[Law]) -> FloatArray:
    """Make (n, k): columns of acceleration, velocity, position and linear laws; no position where a shaft turns freely,
    because it has no stiffness."""
    law_columns = [law.make_columns(motion, law.numbers) for law in linear_laws]
    return np.hstack([motion.acceleration, motion.velocity, *([] if turns_freely else [motion.position]), *law_columns])


def _make_base_columns(motion: Motion, linear: FloatArray) -> FloatArray:
    """Make (kept samples, k + 1): filtered and decimated base columns, then the constant."""
    return np.hstack([motion.decimate(linear), np.ones((len(linear[:: motion.step]), 1))])


def make_law_columns(motions: Sequence[Motion], law: Law) -> list[FloatArray] | None:
    """Make a law's filtered and decimated columns (kept samples, k) per motion; None where any is zero or not
    finite."""
    columns = _decimate_each(motions, [law.make_columns(motion, law.numbers) for motion in motions])
    is_usable = all(np.isfinite(column).all() for column in columns) and all(_is_above_rounding(columns))
    return columns if is_usable else None


def _decimate_each(motions: Sequence[Motion], columns: Sequence[FloatArray]) -> list[FloatArray]:
    """Filter and decimate columns (n, k) per motion, with one k (`Motion.decimate`); all parts of one length at once,
    because a filter of many short parts one by one takes most of its time to begin."""
    decimated = list(columns)
    for length in {len(column) for column in columns}:
        indices = [index for index, column in enumerate(columns) if len(column) == length]
        together = motions[indices[0]].decimate(np.hstack([columns[index] for index in indices]))
        for index, part in zip(indices, np.split(together, len(indices), axis=1), strict=True):
            decimated[index] = np.ascontiguousarray(part)
    return decimated


def _is_above_rounding(columns: Sequence[FloatArray]) -> Mask:
    """(k,): whether each column's rms is above rounding errors of the law's largest column."""
    rms = np.sqrt(np.mean(np.vstack(columns) ** 2, axis=0))
    return np.asarray(rms > 1e-12 * max(float(rms.max(initial=0.0)), 1e-290))


def fit_all_laws(regression: Regression, columns: Sequence[int]) -> tuple[float, FloatArray]:
    """Fit all these columns by ridge regression: the cross-validated sum of squares, over at most `MOST_RIDGE_FOLDS`
    folds of consecutive blocks, and that of each test block (blocks,). The ridge parameter is the one of
    `RIDGE_PARAMETERS` with the least cross-validated error; it does not act on the base."""
    is_base = np.array([k < regression.base_column_count for k in columns])
    fold_count = min(len(regression.fit), MOST_RIDGE_FOLDS)
    folds = [
        merge_blocks(regression.fit[indices[0] : indices[-1] + 1], columns)
        for indices in np.array_split(np.arange(len(regression.fit)), fold_count)
    ]
    products = stack_products(folds, range(len(columns)))
    total_products = products[0].sum(axis=0), products[1].sum(axis=0)
    training = add_prior((total_products[0] - products[0], total_products[1] - products[1]), regression.prior)
    total_products = add_prior(total_products, regression.prior)
    errors = [
        float(compute_squared_errors(folds, products, solve_ridge(training, ridge, is_base)).sum())
        for ridge in RIDGE_PARAMETERS
    ]
    best = int(np.argmin(errors))
    weights = solve_ridge(total_products, RIDGE_PARAMETERS[best], is_base)
    return errors[best], compute_squared_errors(regression.test, stack_products(regression.test, columns), weights)
