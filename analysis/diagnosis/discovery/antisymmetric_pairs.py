"""Antisymmetric pairs of forces between two axes: F_x = c v_y and F_y = -c v_x, or the same with positions.

With velocities such a pair is a gyroscopic or Lorentz force, with positions a circulatory force (Merkin, Introduction
to the Theory of Stability, 1997). A linear model has the symmetric coupling (coupled damping or stiffness) as a
parameter. A force on one axis alone is half symmetric, half antisymmetric, and that parameter absorbs the symmetric
half; therefore both forces of a pair are fitted together. Called by `discover`, `fit_laws` and `validation`.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import combinations, product

import numpy as np

from analysis.diagnosis.discovery.convert_sum import convert_sum_to_hypothesis, list_fitted_laws
from analysis.diagnosis.discovery.fit_sum import Sum, fit_sum
from analysis.diagnosis.discovery.grammar import AXES, Term
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.screen_terms import build_normal_equations
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.discovered_law import derive_axis_letters

_COUPLING_FORMULA = re.compile(rf"p0\*(v?)([{AXES}])")
"""Formula of a force that is linear in the motion of an axis; groups: "v" for velocity or nothing for position, and the
axis that moves."""
_START_SHARE = 1e-9
"""Factor with which the opposite force of a pair enters a fit, relative to the factor of the force: not 0, so that its
sign is known, and too small to change the prediction. Chosen by hand."""


def find_antisymmetric_pairs(views: Sequence[View]) -> Iterator[Sum]:
    """Find the antisymmetric sums for all pairs of axes, with velocities and with positions, whose two forces, fitted
    one at a time, have factors of opposite signs. views: one per axis and place; only those of forces are used."""
    forces = [view for view in views if view.acts_on == "force"][: len(AXES)]
    for (first_view, second_view), prefix in product(combinations(forces, 2), ("v", "")):
        halves = [
            fit_sum(build_normal_equations(view), (Term(prefix + AXES[coupled_view.axis]),))
            for view, coupled_view in ((first_view, second_view), (second_view, first_view))
        ]
        force, partner = halves
        if force is None or partner is None or force.factors[0] * partner.factors[0] >= 0:
            continue
        factor = (force.factors[0] - partner.factors[0]) / 2
        yield _combine_halves(force, partner, factor)


def _combine_halves(force: Sum, partner: Sum, factor: float) -> Sum:
    """Combine both forces to one sum with opposite factors; its errors are the means of the two fits."""
    return replace(
        force, factors=(factor,),
        cross_validated_error=(force.cross_validated_error + partner.cross_validated_error) / 2,
        base_error=(force.base_error + partner.base_error) / 2,
        factor_error=max(force.factor_error, partner.factor_error),
        partner=replace(partner, factors=(-factor,)),
    )  # fmt: skip


def list_pair_starts(pair: Sum) -> tuple[Sum, ...]:
    """List the starting values for the fit of a pair: with its factors, and with half of them. Where the model has a
    coupled parameter, each force was fitted together with it, and the parameter took the place of the other force: the
    factor is then twice the right one."""
    assert pair.partner is not None
    half_factor, partner_sum = pair.factors[0] / 2, replace(pair.partner, factors=(pair.partner.factors[0] / 2,))
    return pair, replace(pair, factors=(half_factor,), partner=partner_sum)


def is_coupling(term_sum: Sum) -> bool:
    """Whether the sum is a force with a single term, linear in the motion of an axis."""
    return (
        term_sum.acts_on == "force"
        and len(term_sum.terms) == 1
        and bool(_COUPLING_FORMULA.fullmatch(f"p0*{term_sum.terms[0].shape}"))
    )


def sum_squared_coupling_deviations(tuning: Tuning, fitted: Fitted) -> float:
    """Sum the squared deviations of the model's coupled damping and stiffness from their calibration, in standard
    deviations."""
    m = tuning.model.inputs
    parameter_indices = [
        _find_coupled_parameter(tuning, prefix, i, j) for prefix in ("v", "") for i, j in combinations(range(m), 2)
    ]
    return float(np.sum(fitted.deviations[parameter_indices] ** 2))


def convert_to_pair(measure: ErrorMeasure, tuning: Tuning, single: tuple[Fitted, Sum], pair: Sum) -> Fitted | None:
    """Rewrite the fit of a single force as a pair of half its factor with the same prediction: the model's coupled
    parameter takes the symmetric half. single: fit and sum of that force. None where force and pair depend on different
    motions, or the parameter cannot take that half."""
    fitted, term_sum = single
    assert pair.partner is not None
    halves = {(half.axis, half.terms[0].shape): half for half in (replace(pair, partner=None), pair.partner)}
    if halves.pop((term_sum.axis, term_sum.terms[0].shape), None) is None:
        return None
    (opposite_half,) = halves.values()
    force_factor = list_fitted_laws(fitted.hypothesis)[-1].numbers[0]  # type: ignore[union-attr]
    partner_hypothesis = convert_sum_to_hypothesis(
        replace(opposite_half, factors=(-_START_SHARE * force_factor,)), measure.records[0].recording
    )
    start = replace(fitted, hypothesis=combine_hypotheses(fitted.hypothesis, partner_hypothesis))
    antisymmetric = make_antisymmetric(measure, tuning, start)
    return None if antisymmetric is start else antisymmetric


def make_antisymmetric(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> Fitted:
    """Make the factors of each pair of a fit antisymmetric: their mean is added to the model's coupled parameter, which
    is the symmetric part. Unchanged where there is no pair, or the parameter cannot take the mean."""
    couplings = _find_coupled_laws(fitted, measure.records[0].recording.command.channels)
    values, deviations = (
        [dict(placed_effect.values) for placed_effect in fitted.hypothesis.list_placed_effects()],
        fitted.deviations.copy(),
    )
    for (prefix, axis, coupled_axis), (claim_index, factor) in couplings.items():
        partner_index, partner_factor = couplings.get((prefix, coupled_axis, axis), (claim_index, 0.0))
        parameter_index = _find_coupled_parameter(tuning, prefix, axis, coupled_axis)
        # A parameter with tolerance 0 cannot take it.
        if axis < coupled_axis and factor * partner_factor < 0 < tuning.deviation[parameter_index]:
            mean_factor = (factor + partner_factor) / 2
            deviations[parameter_index] -= mean_factor / tuning.deviation[parameter_index]
            values[claim_index]["p0"], values[partner_index]["p0"] = factor - mean_factor, partner_factor - mean_factor
    if (deviations == fitted.deviations).all() or np.abs(deviations).max() > tuning.bound:
        return fitted
    claims_with_values = zip(fitted.hypothesis.claims, values, strict=True)
    hypothesis = reduce(
        combine_hypotheses, [make_claim_hypothesis(claim, [claim_values]) for claim, claim_values in claims_with_values]
    )
    return evaluate_fit(measure, tuning, deviations, hypothesis)


def can_coupling_imitate(tuning: Tuning, fitted: Fitted, inputs: tuple[str, ...]) -> bool:
    """Whether the model's damping or stiffness could imitate a fitted law that is linear in the motion of an axis. A
    force on a single axis: always. An antisymmetric pair: if re-tuning within its bound can reach its factor. Neither
    where the parameter's tolerance is 0. inputs: command channels."""
    couplings = _find_coupled_laws(fitted, inputs)
    for (prefix, axis, coupled_axis), (_, factor) in couplings.items():
        partner_factor = couplings.get((prefix, coupled_axis, axis), (0, 0.0))[1]
        antisymmetric_factor = abs(factor - partner_factor) / 2 if factor * partner_factor < 0 else 0.0
        parameter_index = _find_coupled_parameter(tuning, prefix, axis, coupled_axis)
        deviation = tuning.deviation[parameter_index]
        if deviation > 0 and (
            antisymmetric_factor / deviation - abs(fitted.deviations[parameter_index]) <= tuning.bound
        ):
            return True
    return False


def _find_coupled_laws(fitted: Fitted, inputs: tuple[str, ...]) -> dict[tuple[str, int, int], tuple[int, float]]:
    """Find the index of the claim and the factor of each force that is linear in the motion of an axis, by prefix of
    the motion ("v" or empty), axis of the force and axis of the motion."""
    names, couplings = derive_axis_letters(inputs), {}
    for claim_index, (claim, law) in enumerate(
        zip(fitted.hypothesis.claims, list_fitted_laws(fitted.hypothesis), strict=True)
    ):
        formula_match = None if law is None or law.acts_on != "force" else _COUPLING_FORMULA.fullmatch(law.expression)
        if law is not None and formula_match is not None:
            couplings[formula_match[1], claim.sites[0], names.index(formula_match[2])] = (claim_index, law.numbers[0])
    return couplings


def _find_coupled_parameter(tuning: Tuning, prefix: str, axis: int, coupled_axis: int) -> int:
    """Find the index among the model's parameters of the coupled damping (prefix v) or stiffness of two axes."""
    m = tuning.model.inputs
    pairs = [(i, j) for i in range(m) for j in range(i, m)]
    return (1 if prefix else 2) * len(pairs) + pairs.index((min(axis, coupled_axis), max(axis, coupled_axis)))
