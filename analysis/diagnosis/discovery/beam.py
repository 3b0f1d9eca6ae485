"""Beam search over the grammar: the sums of up to `LAW_MOST_TERMS` terms on one axis or reading with the least error.

The error is cross-validated over blocks (`screen_terms`). All sums are finally ranked by the Bayesian information
criterion, and a negative control gives the share of the error that chance removes (`_placebo_share`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.discovery.fit_sum import Sum, column_of, fit_sum
from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.screen_terms import Products, add_columns, cross_validate_terms, products_of
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
"""Shuffles of the blocks in the negative control."""
_LACKING = 2
"""Number of rivals: sums that lack a variable of the best sum."""


@dataclass(frozen=True, slots=True, eq=False)
class RankedSums:
    """Sums of terms, ranked by information criterion, and the share that chance alone explains."""

    sums: tuple[Sum, ...]
    """The best first."""
    placebo: float
    """Largest share of the held-out squares of time-shuffled residuals that any term removes: the effect of chance."""


def best_sums(base: Products, terms: Sequence[Term], time_left: TimeBudget) -> RankedSums:
    """Beam search for the sums with the least held-out error. base: products of the model's parameters alone."""
    view = base.view
    kept, columns = _term_columns(view, terms)
    order = _rank_terms(base, columns)
    found = _fit_best_shapes(base, (), kept, order, time_left)
    every = [*found, *_fit_without_variables(base, found, kept, order, time_left)]
    while found and len(found[0].terms) < LAW_MOST_TERMS and time_left():
        best = found[0]
        if best.cross_validated - 1 <= LAW_MAIN_PART * (best.without - 1):
            break
        longer: list[Sum] = []
        for sum_ in found[: LAW_BEAM // 2]:
            held = [column for term in sum_.terms if (column := column_of(view, term)) is not None]
            order = _rank_terms(add_columns(base, held), columns)
            longer += _fit_best_shapes(base, sum_.terms, kept, order, time_left)[:LAW_BEAM]
        longer = sorted(longer, key=lambda each: each.cross_validated)
        if not longer or not _is_worth_it(best, longer[0]):
            break
        every += longer
        found = tuple(longer)
    return RankedSums(tuple(sorted(every, key=_description_length(view))), _placebo_share(view, columns))


def _placebo_share(view: View, columns: FloatArray) -> float:
    """Negative control: each block gets another block's residual, reversed in time and scaled to its own rms; the
    largest share that any term removes, over several such shuffles."""
    blocks, takes = list(pairwise(view.edges)), [0.0]
    for shift in range(1, min(len(blocks), _PLACEBOS + 1)):
        turned = np.zeros_like(view.residual)
        for (a, b), (c, d) in zip(blocks, [*blocks[shift:], *blocks[:shift]], strict=True):
            count = min(b - a, d - c)
            own, other = view.residual[a:b], view.residual[c : c + count]
            size = float(np.linalg.norm(own)) / max(float(np.linalg.norm(other)), 1e-300)
            turned[a : a + count] = size * other[::-1]
        found = cross_validate_terms(products_of(replace(view, residual=turned)), columns)
        without = float(found.without.sum())
        takes.append(1 - float(found.with_it.sum(axis=0).min()) / max(without, 1e-300))
    return max(takes)


def _fit_without_variables(
    base: Products, found: Sequence[Sum], terms: Sequence[Term], order: Sequence[int], time_left: TimeBudget
) -> tuple[Sum, ...]:
    """The best sums of one term that lack a variable of the best sum: its rivals."""
    if not found:
        return ()
    needed = set(found[0].variables)
    left = [number for number in order if not needed <= terms[number].variables]
    return _fit_best_shapes(base, (), terms, left, time_left)[:_LACKING]


def _is_worth_it(shorter: Sum, longer: Sum) -> bool:
    """Whether a further term removes at least `LAW_WORTH_SHARE` of the error above the noise."""
    return shorter.cross_validated - longer.cross_validated > LAW_WORTH_SHARE * max(shorter.cross_validated - 1.0, 0.0)


def _description_length(view: View) -> Callable[[Sum], float]:
    """Bayesian information criterion (Schwarz 1978): squares over the noise's, plus log(samples) for each parameter."""
    samples = len(view.residual)

    def price(of: Sum) -> float:
        numbers = sum(1 + len(term.numbers) for term in of.terms)
        return of.cross_validated * samples + numbers * float(np.log(samples))

    return price


def _term_columns(view: View, terms: Sequence[Term]) -> tuple[list[Term], FloatArray]:
    """Terms that are finite everywhere, and their columns (terms, s), scaled to an rms of 1."""
    kept: list[Term] = []
    columns: FloatArray = np.empty((len(terms), len(view.residual)), dtype=np.float32)
    for term in terms:
        column = column_of(view, term)
        size = 0.0 if column is None else float(np.sqrt(np.mean(column**2)))
        if column is not None and np.isfinite(size) and size > 0:
            columns[len(kept)] = column / size
            kept.append(term)
    return kept, columns[: len(kept)]


def _rank_terms(base: Products, columns: FloatArray) -> list[int]:
    """Indices of the terms by rising cross-validated error, each alone with the columns in `base`."""
    return [int(number) for number in np.argsort(cross_validate_terms(base, columns).with_it.sum(axis=0))]


def _fit_best_shapes(
    base: Products, held: tuple[Term, ...], terms: Sequence[Term], order: Sequence[int], time_left: TimeBudget
) -> tuple[Sum, ...]:
    """The best-ranked shapes, each fitted together with the terms in `held`, sorted by held-out error."""
    shapes: dict[str, Term] = {}
    families: set[str] = set()
    for number in order:
        term = terms[number]
        family = term.family or term.shape
        if term.shape not in {each.shape for each in held} and (len(families) < LAW_REFINED or family in families):
            shapes.setdefault(term.shape, term)
            families.add(family)
    found = [fit_sum(base, (*held, term)) for term in shapes.values() if time_left()]
    return tuple(sorted((each for each in found if each is not None), key=lambda each: each.cross_validated))
