"""Screening of candidate terms of a missing law, by cross-validated linear regression of a fit's filtered residual r.

The columns X are a base (the model's own parameters, a constant, terms that were selected before) and one more term.
The weights w minimise

    |r - X w|² + (w - w0)' D (w - w0)        low <= w <= high

with the calibration's values w0 of the model's parameters, the prior precision D, and the bounds of re-tuning. The
error of a block is that of weights fitted to all other blocks (Stone, J. R. Stat. Soc. B 36:111, 1974). Only the
products X'X (Gram matrix) and X'r are needed, which are computed once per block, for all terms at once.

Sizes: s samples of the residual (`matched_filter.View`), k base columns. Called by `discover`, `beam`, `fit_sum` and
`antisymmetric_pairs`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.limits import RETUNING_BOUND
from equalizer.signals.signal import FloatArray

_LEAST_INDEPENDENT_SHARE = 1e-6
"""Least share of a term's power that must be linearly independent of the base columns; below it rounding dominates.
Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class NormalEquations:
    """Normal equations of the k base columns, for each block of the samples."""

    view: View
    selected: tuple[FloatArray, ...]
    """(s,) each: columns of terms that were selected before; they come after the model's parameters and the
    constant."""
    gram: FloatArray
    """(blocks, k, k): X'X"""
    residual_products: FloatArray
    """(blocks, k): X'r"""
    residual_power: FloatArray
    """(blocks,): sum of squares of the residual."""

    @property
    def blocks(self) -> list[slice]:
        """Samples of each block, as slices of (s,)."""
        edges = self.view.edges
        return [slice(start, stop) for start, stop in pairwise(edges)]

    @property
    def prior_precision(self) -> FloatArray:
        """(k,): diagonal of D: 1 for the model's parameters, whose weights are in standard deviations of the
        calibration; 1e-10 of a column's sum of squares for the constant and further terms, which only keeps the matrix
        regular."""
        column_powers = self.gram.sum(axis=0).diagonal()
        precision = np.where(column_powers > 0, 1e-10 * column_powers, 1.0)
        precision[: len(self.view.to_calibration) - 1] = 1.0
        return precision

    @property
    def prior_right_side(self) -> FloatArray:
        """(k,): D w0, the prior's contribution to the right side of the normal equations."""
        prior_mean = np.zeros(len(self.prior_precision))
        prior_mean[: len(self.view.to_calibration)] = self.view.to_calibration
        return self.prior_precision * prior_mean

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) each: lower and upper bounds of the weights: those of re-tuning for the model's parameters, else
        infinite. If mass, damping and stiffness could vanish, a force that cancels the command would explain the whole
        residual."""
        calibration, k = self.view.to_calibration, len(self.prior_precision)
        tuned_count = len(calibration) - 1
        low, high = np.full(k, -np.inf), np.full(k, np.inf)
        low[:tuned_count], high[:tuned_count] = (
            calibration[:tuned_count] - RETUNING_BOUND,
            calibration[:tuned_count] + RETUNING_BOUND,
        )
        return low, high

    def multiply_columns(self, columns: FloatArray) -> FloatArray:
        """Compute (blocks, k, terms): inner products of the base columns with those of terms. columns: (terms, s)"""
        products_by_block = []
        for block in self.blocks:
            term_columns = columns[:, block].T
            product_rows = [
                self.view.parameter_columns[:, block] @ term_columns,
                *((column[None, block] @ term_columns) for column in self.selected),
            ]
            products_by_block.append(np.vstack(product_rows))
        return np.array(products_by_block)


def build_normal_equations(view: View) -> NormalEquations:
    """Build the normal equations of a view without further terms: the columns are the model's parameters and a
    constant."""
    base, edges = view.parameter_columns, list(pairwise(view.edges))
    return NormalEquations(
        view,
        (),
        np.array([base[:, start:stop] @ base[:, start:stop].T for start, stop in edges]),
        np.array([base[:, start:stop] @ view.residual[start:stop] for start, stop in edges]),
        np.array([view.residual[start:stop] @ view.residual[start:stop] for start, stop in edges]),
    )


def add_columns(base: NormalEquations, columns: Sequence[FloatArray]) -> NormalEquations:
    """Append the columns of further terms to the base's normal equations. columns: (s,) each"""
    if not len(columns):
        return base
    added_columns, view = np.array(columns), base.view
    cross_products = base.multiply_columns(added_columns).transpose(0, 2, 1)
    added_gram = np.array([added_columns[:, block] @ added_columns[:, block].T for block in base.blocks])
    added_residual_products = np.array([added_columns[:, block] @ view.residual[block] for block in base.blocks])
    gram = np.concatenate(
        [
            np.concatenate([base.gram, cross_products.transpose(0, 2, 1)], axis=2),
            np.concatenate([cross_products, added_gram], axis=2),
        ],
        axis=1,
    )
    return NormalEquations(
        view,
        (*base.selected, *columns),
        gram,
        np.hstack([base.residual_products, added_residual_products]),
        base.residual_power,
    )


@dataclass(frozen=True, slots=True, eq=False)
class TermErrors:
    """Cross-validated sums of squared errors of the base alone and with each single term added, per block."""

    base_squares: FloatArray
    """(blocks,): held-out sum of squares of the base alone."""
    term_squares: FloatArray
    """(blocks, terms): held-out sum of squares with each term."""
    factors: FloatArray
    """(blocks, terms): each term's factor, fitted to the other blocks."""


