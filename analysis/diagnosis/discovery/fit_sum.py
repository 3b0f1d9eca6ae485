"""Fits the free parameters of a sum of terms to a fit's residual: Gauss-Newton with variable projection.

The residual is approximated by P d + sum of w_j phi_j(a_j): P the columns of the model's own parameters, w the factors
and a the nonlinear parameters of the terms. At each step, d and w are solved for by least squares, so that only a is
searched (variable projection, Golub and Pereyra, SIAM J. Numer. Anal. 10:413, 1973). Held-out errors are
cross-validated over blocks. Called by `beam`, `antisymmetric_pairs` and `discover`. Sizes: s samples of the view's
residual, t parameters of the model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.discovery.evaluate_shape import evaluate_shape
from analysis.diagnosis.discovery.grammar import CONSTANT, Term
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.screen_terms import (
    NormalEquations,
    Solution,
    add_columns,
    build_normal_equations,
    cross_validate_terms,
    solve_all_blocks,
)
from equalizer.laws.law import ActsOn
from equalizer.signals.signal import FloatArray

_DIFFERENCE_STEP, _FREQUENCY_DIFFERENCE_STEP = 1e-3, 1e-5
"""Steps of the finite differences, absolute or relative (`_shift_parameter`); chosen by hand. The factor of time, a
frequency, has the smaller step, because a change of 0.1 % would shift the phase too far at the end of a recording."""
_MOST_GAUSS_NEWTON_STEPS = 8
"""Largest number of Gauss-Newton steps; chosen by hand."""
_LEAST_DECREASE = 1e-3
"""Relative decrease of the cost below which a step is the last; chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Sum:
    """A fitted sum of terms on an axis or a reading, with its cross-validated error."""

    axis: int
    """Index of the driven axis, or of the response's channel."""
    terms: tuple[Term, ...]
    """With their fitted parameters."""
    factors: tuple[float, ...]
    """(terms,): factor of each term, in SI units."""
    cross_validated_error: float
    """Held-out squares over the noise's, per sample: 1 = noise alone."""
    base_error: float
    """Held-out squares of the re-tuned model alone, in the same unit."""
    factor_error: float
    """Jackknife standard error of the first factor over the blocks, relative to it."""
    model_shift: tuple[float, ...]
    """(t,): change of the model's own parameters that is fitted with it, in standard deviations."""
    acts_on: ActsOn = "force"
    """Whether the sum is a force along the axis, or added to the response."""
    partner: "Sum | None" = None
    """Second force of an antisymmetric pair, on another axis; None for a single force."""

    @property
    def variables(self) -> tuple[str, ...]:
        """Signals in the terms and in those of the partner, sorted."""
        signal_names = frozenset[str]().union(*(term.variables for term in self.terms))
        return tuple(sorted(signal_names.union(() if self.partner is None else self.partner.variables)))


def compute_term_column(view: View, term: Term) -> FloatArray | None:
    """Compute (s,): the term along all records, filtered as the view's residual, joined; None where it is not finite
    before the filter."""
    filtered_by_record = []
    for record in view.records:
        force = evaluate_shape(term.shape, term.numbers, record.columns, record.rate_hz)
        if not np.isfinite(force).all():
            return None
        filtered_by_record.append(record.compute_column(force, view.output))
    return np.concatenate(filtered_by_record)


def fit_sum(model_equations: NormalEquations, terms: Sequence[Term]) -> Sum | None:
    """Fit a sum of terms (at least one): its nonlinear parameters, factors and held-out errors. model_equations: normal
    equations of the model's own parameters and the constant. None where a term is not finite at its starting
    parameters."""
    view = model_equations.view
    evaluated_terms = _EvaluatedTerms(tuple(terms), *_compute_term_columns(view, terms))
    if evaluated_terms.columns is None:
        return None
    solution = _solve_columns(model_equations, evaluated_terms.columns)
    for _ in range(_MOST_GAUSS_NEWTON_STEPS if any(term.numbers for term in terms) else 0):
        next_step = _take_gauss_newton_step(model_equations, evaluated_terms, solution)
        if next_step is None:
            break
        decrease = 1 - next_step[1].cost / solution.cost
        evaluated_terms, solution = next_step
        if decrease < _LEAST_DECREASE:
            break
    assert evaluated_terms.columns is not None
    return _score_sum(model_equations, evaluated_terms.terms, evaluated_terms.columns, solution)


def fit_constant(view: View) -> Sum | None:
    """Fit a constant as the only term, with the constant of the regression replaced by zeros. None as in `fit_sum`."""
    columns_without = np.vstack([view.parameter_columns[:-1], np.zeros_like(view.residual)])
    return fit_sum(build_normal_equations(replace(view, parameter_columns=columns_without)), (Term(CONSTANT),))


