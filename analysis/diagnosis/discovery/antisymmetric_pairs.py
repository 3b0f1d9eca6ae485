"""Antisymmetric pairs of forces between two axes: F_x = c v_y and F_y = -c v_x, or the same with positions.

With velocities such a pair is a gyroscopic or Lorentz force, with positions a circulatory force (Merkin, Introduction
to the Theory of Stability, 1997). A linear model has the symmetric coupling (coupled damping or stiffness) as a
parameter. A force on one axis alone is half symmetric, half antisymmetric, and that parameter imitates the symmetric
half; therefore both forces of a pair are fitted together.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import combinations, product

import numpy as np

from analysis.diagnosis.discovery.fit_sum import Sum, fit_sum
from analysis.diagnosis.discovery.grammar import AXES, Term
from analysis.diagnosis.discovery.law_of_sum import hypothesis_of_sum, laws_of
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.screen_terms import products_of
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import combine, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.discovered_law import axis_names

_COUPLED = re.compile(rf"p0\*(v?)([{AXES}])")
"""Shape of a force that is linear in the motion of an axis; used for another axis than that of the force."""
_BEGINS = 1e-9
"""Size with which the opposite force begins in a fit, relative to the force."""


def antisymmetric_pairs(views: Sequence[View]) -> Iterator[Sum]:
    """Antisymmetric sums of all pairs of axes whose two halves, fitted alone, have opposite signs."""
    forces = [view for view in views if view.acts_on == "force"][: len(AXES)]
    for (first, other), prefix in product(combinations(forces, 2), ("v", "")):
        halves = [
            fit_sum(products_of(view), (Term(prefix + AXES[across.axis]),))
            for view, across in ((first, other), (other, first))
        ]
        own, partner = halves
        if own is None or partner is None or own.factors[0] * partner.factors[0] >= 0:
            continue
        factor = (own.factors[0] - partner.factors[0]) / 2
        yield _pair(own, partner, factor)


def _pair(own: Sum, partner: Sum, factor: float) -> Sum:
    """Both halves as one sum with opposite factors; its errors are the means of the halves'."""
    return replace(
        own, factors=(factor,), cross_validated=(own.cross_validated + partner.cross_validated) / 2,
        without=(own.without + partner.without) / 2, spread=max(own.spread, partner.spread),
        partner=replace(partner, factors=(-factor,)),
    )  # fmt: skip


def pair_starts(pair: Sum) -> tuple[Sum, ...]:
    """Starting values of a pair's fit: as found, and with half of the factor. Where the model couples the axes, each
    half was fitted together with the coupled parameter, which took the other half: its factor is twice too large."""
    assert pair.partner is not None
    half, opposite = pair.factors[0] / 2, replace(pair.partner, factors=(pair.partner.factors[0] / 2,))
    return pair, replace(pair, factors=(half,), partner=opposite)


def is_coupling(of: Sum) -> bool:
    """Whether the sum is a force with a single term, linear in the motion of an axis."""
    return of.acts_on == "force" and len(of.terms) == 1 and bool(_COUPLED.fullmatch(f"p0*{of.terms[0].shape}"))


def sum_squares_of_coupling(tuning: Tuning, fitted: Fitted) -> float:
    """Sum of squares of the deviations of the model's coupled damping and stiffness from their calibration."""
    m = tuning.model.inputs
    places = [
        _find_coupled_parameter(tuning, prefix, i, j) for prefix in ("v", "") for i, j in combinations(range(m), 2)
    ]
    return float(np.sum(fitted.deviations[places] ** 2))


