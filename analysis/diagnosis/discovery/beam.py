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

_PLACEBOS = 3
_LACKING = 2


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    sums: tuple[Sum, ...]
    """The best first."""
    placebo: float
    """Share of the held-out squares that the best term takes of residuals out of their time: what chance takes."""


def best_sums(base: Products, terms: Sequence[Term], time_left: TimeBudget) -> Searched:
    """base: of the model's numbers alone."""
    view = base.view
    kept, columns = _tabled(view, terms)
    order = _order(base, columns)
    found = _refined(base, (), kept, order, time_left)
    every = [*found, *_without_variables(base, found, kept, order, time_left)]
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
    """Each block gets the residual of another one, backwards and as large as its own: the most of several turns."""
    blocks, takes = list(pairwise(view.edges)), [0.0]
    for shift in range(1, min(len(blocks), _PLACEBOS + 1)):
        turned = np.zeros_like(view.residual)
        for (a, b), (c, d) in zip(blocks, [*blocks[shift:], *blocks[:shift]], strict=True):
            count = min(b - a, d - c)
            own, other = view.residual[a:b], view.residual[c : c + count]
            size = float(np.linalg.norm(own)) / max(float(np.linalg.norm(other)), 1e-300)
            turned[a : a + count] = size * other[::-1]
        found = tried(products_of(replace(view, residual=turned)), columns)
        without = float(found.without.sum())
        takes.append(1 - float(found.with_it.sum(axis=0).min()) / max(without, 1e-300))
    return max(takes)


def _without_variables(
    base: Products, found: Sequence[Sum], terms: Sequence[Term], order: Sequence[int], time_left: TimeBudget
) -> tuple[Sum, ...]:
    """The grammar without what the best needs: the best starts of laws that lack one of its variables."""
    if not found:
        return ()
    needed = set(found[0].variables)
    left = [number for number in order if not needed <= terms[number].variables]
    return _refined(base, (), terms, left, time_left)[:_LACKING]


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
