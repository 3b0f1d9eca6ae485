"""Antisymmetric pairs of forces between two axes: F_x = c v_y and F_y = -c v_x, or the same with positions.

With velocities such a pair is a gyroscopic or Lorentz force, with positions a circulatory force (Merkin, Introduction
to the Theory of Stability, 1997). A linear model has the symmetric coupling (coupled damping or stiffness) as a
parameter. A force on one axis alone is half symmetric, half antisymmetric, and that parameter absorbs the symmetric
half; therefore both forces of a pair are fitted together. Called by `discover`.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import combinations, product

import numpy as np

from analysis.diagnosis.discovery.fit_sum import Sum, fit_sum
from analysis.diagnosis.discovery.grammar import AXES, Term
from analysis.diagnosis.discovery.law_of_sum import convert_sum_to_hypothesis, list_fitted_laws
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.screen_terms import products_of
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import combine, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.discovered_law import axis_names

_COUPLED = re.compile(rf"p0\*(v?)([{AXES}])")
"""Formula of a force that is linear in the motion of an axis, here of another axis than that of the force."""
_START_SHARE = 1e-9
"""Size with which the opposite force begins in a fit, relative to the force."""


def find_antisymmetric_pairs(views: Sequence[View]) -> Iterator[Sum]:
    """Antisymmetric sums of all pairs of axes whose two halves, fitted alone, have opposite signs."""
    forces = [view for view in views if view.acts_on == "force"][: len(AXES)]
    for (first_view, second_view), prefix in product(combinations(forces, 2), ("v", "")):
        halves = [
            fit_sum(products_of(view), (Term(prefix + AXES[coupled_view.axis]),))
            for view, coupled_view in ((first_view, second_view), (second_view, first_view))
        ]
        force, partner = halves
        if force is None or partner is None or force.factors[0] * partner.factors[0] >= 0:
            continue
        factor = (force.factors[0] - partner.factors[0]) / 2
        yield _combine_halves(force, partner, factor)


def _combine_halves(force: Sum, partner: Sum, factor: float) -> Sum:
    """Both halves as one sum with opposite factors; its errors are the means of the halves'."""
    return replace(
        force, factors=(factor,), cross_validated=(force.cross_validated + partner.cross_validated) / 2,
        base_error=(force.base_error + partner.base_error) / 2, spread=max(force.spread, partner.spread),
        partner=replace(partner, factors=(-factor,)),
    )  # fmt: skip


def list_pair_starts(pair: Sum) -> tuple[Sum, ...]:
    """Starting values of a pair's fit: as found, and with half of the factor. Where the model couples the axes, each
    half was fitted with the coupled parameter, which absorbed the other half, so that its factor is twice too large."""
    assert pair.partner is not None
    half, opposite = pair.factors[0] / 2, replace(pair.partner, factors=(pair.partner.factors[0] / 2,))
    return pair, replace(pair, factors=(half,), partner=opposite)


def is_coupling(term_sum: Sum) -> bool:
    """Whether the sum is a force with a single term, linear in the motion of an axis."""
    return (
        term_sum.acts_on == "force"
        and len(term_sum.terms) == 1
        and bool(_COUPLED.fullmatch(f"p0*{term_sum.terms[0].shape}"))
    )


def sum_squared_coupling_deviations(tuning: Tuning, fitted: Fitted) -> float:
    """Sum of squares of the deviations of the model's coupled damping and stiffness from their calibration."""
    m = tuning.model.inputs
    parameter_indices = [
        _find_coupled_parameter(tuning, prefix, i, j) for prefix in ("v", "") for i, j in combinations(range(m), 2)
    ]
    return float(np.sum(fitted.deviations[parameter_indices] ** 2))


