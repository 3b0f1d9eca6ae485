"""Screens terms by cross-validation: how much of a fit's residual each explains beside what re-tuning explains.

Each block's error is that of parameters fitted to all others (Stone, J. R. Stat. Soc. B 36:111, 1974), with the model's
own parameters pulled to their calibration, and within the bounds of re-tuning. Terms are tried together, as products of
columns.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.settings import RETUNING_BOUND
from equalizer.signals.signal import FloatArray

_DEPENDENT = 1e-6
"""Share of a column's power that must be independent of the model's columns."""


@dataclass(frozen=True, slots=True, eq=False)
class Products:
    """Normal equations of the base columns, block by block."""

    view: View
    held: tuple[FloatArray, ...]
    """(s,) each: columns of terms already taken, after the model's parameters and a constant."""
    squares: FloatArray
    """(blocks, k, k)"""
    with_residual: FloatArray
    """(blocks, k): products with the residual."""
    power: FloatArray
    """(blocks,): sum of squares of the residual."""

    @property
    def blocks(self) -> list[slice]:
        """Samples of each block, as slices of (s,)."""
        edges = self.view.edges
        return [slice(a, b) for a, b in pairwise(edges)]

    @property
    def calibration(self) -> FloatArray:
        """(k,): prior precision of each column's weight."""
        sizes = self.squares.sum(axis=0).diagonal()
        precision = np.where(sizes > 0, 1e-10 * sizes, 1.0)
        precision[: len(self.view.to_calibration) - 1] = 1.0
        return precision

    @property
    def wanted(self) -> FloatArray:
        """(k,): the prior's part of the right side."""
        offset = np.zeros(len(self.calibration))
        offset[: len(self.view.to_calibration)] = self.view.to_calibration
        return self.calibration * offset

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """(k,) each: bounds of the weights. The model's parameters stay within those of re-tuning: with mass, damping
        and stiffness free to vanish, a force that takes the command away would explain everything."""
        known, k = self.view.to_calibration, len(self.calibration)
        tuned = len(known) - 1
        low, high = np.full(k, -np.inf), np.full(k, np.inf)
        low[:tuned], high[:tuned] = known[:tuned] - RETUNING_BOUND, known[:tuned] + RETUNING_BOUND
        return low, high

    def cross(self, columns: FloatArray) -> FloatArray:
        """(blocks, k, terms): products of the base columns with others. columns: (terms, s)"""
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
    """Products of the model's parameters and a constant."""
    base, edges = view.parameter_columns, list(pairwise(view.edges))
    return Products(
        view,
        (),
        np.array([base[:, a:b] @ base[:, a:b].T for a, b in edges]),
        np.array([base[:, a:b] @ view.residual[a:b] for a, b in edges]),
        np.array([view.residual[a:b] @ view.residual[a:b] for a, b in edges]),
    )


def add_columns(base: Products, columns: Sequence[FloatArray]) -> Products:
    """The products with the columns of more terms. columns: (s,) each"""
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
    """Cross-validated squares of the base alone and with each term beside it, block by block."""

    without: FloatArray
    """(blocks,): held-out squares of the base alone."""
    with_it: FloatArray
    """(blocks, terms): held-out squares with each term."""
    factors: FloatArray
    """(blocks, terms): each term's factor, fitted to the other blocks."""


def cross_validate_terms(of: Products, columns: FloatArray) -> TermErrors:
    """Held-out squares with each term alone beside the base, by leaving each block out. columns: (terms, s)"""
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
    """(terms, k + 1, k + 1): normal equations of the base columns (k, k) bordered by each term. A term that depends on
    them gets the weight 0. other: (k, terms) products; size: (terms,) squares."""
    left = size - np.einsum("kt,kt->t", other, np.linalg.solve(squares, other))
    k = len(squares)
    bordered = np.zeros((len(size), k + 1, k + 1))
    bordered[:, :k, :k] = squares
    bordered[:, :k, k] = bordered[:, k, :k] = other.T
    bordered[:, k, k] = np.where(left > _DEPENDENT * size, size, np.inf)
    return bordered


def solve_within(squares: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """(systems, k): least squares within bounds, from normal equations (systems, k, k) and right sides (systems, k), by
    an active set: weights that leave their bounds are fixed there, and the others solved for again. An infinite
    diagonal makes its weight 0."""
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
    """(terms,). weights: (k, terms)"""
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