def cross_validate_terms(base: NormalEquations, columns: FloatArray) -> TermErrors:
    """Cross-validate each term, added to the base by itself: each block is held out once. columns: (terms, s)"""
    blocks = base.blocks
    cross_products = base.multiply_columns(columns)
    term_powers = np.array([np.einsum("ks,ks->k", columns[:, block], columns[:, block]) for block in blocks])
    residual_products = np.array([columns[:, block] @ base.view.residual[block] for block in blocks])
    base_squares, term_squares, factors = [], [], []
    for index in range(len(blocks)):
        gram = base.gram.sum(axis=0) - base.gram[index] + np.diag(base.prior_precision)
        right_side = base.residual_products.sum(axis=0) - base.residual_products[index] + base.prior_right_side
        base_products, powers = (
            cross_products.sum(axis=0) - cross_products[index],
            term_powers.sum(axis=0) - term_powers[index],
        )
        bordered = _border_gram(gram, base_products, powers)
        right_sides = np.column_stack(
            [np.tile(right_side, (len(powers), 1)), residual_products.sum(axis=0) - residual_products[index]]
        )
        low, high = (np.append(bound, limit) for bound, limit in zip(base.bounds, (-np.inf, np.inf), strict=True))
        solutions = solve_bounded_least_squares(bordered, right_sides, low, high)
        weights, factor = solutions[:, :-1].T, solutions[:, -1]
        base_weights = solve_bounded_least_squares(gram[None], right_side[None], *base.bounds)[0]
        base_squares.append(_compute_held_out_squares(base, index, base_weights[:, None])[0])
        term_squares.append(
            _compute_held_out_squares(base, index, weights)
            - 2 * factor * residual_products[index]
            + 2 * factor * np.einsum("kt,kt->t", weights, cross_products[index])
            + factor**2 * term_powers[index]
        )
        factors.append(factor)
    return TermErrors(np.array(base_squares), np.array(term_squares), np.array(factors))


def _border_gram(gram: FloatArray, base_products: FloatArray, term_powers: FloatArray) -> FloatArray:
    """Build (terms, k + 1, k + 1): Gram matrix of the base (k, k), bordered by each term. A term that is linearly
    dependent on the base gets an infinite diagonal entry, and so the weight 0. base_products: (k, terms), inner
    products with the base; term_powers: (terms,), sums of squares."""
    independent_powers = term_powers - np.einsum("kt,kt->t", base_products, np.linalg.solve(gram, base_products))
    k = len(gram)
    bordered = np.zeros((len(term_powers), k + 1, k + 1))
    bordered[:, :k, :k] = gram
    bordered[:, :k, k] = bordered[:, k, :k] = base_products.T
    bordered[:, k, k] = np.where(independent_powers > _LEAST_INDEPENDENT_SHARE * term_powers, term_powers, np.inf)
    return bordered


def solve_bounded_least_squares(
    gram: FloatArray, right_sides: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Solve (systems, k): least squares within bounds by an active set, from Gram matrices (systems, k, k) and right
    sides (systems, k): weights that exceed their bounds are fixed at them, and the others solved for again. A weight
    with an infinite diagonal entry is 0."""
    is_excluded = np.isinf(np.einsum("tkk->tk", gram))
    is_fixed, fixed_values = is_excluded.copy(), np.zeros_like(right_sides)
    for _ in range(right_sides.shape[1]):
        system = np.where(is_fixed[:, :, None], np.eye(right_sides.shape[1]), gram)
        weights = np.linalg.solve(system, np.where(is_fixed, fixed_values, right_sides)[:, :, None])[:, :, 0]
        is_outside = ((weights < low) | (weights > high)) & ~is_fixed
        if not is_outside.any():
            break
        fixed_values = np.where(is_outside, np.clip(weights, low, high), fixed_values)
        is_fixed |= is_outside
    return np.asarray(weights)


def _compute_held_out_squares(base: NormalEquations, index: int, weights: FloatArray) -> FloatArray:
    """Compute (terms,): |r|² - 2 w'X'r + w'X'X w of the block `index`, for each column w of the weights (k, terms)."""
    return np.asarray(
        base.residual_power[index]
        - 2 * base.residual_products[index] @ weights
        + np.einsum("kt,kt->t", weights, base.gram[index] @ weights)
    )


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Weights of the base columns, fitted to all blocks together, and their cost."""

    weights: FloatArray
    """(k,): those of the model's parameters in standard deviations of the calibration."""
    cost: float
    """Residual sum of squares plus the prior's penalty."""


def solve_all_blocks(base: NormalEquations) -> Solution:
    """Fit the weights of the base columns to all blocks together."""
    prior_precision, gram, residual_products = (
        base.prior_precision,
        base.gram.sum(axis=0),
        base.residual_products.sum(axis=0),
    )
    weights = solve_bounded_least_squares(
        (gram + np.diag(prior_precision))[None], (residual_products + base.prior_right_side)[None], *base.bounds
    )[0]
    deviations = weights[: len(base.view.to_calibration)] - base.view.to_calibration
    residual_squares = float(base.residual_power.sum() - 2 * residual_products @ weights + weights @ gram @ weights)
    return Solution(weights, residual_squares + float(prior_precision[: len(deviations)] @ deviations**2))