def convert_to_pair(measure: ErrorMeasure, tuning: Tuning, single: tuple[Fitted, Sum], pair: Sum) -> Fitted | None:
    """The fit of one force as a pair of half its size: the model's coupled parameter absorbs the symmetric half; the
    prediction is the same. None where force and pair depend on different motions, or the parameter would leave its
    bounds."""
    fitted, term_sum = single
    assert pair.partner is not None
    halves = {(half.axis, half.terms[0].shape): half for half in (replace(pair, partner=None), pair.partner)}
    if halves.pop((term_sum.axis, term_sum.terms[0].shape), None) is None:
        return None
    (opposite_half,) = halves.values()
    size = list_fitted_laws(fitted.hypothesis)[-1].numbers[0]  # type: ignore[union-attr]
    law = convert_sum_to_hypothesis(
        replace(opposite_half, factors=(-_START_SHARE * size,)), measure.records[0].recording
    )
    start = replace(fitted, hypothesis=combine(fitted.hypothesis, law))
    antisymmetric = make_antisymmetric(measure, tuning, start)
    return None if antisymmetric is start else antisymmetric


def make_antisymmetric(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> Fitted:
    """The fit with the factors of each pair made antisymmetric: their mean is added to the model's coupled parameter,
    which is the symmetric part. Unchanged where there is no pair, or the parameter would leave its bounds."""
    couplings = _find_coupled_laws(fitted, measure.records[0].recording.command.channels)
    values, deviations = (
        [dict(placed_effect.values) for placed_effect in fitted.hypothesis.list_placed_effects()],
        fitted.deviations.copy(),
    )
    for (prefix, axis, coupled_axis), (claim, factor) in couplings.items():
        partner, opposite = couplings.get((prefix, coupled_axis, axis), (claim, 0.0))
        if axis < coupled_axis and factor * opposite < 0:
            shared, parameter_index = (
                (factor + opposite) / 2,
                _find_coupled_parameter(tuning, prefix, axis, coupled_axis),
            )
            deviations[parameter_index] -= shared / tuning.deviation[parameter_index]
            values[claim]["p0"], values[partner]["p0"] = factor - shared, opposite - shared
    if (deviations == fitted.deviations).all() or np.abs(deviations).max() > tuning.bound:
        return fitted
    parts = zip(fitted.hypothesis.claims, values, strict=True)
    hypothesis = reduce(combine, [hypothesis_of_claim(claim, [claim_values]) for claim, claim_values in parts])
    return evaluate_fit(measure, tuning, deviations, hypothesis)


def can_coupling_imitate(tuning: Tuning, fitted: Fitted, inputs: tuple[str, ...]) -> bool:
    """Whether a law is linear in the motion of another axis, and the model's coupled damping or stiffness could imitate
    it: always for a force on a single axis; for an antisymmetric pair, if half of it is within the bound of re-tuning.
    inputs: command channels."""
    couplings = _find_coupled_laws(fitted, inputs)
    for (prefix, axis, coupled_axis), (_, factor) in couplings.items():
        opposite = couplings.get((prefix, coupled_axis, axis), (0, 0.0))[1]
        half = abs(factor - opposite) / 2 if factor * opposite < 0 else 0.0
        number = _find_coupled_parameter(tuning, prefix, axis, coupled_axis)
        if half / tuning.deviation[number] - abs(fitted.deviations[number]) <= tuning.bound:
            return True
    return False


def _find_coupled_laws(fitted: Fitted, inputs: tuple[str, ...]) -> dict[tuple[str, int, int], tuple[int, float]]:
    """Claim and factor of each force that is linear in the motion of another axis, by prefix of the motion ("v" or
    empty), own axis and other axis."""
    names, couplings = axis_names(inputs), {}
    for number, (claim, law) in enumerate(
        zip(fitted.hypothesis.claims, list_fitted_laws(fitted.hypothesis), strict=True)
    ):
        linear = None if law is None or law.acts_on != "force" else _COUPLED.fullmatch(law.expression)
        if law is not None and linear is not None:
            couplings[linear[1], claim.sites[0], names.index(linear[2])] = (number, law.numbers[0])
    return couplings


def _find_coupled_parameter(tuning: Tuning, prefix: str, axis: int, coupled_axis: int) -> int:
    """Index among the model's parameters of the coupled damping (prefix v) or stiffness of two axes."""
    m = tuning.model.inputs
    pairs = [(i, j) for i in range(m) for j in range(i, m)]
    return (1 if prefix else 2) * len(pairs) + pairs.index((min(axis, coupled_axis), max(axis, coupled_axis)))
