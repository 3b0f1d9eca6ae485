"""Beam search over a grammar of terms: the sums of up to `LAW_MOST_TERMS` terms with the least error in one view.

A view is the filtered residual of one axis or reading (`matched_filter.View`). The error is cross-validated over blocks
(`screen_terms`). The best sums are extended by one term at a time until the best one leaves at most
`LAW_REMAINDER_SHARE` of the excess error, or a further term is not worth adding (`is_worth_adding`). All sums are
finally ranked by the Bayesian information criterion, and a negative control gives the share of the error that chance
removes. Called by `discover`.
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
from analysis.diagnosis.limits import (
    LAW_BEAM,
    LAW_MOST_TERMS,
    LAW_REMAINDER_SHARE,
    LAW_STARTS_REFINED,
    LAW_WORTH_SHARE,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

_MOST_SHUFFLES = 3
"""Largest number of shuffles of the blocks in the negative control. Chosen by hand."""
_MOST_RIVALS = 2
"""Largest number of rivals, sums that lack a variable of the best sum. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class RankedSums:
    """Sums of terms, ranked by information criterion, and the share that chance alone explains."""

    sums: tuple[Sum, ...]
    """The best first; empty where none can be fitted."""
    chance_share: float
    """Largest share of the held-out squares of time-shuffled residuals that any term removes: the effect of chance; 0
    where none removes any."""


def search_best_sums(base: NormalEquations, terms: Sequence[Term], time_left: TimeBudget) -> RankedSums:
    """Search for the sums with the least cross-validated error. base: normal equations of the model's parameters alone.
    The better half of the beam, `LAW_BEAM // 2` sums, is extended. time_left: where it returns False, the search ends
    with the sums so far."""
    view = base.view
    finite_terms, columns = _build_term_columns(view, terms)
    term_order = _rank_terms(base, columns)
    beam = _fit_best_shapes(base, (), finite_terms, term_order, time_left)
    all_sums = [*beam, *_fit_without_variables(base, beam, finite_terms, term_order, time_left)]
    while beam and len(beam[0].terms) < LAW_MOST_TERMS and time_left():
        best_sum = beam[0]
        if best_sum.cross_validated_error - 1 <= LAW_REMAINDER_SHARE * (best_sum.base_error - 1):
            break
        extended_sums: list[Sum] = []
        for beam_sum in beam[: LAW_BEAM // 2]:
            selected_columns = [
                column for term in beam_sum.terms if (column := compute_term_column(view, term)) is not None
            ]
            term_order = _rank_terms(add_columns(base, selected_columns), columns)
            extended_sums += _fit_best_shapes(base, beam_sum.terms, finite_terms, term_order, time_left)[:LAW_BEAM]
        extended_sums = sorted(extended_sums, key=lambda term_sum: term_sum.cross_validated_error)
        if not extended_sums or not is_worth_adding(
            best_sum.cross_validated_error, extended_sums[0].cross_validated_error
        ):
            break
        all_sums += extended_sums
        beam = tuple(extended_sums)
    return RankedSums(
        tuple(sorted(all_sums, key=_make_information_criterion(view))), _compute_chance_share(view, columns)
    )


def _compute_chance_share(view: View, columns: FloatArray) -> float:
    """Compute the negative control: each block gets another block's residual, reversed in time and scaled to its own
    rms; the largest share that any term removes, over several such shuffles."""
    block_edges, removed_shares = list(pairwise(view.edges)), [0.0]
    for shift in range(1, min(len(block_edges), _MOST_SHUFFLES + 1)):
        shuffled = np.zeros_like(view.residual)
        for (start, stop), (source_start, source_stop) in zip(
            block_edges, [*block_edges[shift:], *block_edges[:shift]], strict=True
        ):
            sample_count = min(stop - start, source_stop - source_start)
            target_residual, source_residual = (
                view.residual[start:stop],
                view.residual[source_start : source_start + sample_count],
            )
            scale = float(np.linalg.norm(target_residual)) / max(float(np.linalg.norm(source_residual)), 1e-300)
            shuffled[start : start + sample_count] = scale * source_residual[::-1]
        errors = cross_validate_terms(build_normal_equations(replace(view, residual=shuffled)), columns)
        base_squares = float(errors.base_squares.sum())
        removed_shares.append(1 - float(errors.term_squares.sum(axis=0).min()) / max(base_squares, 1e-300))
    return max(removed_shares)


def _fit_without_variables(
    base: NormalEquations, beam: Sequence[Sum], terms: Sequence[Term], term_order: Sequence[int], time_left: TimeBudget
) -> tuple[Sum, ...]:
    """Fit sums of one term that lack a variable of the best sum, the first of the beam: its rivals. Empty without a
    beam. term_order: indices of the terms by rising error."""
    if not beam:
        return ()
    best_variables = set(beam[0].variables)
    reduced_order = [term_index for term_index in term_order if not best_variables <= terms[term_index].variables]
    return _fit_best_shapes(base, (), terms, reduced_order, time_left)[:_MOST_RIVALS]


def is_worth_adding(error_without: float, error_with: float) -> bool:
    """Whether a term removes more than `LAW_WORTH_SHARE` of the error above the noise. error_without, error_with:
    held-out squares without and with the term, over those of the noise (1 = noise alone)."""
    return error_without - error_with > LAW_WORTH_SHARE * max(error_without - 1.0, 0.0)


def _make_information_criterion(view: View) -> Callable[[Sum], float]:
    """Make the function that computes the Bayesian information criterion of a sum (Schwarz, Ann. Stat. 6:461, 1978):
    held-out squares over the noise's mean square, plus log(samples) for each parameter."""
    sample_count = len(view.residual)

    def compute_criterion(term_sum: Sum) -> float:
        parameter_count = sum(1 + len(term.numbers) for term in term_sum.terms)
        return term_sum.cross_validated_error * sample_count + parameter_count * float(np.log(sample_count))

    return compute_criterion


def _build_term_columns(view: View, terms: Sequence[Term]) -> tuple[list[Term], FloatArray]:
    """Select the terms that are finite everywhere and not zero, and build their columns (finite terms, samples), scaled
    to an rms of 1."""
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
    return [int(term_index) for term_index in np.argsort(cross_validate_terms(base, columns).term_squares.sum(axis=0))]


def _fit_best_shapes(
    base: NormalEquations,
    selected_terms: tuple[Term, ...],
    terms: Sequence[Term],
    term_order: Sequence[int],
    time_left: TimeBudget,
) -> tuple[Sum, ...]:
    """Fit the shapes of the best-ranked `LAW_STARTS_REFINED` families, each shape together with the selected terms and
    from its best-ranked start; sorted by cross-validated error. Sums that cannot be fitted, and those for which no time
    is left, are left out."""
    term_by_shape: dict[str, Term] = {}
    refined_families: set[str] = set()
    for term_index in term_order:
        term = terms[term_index]
        family = term.family or term.shape
        if term.shape not in {candidate.shape for candidate in selected_terms} and (
            len(refined_families) < LAW_STARTS_REFINED or family in refined_families
        ):
            term_by_shape.setdefault(term.shape, term)
            refined_families.add(family)
    fitted_sums = [fit_sum(base, (*selected_terms, term)) for term in term_by_shape.values() if time_left()]
    return tuple(
        sorted(
            (candidate for candidate in fitted_sums if candidate is not None),
            key=lambda candidate: candidate.cross_validated_error,
        )
    )
