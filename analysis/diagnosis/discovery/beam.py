"""The best sums of up to three terms along one axis, by their held-out error: a beam over the grammar."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.discovery.screen import Products, extended, products_of, tried
from analysis.diagnosis.discovery.sums import Sum, column_of, fitted_sum
from analysis.diagnosis.discovery.whitened import View
from analysis.diagnosis.settings import (
    LAW_BEAM,
    LAW_MAIN_PART,
    LAW_MOST_TERMS,
    LAW_REFINED,
    LAW_WORTH_SHARE,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    sums: tuple[Sum, ...]
    """The best first."""
    placebo: float
    """Share of the held-out squares above the noise that the best term takes of a residual out of its time."""


def best_sums(base: Products, terms: Sequence[Term], time_left: TimeBudget) -> Searched:
    """base: of the model's numbers alone."""
    view = base.view
    kept, columns = _tabled(view, terms)
    found = _refined(base, (), kept, _order(base, columns), time_left)
    every = list(found)
    while found and len(found[0].terms) < LAW_MOST_TERMS and time_left():
        best = found[0]
        if best.crossed - 1 <= LAW_MAIN_PART * (best.without - 1):
            break
        longer: list[Sum] = []
        for sum_ in found[: LAW_BEAM // 2]:
            held = [column for term in sum_.terms if (column := column_of(view, term)) is not None]
            order = _order(extended(base, held), columns)
            longer += _refined(base, sum_.terms, kept, order, time_left)[:LAW_BEAM]
        longer = sorted(longer, key=lambda each: each.crossed)
        if not longer or not _worth(best, longer[0]):
            break
        every += longer
        found = tuple(longer)
    return Searched(tuple(sorted(every, key=_price(view))), _placebo(view, columns))


def _placebo(view: View, columns: FloatArray) -> float:
    """Each block gets the residual of another one, backwards."""
    turned = np.zeros_like(view.residual)
    blocks = list(pairwise(view.edges))
    for (a, b), (c, d) in zip(blocks, [*blocks[1:], blocks[0]], strict=True):
        count = min(b - a, d - c)
        turned[a : a + count] = view.residual[c : c + count][::-1]
    found = tried(products_of(replace(view, residual=turned)), columns)
    without = float(found.without.sum())
    return max(1 - float(found.with_it.sum(axis=0).min()) / max(without, 1e-300), 0.0)


def _worth(shorter: Sum, longer: Sum) -> bool:
    """Whether another term takes enough of what is left above the noise."""
    return shorter.crossed - longer.crossed > LAW_WORTH_SHARE * max(shorter.crossed - 1.0, 0.0)


def _price(view: View) -> Callable[[Sum], float]:
    """Squares over the noise's, and what its numbers cost to say (Schwarz 1978)."""
    samples = len(view.residual)

    def price(of: Sum) -> float:
        numbers = sum(1 + len(term.numbers) for term in of.terms)
        return of.crossed * samples + numbers * float(np.log(samples))

    return price


def _tabled(view: View, terms: Sequence[Term]) -> tuple[list[Term], FloatArray]:
    """Terms that are numbers everywhere, and their columns, of one size (terms, s)."""
    kept: list[Term] = []
    columns: FloatArray = np.empty((len(terms), len(view.residual)), dtype=np.float32)
    for term in terms:
        column = column_of(view, term)
        size = 0.0 if column is None else float(np.sqrt(np.mean(column**2)))
        if column is not None and np.isfinite(size) and size > 0:
            columns[len(kept)] = column / size
            kept.append(term)
    return kept, columns[: len(kept)]


def _order(base: Products, columns: FloatArray) -> list[int]:
    return [int(number) for number in np.argsort(tried(base, columns).with_it.sum(axis=0))]


def _refined(
    base: Products, held: tuple[Term, ...], terms: Sequence[Term], order: Sequence[int], time_left: TimeBudget
) -> tuple[Sum, ...]:
    """The best starts of different shapes, each beside the terms that are held, fitted together."""
    shapes: dict[str, Term] = {}
    for number in order:
        if terms[number].shape not in {term.shape for term in held}:
            shapes.setdefault(terms[number].shape, terms[number])
        if len(shapes) == LAW_REFINED:
            break
    found = [fitted_sum(base, (*held, term)) for term in shapes.values() if time_left()]
    return tuple(sorted((each for each in found if each is not None), key=lambda each: each.crossed))
