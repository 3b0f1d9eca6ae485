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
    held: tuple[FloatArray, ...]
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
    def wanted(self) -> FloatArray:
        """(k,): D w0, the prior's contribution to the right side of the normal equations."""
        offset = np.zeros(len(self.calibration))
        offset[: len(self.view.to_calibration)] = self.view.to_calibration
        return self.calibration * offset

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """(k,) each: bounds of the weights; the model's parameters have those of re-tuning. If mass, damping and
        stiffness could vanish, a force that cancels the command would explain the whole residual."""
        known, k = self.view.to_calibration, len(self.calibration)
        tuned = len(known) - 1
        low, high = np.full(k, -np.inf), np.full(k, np.inf)
        low[:tuned], high[:tuned] = known[:tuned] - RETUNING_BOUND, known[:tuned] + RETUNING_BOUND
        return low, high

    def cross(self, columns: FloatArray) -> FloatArray:
        """(blocks, k, terms): inner products of the base columns with those of terms. columns: (terms, s)"""
        found = []
        for part in self.blocks:
            those = columns[:, part].T
            rows = [
                self.view.parameter_columns[:, part] @ those,
                *((column[None, part] @ those) for column in self.held),
            ]
            found.append(np.vstack(rows))
        return np.array(found)


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
    more, view = np.array(columns), base.view
    cross = base.cross(more).transpose(0, 2, 1)
    own = np.array([more[:, part] @ more[:, part].T for part in base.blocks])
    seen = np.array([more[:, part] @ view.residual[part] for part in base.blocks])
    squares = np.concatenate(
        [np.concatenate([base.squares, cross.transpose(0, 2, 1)], axis=2), np.concatenate([cross, own], axis=2)], axis=1
    )
    return Products(view, (*base.held, *columns), squares, np.hstack([base.with_residual, seen]), base.power)


@dataclass(frozen=True, slots=True, eq=False)
class TermErrors:
    """Cross-validated sums of squared errors of the base alone and with each single term added, per block."""

    without: FloatArray
    """(blocks,): held-out sum of squares of the base alone."""
    with_it: FloatArray
    """(blocks, terms): held-out sum of squares with each term."""
    factors: FloatArray
    """(blocks, terms): each term's factor, fitted to the other blocks."""


def cross_validate_terms(of: Products, columns: FloatArray) -> TermErrors:
    """Held-out sums of squares with each term added to the base by itself, each block left out once. columns: (terms,
    s)"""
    parts = of.blocks
    cross = of.cross(columns)
    own = np.array([np.einsum("ks,ks->k", columns[:, part], columns[:, part]) for part in parts])
    seen = np.array([columns[:, part] @ of.view.residual[part] for part in parts])
    without, with_it, factors = [], [], []
    for number in range(len(parts)):
        squares = of.squares.sum(axis=0) - of.squares[number] + np.diag(of.calibration)
        right_side = of.with_residual.sum(axis=0) - of.with_residual[number] + of.wanted
        other, size = cross.sum(axis=0) - cross[number], own.sum(axis=0) - own[number]
        bordered = _border(squares, other, size)
        right = np.column_stack([np.tile(right_side, (len(size), 1)), seen.sum(axis=0) - seen[number]])
        low, high = (np.append(bound, side) for bound, side in zip(of.limits, (-np.inf, np.inf), strict=True))
        solved = solve_within(bordered, right, low, high)
        weights, factor = solved[:, :-1].T, solved[:, -1]
        alone = solve_within(squares[None], right_side[None], *of.limits)[0]
        without.append(_held_out_squares(of, number, alone[:, None])[0])
        with_it.append(
            _held_out_squares(of, number, weights)
            - 2 * factor * seen[number]
            + 2 * factor * np.einsum("kt,kt->t", weights, cross[number])
            + factor**2 * own[number]
        )
        factors.append(factor)
    return TermErrors(np.array(without), np.array(with_it), np.array(factors))


def _border(squares: FloatArray, other: FloatArray, size: FloatArray) -> FloatArray:
    """(terms, k + 1, k + 1): normal matrix of the base (k, k) bordered by each term. A term that is linearly dependent
    on the base gets an infinite diagonal entry, and so the weight 0. other: (k, terms), products with the base; size:
    (terms,), sums of squares."""
    left = size - np.einsum("kt,kt->t", other, np.linalg.solve(squares, other))
    k = len(squares)
    bordered = np.zeros((len(size), k + 1, k + 1))
    bordered[:, :k, :k] = squares
    bordered[:, :k, k] = bordered[:, k, :k] = other.T
    bordered[:, k, k] = np.where(left > _DEPENDENT * size, size, np.inf)
    return bordered


def solve_within(squares: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """(systems, k): least squares within bounds, from normal equations (systems, k, k) and right sides (systems, k), by
    an active set: weights that leave their bounds are fixed there, and the others solved for again. The weight of an
    infinite diagonal entry is 0."""
    barred = np.isinf(np.einsum("tkk->tk", squares))
    fixed, at = barred.copy(), np.zeros_like(right)
    for _ in range(right.shape[1]):
        system = np.where(fixed[:, :, None], np.eye(right.shape[1]), squares)
        found = np.linalg.solve(system, np.where(fixed, at, right)[:, :, None])[:, :, 0]
        outside = ((found < low) | (found > high)) & ~fixed
        if not outside.any():
            break
        at = np.where(outside, np.clip(found, low, high), at)
        fixed |= outside
    return np.asarray(found)


def _held_out_squares(of: Products, number: int, weights: FloatArray) -> FloatArray:
    """(terms,): |r|² - 2 w'X'r + w'X'X w of block `number`, for each column w of the weights (k, terms)."""
    return np.asarray(
        of.power[number]
        - 2 * of.with_residual[number] @ weights
        + np.einsum("kt,kt->t", weights, of.squares[number] @ weights)
    )


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Weights of the base columns, fitted to all blocks together, and their cost."""

    weights: FloatArray
    """(k,)"""
    cost: float
    """Residual sum of squares plus the prior's penalty."""


def solve(of: Products) -> Solution:
    """Weights and cost of the base columns, fitted to all blocks together."""
    pulled, squares, seen = of.calibration, of.squares.sum(axis=0), of.with_residual.sum(axis=0)
    weights = solve_within((squares + np.diag(pulled))[None], (seen + of.wanted)[None], *of.limits)[0]
    own = weights[: len(of.view.to_calibration)] - of.view.to_calibration
    left = float(of.power.sum() - 2 * seen @ weights + weights @ squares @ weights)
    return Solution(weights, left + float(pulled[: len(own)] @ own**2))
