"""Fits the free parameters of a sum of terms to a fit's residual: Gauss-Newton with variable projection.

The residual is approximated by P d + sum of w_j phi_j(a_j): P the columns of the model's own parameters, w the factors
and a the nonlinear parameters of the terms. At each step, d and w are solved for by least squares, so that only a is
searched (variable projection, Golub and Pereyra 1973). Held-out errors are cross-validated over blocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.discovery.evaluate_shape import evaluate_shape
from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.screen_terms import Products, Solution, add_columns, cross_validate_terms, solve
from equalizer.laws.law import ActsOn
from equalizer.signals.signal import FloatArray

_STEP, _STEP_OF_FREQUENCY = 1e-3, 1e-5
"""Steps of the finite differences, absolute or relative (`_shift_parameter`). The factor of time, a frequency, has the
smaller step, because a change of 0.1 % would shift the phase too far at the end of a recording."""
_ROUNDS = 8
"""Largest number of Gauss-Newton steps."""
_CONVERGED = 1e-3
"""Relative decrease of the cost below which a step is the last."""


@dataclass(frozen=True, slots=True, eq=False)
class Sum:
    """A fitted sum of terms on an axis or a reading, with its cross-validated error."""

    axis: int
    """Driven axis, or channel of the response."""
    terms: tuple[Term, ...]
    factors: tuple[float, ...]
    """(terms,): factor of each term, in SI units."""
    cross_validated: float
    """Held-out squares over the noise's, per sample: 1 = noise alone."""
    base_error: float
    """Held-out squares of the re-tuned model alone, in the same unit."""
    spread: float
    """Jackknife standard error of the first factor over the blocks, relative to it."""
    model_shift: tuple[float, ...]
    """(t,): change of the model's own parameters that is fitted with it, in standard deviations."""
    acts_on: ActsOn = "force"
    partner: "Sum | None" = None
    """Second force of an antisymmetric pair, on another axis; None for a single force."""

    @property
    def variables(self) -> tuple[str, ...]:
        """Signals in the terms and in those of the partner, sorted."""
        names = frozenset[str]().union(*(term.variables for term in self.terms))
        return tuple(sorted(names.union(() if self.partner is None else self.partner.variables)))


def column_of(view: View, term: Term) -> FloatArray | None:
    """(s,): the term through the view's filter; None where it is not finite."""
    parts = []
    for record in view.records:
        force = evaluate_shape(term.shape, term.numbers, record.columns, record.rate_hz)
        if not np.isfinite(force).all():
            return None
        parts.append(record.column(force, view.output))
    return np.concatenate(parts)


def fit_sum(base: Products, terms: Sequence[Term]) -> Sum | None:
    """The sum with its parameters, factors and held-out errors. base: products of the model's parameters alone. None
    where the terms are not finite at their starting parameters."""
    view = base.view
    point = _Point(tuple(terms), *_columns(view, terms))
    if point.columns is None:
        return None
    best = _solve_columns(base, point.columns)
    for _ in range(_ROUNDS if any(term.numbers for term in terms) else 0):
        improved = _gauss_newton_step(base, point, best)
        if improved is None:
            break
        decrease = 1 - improved[1].cost / best.cost
        point, best = improved
        if decrease < _CONVERGED:
            break
    assert point.columns is not None
    return _score_sum(base, point.terms, point.columns, best)


def _score_sum(base: Products, terms: tuple[Term, ...], columns: Sequence[FloatArray], best: Solution) -> Sum:
    """The sum with cross-validated errors and the jackknife error of its first factor."""
    view = base.view
    base_and_others = add_columns(base, columns[1:])
    joint_errors = cross_validate_terms(base_and_others, columns[0][None, :])
    single_errors = cross_validate_terms(base, columns[0][None, :])
    size = view.noise * len(view.residual)
    factors = joint_errors.factors[:, 0]
    spread = float(np.std(factors) * np.sqrt(len(factors) - 1) / max(abs(float(np.mean(factors))), 1e-300))
    return Sum(
        view.axis,
        terms,
        tuple(best.weights[len(view.parameter_columns) :].tolist()),
        float(joint_errors.term_squares.sum()) / size,
        float(single_errors.base_squares.sum()) / size,
        spread,
        tuple(best.weights[: len(view.parameter_columns) - 1].tolist()),
        view.acts_on,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """Terms with their present parameters, and their columns (s,); None where a column is not finite."""

    terms: tuple[Term, ...]
    columns: tuple[FloatArray, ...] | None


def _columns(view: View, terms: Sequence[Term]) -> tuple[tuple[FloatArray, ...] | None]:
    columns = [column_of(view, term) for term in terms]
    return (None if any(column is None for column in columns) else tuple(c for c in columns if c is not None),)


def _solve_columns(base: Products, columns: Sequence[FloatArray]) -> Solution:
    """Least squares with the model's own parameters and these columns."""
    return solve(add_columns(base, columns))


def _gauss_newton_step(base: Products, point: _Point, best: Solution) -> tuple[_Point, Solution] | None:
    """A Gauss-Newton step, shortened until the cost falls; None where it does not fall or nothing is nonlinear."""
    view, k = base.view, len(base.view.parameter_columns)
    assert point.columns is not None
    factors = best.weights[k:]
    parameters, slopes = [], []
    for number, term in enumerate(point.terms):
        for parameter_index in range(len(term.numbers)):
            shift = _STEP_OF_FREQUENCY if f"p{parameter_index}*t" in term.shape else _STEP
            column = column_of(view, _shift_parameter(term, parameter_index, shift))
            if column is None:
                return None
            slopes.append(factors[number] * (column - point.columns[number]) / shift)
            parameters.append((number, parameter_index))
    if not parameters:
        return None
    sizes = np.array([max(float(np.linalg.norm(slope)), 1e-300) for slope in slopes])
    joint = add_columns(base, [*point.columns, *(slope / size for slope, size in zip(slopes, sizes, strict=True))])
    damped = solve(_damp_slopes(joint, len(slopes)))
    step = np.clip(damped.weights[-len(slopes) :] / sizes, -0.7, 0.7)
    for share in (1.0, 0.4, 0.15, 0.05):
        terms = point.terms
        for (number, parameter_index), shift in zip(parameters, step, strict=True):
            shifted_term = _shift_parameter(terms[number], parameter_index, share * float(shift))
            terms = (*terms[:number], shifted_term, *terms[number + 1 :])
        columns = _columns(view, terms)[0]
        if columns is None:
            continue
        candidate = _solve_columns(base, columns)
        if candidate.cost < best.cost * (1 - 1e-6):
            return _Point(terms, columns), candidate
    return None


def _damp_slopes(joint: Products, count: int) -> Products:
    """Levenberg damping of the slopes (of norm 1), so that slopes nearly collinear with other columns make no step."""
    squares = joint.squares.copy()
    slope_indices = np.arange(squares.shape[1] - count, squares.shape[1])
    squares[:, slope_indices, slope_indices] += 1e-4 / len(squares)
    return replace(joint, squares=squares)


def _shift_parameter(term: Term, parameter_index: int, shift: float) -> Term:
    """The term with a parameter moved within its bounds: exponents and angles by `shift`, others by a factor
    exp(shift)."""
    numbers, (low, high) = list(term.numbers), term.bounds[parameter_index]
    value = numbers[parameter_index]
    is_additive = parameter_index in term.exponents or parameter_index in term.angles
    numbers[parameter_index] = min(max(value + shift if is_additive else value * float(np.exp(shift)), low), high)
    return replace(term, numbers=tuple(numbers))
