"""A sum of terms along one axis, with its free numbers fitted to what a fit leaves: Gauss and Newton's steps.

Factors and the model's own numbers are solved for at each step, so that only what is not linear is searched (variable
projection, Golub and Pereyra 1973).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.discovery.along import along
from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.discovery.screen import Products, Solved, extended, solved, tried
from analysis.diagnosis.discovery.whitened import View
from equalizer.signals.signal import FloatArray

_MOVE = 1e-3
_ROUNDS = 8
_SETTLED = 1e-3
"""Share of what is left, below which a step is the last."""


@dataclass(frozen=True, slots=True, eq=False)
class Sum:
    axis: int
    terms: tuple[Term, ...]
    factors: tuple[float, ...]
    """SI"""
    crossed: float
    """Held-out squares over the noise's, per sample: 1 = noise alone."""
    without: float
    """The same of the re-tuned model alone."""
    spread: float
    """Jackknife error of the first factor over the blocks, as a share of it."""
    moved: tuple[float, ...]
    """(t,): what it wants the model's own numbers to change by, in standard deviations."""

    @property
    def variables(self) -> tuple[str, ...]:
        return tuple(sorted(frozenset[str]().union(*(term.variables for term in self.terms))))


def column_of(view: View, term: Term) -> FloatArray | None:
    """(s,); None where it is no number somewhere."""
    parts = []
    for seen in view.records:
        force = along(term.shape, term.numbers, seen.columns, seen.rate_hz)
        if not np.isfinite(force).all():
            return None
        parts.append(seen.column(force, view.axis))
    return np.concatenate(parts)


def fitted_sum(base: Products, terms: Sequence[Term]) -> Sum | None:
    """base: of the model's numbers alone. None where no start is a number."""
    view = base.view
    at = _Point(tuple(terms), *_columns(view, terms))
    if at.columns is None:
        return None
    best = _solved(base, at.columns)
    for _ in range(_ROUNDS if any(term.numbers for term in terms) else 0):
        better = _stepped(base, at, best)
        if better is None:
            break
        gained = 1 - better[1].cost / best.cost
        at, best = better
        if gained < _SETTLED:
            break
    assert at.columns is not None
    return _judged(base, at.terms, at.columns, best)


def _judged(base: Products, terms: tuple[Term, ...], columns: Sequence[FloatArray], best: Solved) -> Sum:
    view = base.view
    whole = extended(base, columns[1:])
    held = tried(whole, columns[0][None, :])
    alone = tried(base, columns[0][None, :])
    size = view.noise * len(view.residual)
    factors = held.factors[:, 0]
    spread = float(np.std(factors) * np.sqrt(len(factors) - 1) / max(abs(float(np.mean(factors))), 1e-300))
    return Sum(
        view.axis,
        terms,
        tuple(best.weights[len(view.tuned) :].tolist()),
        float(held.with_it.sum()) / size,
        float(alone.without.sum()) / size,
        spread,
        tuple(best.weights[: len(view.tuned) - 1].tolist()),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    terms: tuple[Term, ...]
    columns: tuple[FloatArray, ...] | None


def _columns(view: View, terms: Sequence[Term]) -> tuple[tuple[FloatArray, ...] | None]:
    found = [column_of(view, term) for term in terms]
    return (None if any(column is None for column in found) else tuple(c for c in found if c is not None),)


def _solved(base: Products, columns: Sequence[FloatArray]) -> Solved:
    return solved(extended(base, columns))


def _stepped(base: Products, at: _Point, best: Solved) -> tuple[_Point, Solved] | None:
    view, k = base.view, len(base.view.tuned)
    assert at.columns is not None
    factors = best.weights[k:]
    moves, slopes = [], []
    for number, term in enumerate(at.terms):
        for place in range(len(term.numbers)):
            column = column_of(view, _moved(term, place, _MOVE))
            if column is None:
                return None
            slopes.append(factors[number] * (column - at.columns[number]) / _MOVE)
            moves.append((number, place))
    if not moves:
        return None
    sizes = np.array([max(float(np.linalg.norm(slope)), 1e-300) for slope in slopes])
    joint = extended(base, [*at.columns, *(slope / size for slope, size in zip(slopes, sizes, strict=True))])
    found = solved(_steadied(joint, len(slopes)))
    step = np.clip(found.weights[-len(slopes) :] / sizes, -0.7, 0.7)
    for share in (1.0, 0.4, 0.15, 0.05):
        terms = at.terms
        for (number, place), move in zip(moves, step, strict=True):
            moved = _moved(terms[number], place, share * float(move))
            terms = (*terms[:number], moved, *terms[number + 1 :])
        columns = _columns(view, terms)[0]
        if columns is None:
            continue
        there = _solved(base, columns)
        if there.cost < best.cost * (1 - 1e-6):
            return _Point(terms, columns), there
    return None


def _steadied(joint: Products, count: int) -> Products:
    """Slopes, of size 1, that hardly differ from other columns are not followed."""
    squares = joint.squares.copy()
    places = np.arange(squares.shape[1] - count, squares.shape[1])
    squares[:, places, places] += 1e-4 / len(squares)
    return replace(joint, squares=squares)


def _moved(term: Term, place: int, move: float) -> Term:
    """Exponents and angles by so much, what is positive by such a share; within the bounds."""
    numbers, (low, high) = list(term.numbers), term.bounds[place]
    here = numbers[place]
    plain = place in term.exponents or place in term.turns
    numbers[place] = min(max(here + move if plain else here * float(np.exp(move)), low), high)
    return replace(term, numbers=tuple(numbers))
