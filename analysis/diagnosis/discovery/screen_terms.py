"""Screening of candidate terms by cross-validation of linear regressions of a fit's filtered residual r (`View`).

The columns X are a base (the model's own parameters, a constant, terms that were selected before) and one more term.
The weights w minimise

    |r - X w|² + (w - w0)' D (w - w0)        low <= w <= high

with the calibration's values w0 of the model's parameters, the prior precision D, and the bounds of re-tuning. The
error of a block is that of weights fitted to all other blocks (Stone, J. R. Stat. Soc. B 36:111, 1974). Only the
products X'X and X'r are needed, which are computed once per block, for all terms at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.settings import RETUNING_BOUND
from equalizer.signals.signal import FloatArray

_DEPENDENT = 1e-6
"""Least share of a term's power that must be linearly independent of the base columns; below it rounding dominates."""


@dataclass(frozen=True, slots=True, eq=False)
class Products:
    """Normal equations of the k base columns, per block."""

    view: View
    selected: tuple[FloatArray, ...]
    """(s,) each: columns of terms selected before; they follow the model's parameters and the constant."""
    squares: FloatArray
    """(blocks, k, k): X'X"""
    with_residual: FloatArray
    """(blocks, k): X'r"""
    power: FloatArray
    """(blocks,): sum of squares of the residual."""

    @property
    def blocks(self) -> list[slice]:
        """Samples of each block, as slices of (s,)."""
        edges = self.view.edges
        return [slice(a, b) for a, b in pairwise(edges)]

    @property
    def calibration(self) -> FloatArray:
        """(k,): diagonal of D: 1 for the model's parameters, whose weights are in standard deviations of the
        calibration; almost none for the constant and further terms, for numerical stability."""
        sizes = self.squares.sum(axis=0).diagonal()
        precision = np.where(sizes > 0, 1e-10 * sizes, 1.0)
        precision[: len(self.view.to_calibration) - 1] = 1.0
        return precision

    @property
    def prior_right_side(self) -> FloatArray:
        """(k,): D w0, the prior's contribution to the right side of the normal equations."""
        offset = np.zeros(len(self.calibration))
        offset[: len(self.view.to_calibration)] = self.view.to_calibration
        return self.calibration * offset

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """(k,) each: bounds of the weights; the model's parameters have those of re-tuning. If mass, damping and
        stiffness could vanish, a force that cancels the command would explain the whole residual."""
        offsets, k = self.view.to_calibration, len(self.calibration)
        tuned = len(offsets) - 1
        low, high = np.full(k, -np.inf), np.full(k, np.inf)
        low[:tuned], high[:tuned] = offsets[:tuned] - RETUNING_BOUND, offsets[:tuned] + RETUNING_BOUND
        return low, high

    def cross(self, columns: FloatArray) -> FloatArray:
        """(blocks, k, terms): inner products of the base columns with those of terms. columns: (terms, s)"""
        products = []
        for part in self.blocks:
            term_columns = columns[:, part].T
            rows = [
                self.view.parameter_columns[:, part] @ term_columns,
                *((column[None, part] @ term_columns) for column in self.selected),
            ]
            products.append(np.vstack(rows))
        return np.array(products)


def products_of(view: View) -> Products:
    """The base of a view without further terms: the model's parameters and a constant."""
    base, edges = view.parameter_columns, list(pairwise(view.edges))
    return Products(
        view,
        (),
        np.array([base[:, a:b] @ base[:, a:b].T for a, b in edges]),
        np.array([base[:, a:b] @ view.residual[a:b] for a, b in edges]),
        np.array([view.residual[a:b] @ view.residual[a:b] for a, b in edges]),
    )