def _score_sum(
    model_equations: NormalEquations, terms: tuple[Term, ...], columns: Sequence[FloatArray], solution: Solution
) -> Sum:
    """Compute the cross-validated errors of the fitted terms, and the jackknife error of the first factor."""
    view = model_equations.view
    other_equations = add_columns(model_equations, columns[1:])
    joint_errors = cross_validate_terms(other_equations, columns[0][None, :])
    single_errors = cross_validate_terms(model_equations, columns[0][None, :])
    noise_squares = view.noise * len(view.residual)
    factors = joint_errors.factors[:, 0]
    relative_error = float(np.std(factors) * np.sqrt(len(factors) - 1) / max(abs(float(np.mean(factors))), 1e-300))
    return Sum(
        view.axis,
        terms,
        tuple(solution.weights[len(view.parameter_columns) :].tolist()),
        float(joint_errors.term_squares.sum()) / noise_squares,
        float(single_errors.base_squares.sum()) / noise_squares,
        relative_error,
        tuple(solution.weights[: len(view.parameter_columns) - 1].tolist()),
        view.acts_on,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _EvaluatedTerms:
    """Terms with parameter values, and their columns (s,) there; None where a column is not finite."""

    terms: tuple[Term, ...]
    columns: tuple[FloatArray, ...] | None


def _compute_term_columns(view: View, terms: Sequence[Term]) -> tuple[tuple[FloatArray, ...] | None]:
    """Compute the second field of `_EvaluatedTerms`, as a tuple of length one: the columns of all terms; None where one
    is not finite."""
    columns = [compute_term_column(view, term) for term in terms]
    return (
        None
        if any(column is None for column in columns)
        else tuple(finite_column for finite_column in columns if finite_column is not None),
    )


def _solve_columns(model_equations: NormalEquations, columns: Sequence[FloatArray]) -> Solution:
    """Solve for the weights of the model's own parameters and these columns by least squares."""
    return solve_all_blocks(add_columns(model_equations, columns))


def _take_gauss_newton_step(
    model_equations: NormalEquations, evaluated: _EvaluatedTerms, solution: Solution
) -> tuple[_EvaluatedTerms, Solution] | None:
    """Take a Gauss-Newton step in the nonlinear parameters, each changed by at most 0.7 (`_shift_parameter`). The step
    is shortened to 40, 15 and 5 % until the cost falls by more than 1e-6 of it (all chosen). None where it does not
    fall, a shifted term is not finite, or no parameter is nonlinear."""
    view, model_column_count = model_equations.view, len(model_equations.view.parameter_columns)
    assert evaluated.columns is not None
    term_factors = solution.weights[model_column_count:]
    parameter_indices, slopes = [], []
    for term_index, term in enumerate(evaluated.terms):
        for parameter_index in range(len(term.numbers)):
            shift = _FREQUENCY_DIFFERENCE_STEP if f"p{parameter_index}*t" in term.shape else _DIFFERENCE_STEP
            column = compute_term_column(view, _shift_parameter(term, parameter_index, shift))
            if column is None:
                return None
            slopes.append(term_factors[term_index] * (column - evaluated.columns[term_index]) / shift)
            parameter_indices.append((term_index, parameter_index))
    if not parameter_indices:
        return None
    slope_norms = np.array([max(float(np.linalg.norm(slope)), 1e-300) for slope in slopes])
    joint_equations = add_columns(
        model_equations,
        [*evaluated.columns, *(slope / slope_norm for slope, slope_norm in zip(slopes, slope_norms, strict=True))],
    )
    damped_solution = solve_all_blocks(_damp_slopes(joint_equations, len(slopes)))
    parameter_step = np.clip(damped_solution.weights[-len(slopes) :] / slope_norms, -0.7, 0.7)
    for step_share in (1.0, 0.4, 0.15, 0.05):
        terms = evaluated.terms
        for (term_index, parameter_index), shift in zip(parameter_indices, parameter_step, strict=True):
            shifted_term = _shift_parameter(terms[term_index], parameter_index, step_share * float(shift))
            terms = (*terms[:term_index], shifted_term, *terms[term_index + 1 :])
        columns = _compute_term_columns(view, terms)[0]
        if columns is None:
            continue
        candidate_solution = _solve_columns(model_equations, columns)
        if candidate_solution.cost < solution.cost * (1 - 1e-6):
            return _EvaluatedTerms(terms, columns), candidate_solution
    return None


def _damp_slopes(joint_equations: NormalEquations, slope_count: int) -> NormalEquations:
    """Add Levenberg's damping to the slopes (of norm 1), so that slopes nearly collinear with other columns make a
    small step: 1e-4 (chosen) on the diagonal of the sum over blocks."""
    damped_gram = joint_equations.gram.copy()
    slope_indices = np.arange(damped_gram.shape[1] - slope_count, damped_gram.shape[1])
    damped_gram[:, slope_indices, slope_indices] += 1e-4 / len(damped_gram)
    return replace(joint_equations, gram=damped_gram)


def _shift_parameter(term: Term, parameter_index: int, shift: float) -> Term:
    """Change a parameter of a term within its bounds: exponents and angles by `shift` (angles in rad), others by a
    factor exp(shift)."""
    numbers, (low, high) = list(term.numbers), term.bounds[parameter_index]
    value = numbers[parameter_index]
    is_additive = parameter_index in term.exponents or parameter_index in term.angles
    numbers[parameter_index] = min(max(value + shift if is_additive else value * float(np.exp(shift)), low), high)
    return replace(term, numbers=tuple(numbers))
