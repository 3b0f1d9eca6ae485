"""Rank hypotheses by the reduction of the cost that a linearised fit predicts; one simulation per hypothesis.

Let e be the prediction errors of the base fit, and c the change of the prediction by a hypothesis at its starting
values, both in units of the noise. The error of a fit is approximated by e - S d - c s, linear in d, the change of the
model's own parameters in standard deviations (sensitivity S), and in s, a factor on the effect. The step z = (d, s)
that minimises |e - S d - c s|² + |d0 + d|² within its bounds reduces this sum, which is N times the cost, by

    2 z'g - z'P z        P = [[S'S + I, S'c], [c'S, c'c]],   g = (S'e - d0, c'e)

with d0 the deviations of the base (Draper and Smith, Applied Regression Analysis, 1998, ch. 6: extra sum of squares).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import Hypothesis, combine_hypotheses
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, solve_bounded_step, stack_fit_residuals
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.limits import STRONGEST_START, WEAKEST_START
from analysis.diagnosis.types import Mapper


@dataclass(frozen=True, slots=True, eq=False)
class ScreenedHypothesis:
    """A hypothesis with the cost that the linear model predicts for its fit."""

    hypothesis: Hypothesis
    """The suggested effect together with those of the base."""
    cost: float
    """`Fitted.cost` predicted by linearisation at the starting values."""


def screen(
    measure: ErrorMeasure,
    tuning: Tuning,
    base: Fitted,
    jacobian: Sensitivity,
    suggested: Sequence[Hypothesis],
    map_: Mapper,
) -> tuple[ScreenedHypothesis, ...]:
    """Predict the cost of each suggested hypothesis, combined with that of `base`; the lowest first. jacobian:
    sensitivity to the model's own parameters at `base`. map_: `map` or a parallel one, which calls one simulation per
    hypothesis."""
    model = tuning.tune(base.deviations)
    errors = stack_fit_residuals(measure, base.residuals)

    def screen_hypothesis(hypothesis: Hypothesis) -> ScreenedHypothesis:
        combined_hypothesis = combine_hypotheses(base.hypothesis, hypothesis)
        with np.errstate(over="ignore", invalid="ignore"):
            changed_errors = stack_fit_residuals(
                measure, measure.residuals(model, combined_hypothesis.list_placed_effects())
            )
        return ScreenedHypothesis(
            combined_hypothesis, _predict_cost(base, jacobian, errors, errors - changed_errors, tuning.bound)
        )

    screened_hypotheses: list[ScreenedHypothesis] = list(map_(screen_hypothesis, suggested))  # type: ignore[arg-type]
    return tuple(sorted(screened_hypotheses, key=lambda screened: screened.cost))


def _predict_cost(
    base: Fitted, jacobian: Sensitivity, errors: np.ndarray, prediction_change: np.ndarray, bound: float
) -> float:
    """Predict `Fitted.cost`; infinite where the simulation diverged or the effect does not change the prediction.
    errors, prediction_change: (samples,), e and c of the module's equation. bound: of each |d0 + d|, in standard
    deviations; s is bounded by `WEAKEST_START` and `STRONGEST_START`."""
    with np.errstate(over="ignore", invalid="ignore"):  # a diverged simulation overflows
        change_power = float(prediction_change @ prediction_change)
    if not (np.isfinite(change_power) and change_power > 0):
        return np.inf
    parameter_count = len(base.deviations)
    cross_products = jacobian.multiply(prediction_change)
    normal_matrix = np.block(
        [
            [jacobian.gram + np.eye(parameter_count), cross_products[:, None]],
            [cross_products[None, :], np.array([[change_power]])],
        ]
    )
    gradient = np.concatenate([jacobian.multiply(errors) - base.deviations, [float(prediction_change @ errors)]])
    lower_bounds = np.concatenate([-bound - base.deviations, [WEAKEST_START]])
    upper_bounds = np.concatenate([bound - base.deviations, [STRONGEST_START]])
    step = solve_bounded_step(normal_matrix, gradient, lower_bounds, upper_bounds)
    gain = 2 * float(step @ gradient) - float(step @ normal_matrix @ step)
    return base.cost - gain / len(errors)