def add_columns(base: Products, columns: Sequence[FloatArray]) -> Products:
    """The base with the columns of further terms appended. columns: (s,) each"""
    if not len(columns):
        return base
    added, view = np.array(columns), base.view
    cross = base.cross(added).transpose(0, 2, 1)
    added_squares = np.array([added[:, part] @ added[:, part].T for part in base.blocks])
    added_with_residual = np.array([added[:, part] @ view.residual[part] for part in base.blocks])
    squares = np.concatenate(
        [
            np.concatenate([base.squares, cross.transpose(0, 2, 1)], axis=2),
            np.concatenate([cross, added_squares], axis=2),
        ],
        axis=1,
    )
    return Products(
        view, (*base.selected, *columns), squares, np.hstack([base.with_residual, added_with_residual]), base.power
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


def cross_validate_terms(base: Products, columns: FloatArray) -> TermErrors:
    """Held-out sums of squares with each term added to the base by itself, each block left out once. columns: (terms,
    s)"""
    parts = base.blocks
    cross = base.cross(columns)
    term_powers = np.array([np.einsum("ks,ks->k", columns[:, part], columns[:, part]) for part in parts])
    term_with_residual = np.array([columns[:, part] @ base.view.residual[part] for part in parts])
    base_squares, term_squares, factors = [], [], []
    for number in range(len(parts)):
        squares = base.squares.sum(axis=0) - base.squares[number] + np.diag(base.calibration)
        right_side = base.with_residual.sum(axis=0) - base.with_residual[number] + base.prior_right_side
        base_products, size = cross.sum(axis=0) - cross[number], term_powers.sum(axis=0) - term_powers[number]
        bordered = _border(squares, base_products, size)
        right_sides = np.column_stack(
            [np.tile(right_side, (len(size), 1)), term_with_residual.sum(axis=0) - term_with_residual[number]]
        )
        low, high = (np.append(bound, side) for bound, side in zip(base.limits, (-np.inf, np.inf), strict=True))
        solutions = solve_bounded(bordered, right_sides, low, high)
        weights, factor = solutions[:, :-1].T, solutions[:, -1]
        base_weights = solve_bounded(squares[None], right_side[None], *base.limits)[0]
        base_squares.append(_held_out_squares(base, number, base_weights[:, None])[0])
        term_squares.append(
            _held_out_squares(base, number, weights)
            - 2 * factor * term_with_residual[number]
            + 2 * factor * np.einsum("kt,kt->t", weights, cross[number])
            + factor**2 * term_powers[number]
        )
        factors.append(factor)
    return TermErrors(np.array(base_squares), np.array(term_squares), np.array(factors))


def _border(squares: FloatArray, base_products: FloatArray, size: FloatArray) -> FloatArray:
    """(terms, k + 1, k + 1): normal matrix of the base (k, k) bordered by each term. A term that is linearly dependent
    on the base gets an infinite diagonal entry, and so the weight 0. base_products: (k, terms), products with the base;
    size: (terms,), sums of squares."""
    independent = size - np.einsum("kt,kt->t", base_products, np.linalg.solve(squares, base_products))
    k = len(squares)
    bordered = np.zeros((len(size), k + 1, k + 1))
    bordered[:, :k, :k] = squares
    bordered[:, :k, k] = bordered[:, k, :k] = base_products.T
    bordered[:, k, k] = np.where(independent > _DEPENDENT * size, size, np.inf)
    return bordered


def solve_bounded(squares: FloatArray, right_sides: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """(systems, k): least squares within bounds, from normal equations (systems, k, k) and right sides (systems, k), by
    an active set: weights that leave their bounds are fixed there, and the others solved for again. The weight of an
    infinite diagonal entry is 0."""
    excluded = np.isinf(np.einsum("tkk->tk", squares))
    fixed, fixed_values = excluded.copy(), np.zeros_like(right_sides)
    for _ in range(right_sides.shape[1]):
        system = np.where(fixed[:, :, None], np.eye(right_sides.shape[1]), squares)
        weights = np.linalg.solve(system, np.where(fixed, fixed_values, right_sides)[:, :, None])[:, :, 0]
        outside = ((weights < low) | (weights > high)) & ~fixed
        if not outside.any():
            break
        fixed_values = np.where(outside, np.clip(weights, low, high), fixed_values)
        fixed |= outside
    return np.asarray(weights)


def _held_out_squares(base: Products, number: int, weights: FloatArray) -> FloatArray:
    """(terms,): |r|² - 2 w'X'r + w'X'X w of block `number`, for each column w of the weights (k, terms)."""
    return np.asarray(
        base.power[number]
        - 2 * base.with_residual[number] @ weights
        + np.einsum("kt,kt->t", weights, base.squares[number] @ weights)
    )


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Weights of the base columns, fitted to all blocks together, and their cost."""

    weights: FloatArray
    """(k,)"""
    cost: float
    """Residual sum of squares plus the prior's penalty."""


def solve(base: Products) -> Solution:
    """Weights and cost of the base columns, fitted to all blocks together."""
    precision, squares, with_residual = base.calibration, base.squares.sum(axis=0), base.with_residual.sum(axis=0)
    weights = solve_bounded(
        (squares + np.diag(precision))[None], (with_residual + base.prior_right_side)[None], *base.limits
    )[0]
    deviations = weights[: len(base.view.to_calibration)] - base.view.to_calibration
    residual_squares = float(base.power.sum() - 2 * with_residual @ weights + weights @ squares @ weights)
    return Solution(weights, residual_squares + float(precision[: len(deviations)] @ deviations**2))