def as_pair(measure: ErrorMeasure, tuning: Tuning, single: tuple[Fitted, Sum], pair: Sum) -> Fitted | None:
    """The fit of one force as a pair of half its size: the model's coupled parameter takes the symmetric half, so that
    both predict the same. None where force and pair depend on different motions, or the parameter would leave its
    bounds."""
    fitted, of = single
    assert pair.partner is not None
    halves = {(half.axis, half.terms[0].shape): half for half in (replace(pair, partner=None), pair.partner)}
    if halves.pop((of.axis, of.terms[0].shape), None) is None:
        return None
    (other,) = halves.values()
    size = laws_of(fitted.hypothesis)[-1].numbers[0]  # type: ignore[union-attr]
    law = hypothesis_of_sum(replace(other, factors=(-_BEGINS * size,)), measure.records[0].recording)
    begun = replace(fitted, hypothesis=combine(fitted.hypothesis, law))
    found = with_equal_halves(measure, tuning, begun)
    return None if found is begun else found


def with_equal_halves(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> Fitted:
    """The fit with the factors of each pair made antisymmetric: their mean is added to the model's coupled parameter,
    which is the symmetric part. Unchanged where there is no pair, or the parameter would leave its bounds."""
    found = _find_coupled_laws(fitted, measure.records[0].recording.command.channels)
    values, deviations = (
        [dict(placed.values) for placed in fitted.hypothesis.list_placed_effects()],
        fitted.deviations.copy(),
    )
    for (prefix, axis, other), (claim, factor) in found.items():
        partner, opposite = found.get((prefix, other, axis), (claim, 0.0))
        if axis < other and factor * opposite < 0:
            shared, number = (factor + opposite) / 2, _find_coupled_parameter(tuning, prefix, axis, other)
            deviations[number] -= shared / tuning.deviation[number]
            values[claim]["p0"], values[partner]["p0"] = factor - shared, opposite - shared
    if (deviations == fitted.deviations).all() or np.abs(deviations).max() > tuning.bound:
        return fitted
    parts = zip(fitted.hypothesis.claims, values, strict=True)
    hypothesis = reduce(combine, [hypothesis_of_claim(claim, [own]) for claim, own in parts])
    return evaluate_fit(measure, tuning, deviations, hypothesis)


def is_taken_by_coupling(tuning: Tuning, fitted: Fitted, inputs: tuple[str, ...]) -> bool:
    """Whether a law is linear in the motion of another axis, and the model's coupled damping or stiffness could imitate
    it: always for a force on a single axis; for an antisymmetric pair, if half of it is within the bound of re-tuning.
    inputs: command channels."""
    found = _find_coupled_laws(fitted, inputs)
    for (prefix, axis, other), (_, factor) in found.items():
        opposite = found.get((prefix, other, axis), (0, 0.0))[1]
        half = abs(factor - opposite) / 2 if factor * opposite < 0 else 0.0
        number = _find_coupled_parameter(tuning, prefix, axis, other)
        if half / tuning.deviation[number] - abs(fitted.deviations[number]) <= tuning.bound:
            return True
    return False


def _find_coupled_laws(fitted: Fitted, inputs: tuple[str, ...]) -> dict[tuple[str, int, int], tuple[int, float]]:
    """Claim and factor of each force that is linear in the motion of another axis, by prefix of the motion ("v" or
    empty), own axis and other axis."""
    names, found = axis_names(inputs), {}
    for number, (claim, law) in enumerate(zip(fitted.hypothesis.claims, laws_of(fitted.hypothesis), strict=True)):
        linear = None if law is None or law.acts_on != "force" else _COUPLED.fullmatch(law.expression)
        if law is not None and linear is not None:
            found[linear[1], claim.sites[0], names.index(linear[2])] = (number, law.numbers[0])
    return found


def _find_coupled_parameter(tuning: Tuning, prefix: str, axis: int, other: int) -> int:
    """Index among the model's parameters of the coupled damping (prefix v) or stiffness of two axes."""
    m = tuning.model.inputs
    pairs = [(i, j) for i in range(m) for j in range(i, m)]
    return (1 if prefix else 2) * len(pairs) + pairs.index((min(axis, other), max(axis, other)))
