"""Beam search over a grammar of terms: the sums of up to `LAW_MOST_TERMS` terms with the least error on one channel.

The error is cross-validated over blocks (`screen_terms`). All sums are finally ranked by the Bayesian information
criterion, and a negative control gives the share of the error that chance removes (`_compute_placebo_share`).
Called by `discover`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.discovery.fit_sum import Sum, compute_term_column, fit_sum
from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.screen_terms import (
    NormalEquations,
    add_columns,
    build_normal_equations,
    cross_validate_terms,
)
from analysis.diagnosis.settings import (
    LAW_BEAM,
    LAW_MAIN_PART,
    LAW_MOST_TERMS,
    LAW_REFINED,
    LAW_WORTH_SHARE,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

_PLACEBO_COUNT = 3
"""Largest number of shuffles of the blocks in the negative control."""
_RIVAL_COUNT = 2
"""Number of rivals: sums that lack a variable of the best sum."""


@dataclass(frozen=True, slots=True, eq=False)
class RankedSums:
    """Sums of terms, ranked by information criterion, and the share that chance alone explains."""

    sums: tuple[Sum, ...]
    """The best first."""
    placebo: float
    """Largest share of the held-out squares of time-shuffled residuals that any term removes: the effect of chance."""


def search_best_sums(base: NormalEquations, terms: Sequence[Term], time_left: TimeBudget) -> RankedSums:
    """Search for the sums with the least cross-validated error. base: products of the model's parameters alone.
    time_left: False ends the search with the sums so far."""
    view = base.view
    finite_terms, columns = _build_term_columns(view, terms)
    term_order = _rank_terms(base, columns)
    beam = _fit_best_shapes(base, (), finite_terms, term_order, time_left)
    all_sums = [*beam, *_fit_without_variables(base, beam, finite_terms, term_order, time_left)]
    while beam and len(beam[0].terms) < LAW_MOST_TERMS and time_left():
        best = beam[0]
        if best.cross_validated - 1 <= LAW_MAIN_PART * (best.base_error - 1):
            break
        extended: list[Sum] = []
        for beam_sum in beam[: LAW_BEAM // 2]:
            selected_columns = [
                column for term in beam_sum.terms if (column := compute_term_column(view, term)) is not None
            ]
            term_order = _rank_terms(add_columns(base, selected_columns), columns)
            extended += _fit_best_shapes(base, beam_sum.terms, finite_terms, term_order, time_left)[:LAW_BEAM]
        extended = sorted(extended, key=lambda term_sum: term_sum.cross_validated)
        if not extended or not is_worth_adding(best.cross_validated, extended[0].cross_validated):
            break
        all_sums += extended
        beam = tuple(extended)
    return RankedSums(
        tuple(sorted(all_sums, key=_make_information_criterion(view))), _compute_placebo_share(view, columns)
    )


def _compute_placebo_share(view: View, columns: FloatArray) -> float:
    """Compute the negative control: each block gets another block's residual, reversed in time and scaled to its own
    rms; the largest share that any term removes, over several such shuffles."""
    blocks, removed_shares = list(pairwise(view.edges)), [0.0]
    for shift in range(1, min(len(blocks), _PLACEBO_COUNT + 1)):
        shuffled = np.zeros_like(view.residual)
        for (a, b), (c, d) in zip(blocks, [*blocks[shift:], *blocks[:shift]], strict=True):
            count = min(b - a, d - c)
            block_residual, other_residual = view.residual[a:b], view.residual[c : c + count]
            scale = float(np.linalg.norm(block_residual)) / max(float(np.linalg.norm(other_residual)), 1e-300)
            shuffled[a : a + count] = scale * other_residual[::-1]
        errors = cross_validate_terms(build_normal_equations(replace(view, residual=shuffled)), columns)
        base_squares = float(errors.base_squares.sum())
        removed_shares.append(1 - float(errors.term_squares.sum(axis=0).min()) / max(base_squares, 1e-300))
    return max(removed_shares)


def _fit_without_variables(
    base: NormalEquations, beam: Sequence[Sum], terms: Sequence[Term], term_order: Sequence[int], time_left: TimeBudget
) -> tuple[Sum, ...]:
    """Fit the best sums of one term that lack a variable of the best sum: its rivals. term_order: terms by rising
    error."""
    if not beam:
        return ()
    best_variables = set(beam[0].variables)
    reduced_order = [term_index for term_index in term_order if not best_variables <= terms[term_index].variables]
    return _fit_best_shapes(base, (), terms, reduced_order, time_left)[:_RIVAL_COUNT]


def is_worth_adding(error_without: float, error_with: float) -> bool:
    """Whether a term removes more than `LAW_WORTH_SHARE` of the error above the noise. The errors are held-out squares
    over the noise's, without and with the term."""
    return error_without - error_with > LAW_WORTH_SHARE * max(error_without - 1.0, 0.0)


def _make_information_criterion(view: View) -> Callable[[Sum], float]:
    """Make the Bayesian information criterion (Schwarz, Ann. Stat. 6:461, 1978): squares over the noise's, plus
    log(samples) for each parameter."""
    sample_count = len(view.residual)

    def compute_criterion(term_sum: Sum) -> float:
        parameter_count = sum(1 + len(term.numbers) for term in term_sum.terms)
        return term_sum.cross_validated * sample_count + parameter_count * float(np.log(sample_count))

    return compute_criterion


def _build_term_columns(view: View, terms: Sequence[Term]) -> tuple[list[Term], FloatArray]:
    """Build the columns (terms, s) of the terms that are finite everywhere and not zero, scaled to an rms of 1."""
    finite_terms: list[Term] = []
    columns: FloatArray = np.empty((len(terms), len(view.residual)), dtype=np.float32)
    for term in terms:
        column = compute_term_column(view, term)
        rms = 0.0 if column is None else float(np.sqrt(np.mean(column**2)))
        if column is not None and np.isfinite(rms) and rms > 0:
            columns[len(finite_terms)] = column / rms
            finite_terms.append(term)
    return finite_terms, columns[: len(finite_terms)]


def _rank_terms(base: NormalEquations, columns: FloatArray) -> list[int]:
    """Rank the terms (indices) by rising cross-validated error, each alone with the columns in `base`."""
    return [int(number) for number in np.argsort(cross_validate_terms(base, columns).term_squares.sum(axis=0))]


def _fit_best_shapes(
    base: NormalEquations,
    selected: tuple[Term, ...],
    terms: Sequence[Term],
    term_order: Sequence[int],
    time_left: TimeBudget,
) -> tuple[Sum, ...]:
    """Fit the best-ranked shapes, each together with the terms in `selected`; sorted by cross-validated error."""
    shapes: dict[str, Term] = {}
    families: set[str] = set()
    for term_index in term_order:
        term = terms[term_index]
        family = term.family or term.shape
        if term.shape not in {candidate.shape for candidate in selected} and (
            len(families) < LAW_REFINED or family in families
        ):
            shapes.setdefault(term.shape, term)
            families.add(family)
    fitted_sums = [fit_sum(base, (*selected, term)) for term in shapes.values() if time_left()]
    return tuple(
        sorted(
            (candidate for candidate in fitted_sums if candidate is not None),
            key=lambda candidate: candidate.cross_validated,
        )
    )
