"""Ranks hypotheses by the gain that a linear model about their starting values predicts, one simulation each.

With e the errors of the base and c the change of the prediction at a hypothesis's starting values, the error of a fit
is taken to be e - S d - c s, linear in d, the change of the model's own parameters (sensitivity S), and in s, a factor
on the hypothesis's effect. The step z = (d, s) that minimises |e - S d - c s|² + |d0 + d|² within its bounds removes

    2 z'g - z'P z        P = [[S'S + I, S'c], [c'S, c'c]],   g = (S'e - d0, c'e),   d0 the base's deviations

from the cost's sum (Draper and Smith, Applied Regression Analysis, 1998, ch. 6: extra sum of squares).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import Hypothesis, combine
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, residuals_to_fit, solve_bounded_step
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.settings import STRONGEST_START, WEAKEST_START
from analysis.diagnosis.types import Mapper


@dataclass(frozen=True, slots=True, eq=False)
class ScreenedHypothesis:
    """A hypothesis with the cost that the linear model predicts for its fit."""

    hypothesis: Hypothesis
    """The suggested effect together with those that are held already."""
    cost: float
    """`Fitted.cost` predicted by linearisation at the starting values."""


def screen(
    measure: ErrorMeasure,
    tuning: Tuning,
    base: Fitted,
    known: Sensitivity,
    suggested: Sequence[Hypothesis],
    map_: Mapper,
) -> tuple[ScreenedHypothesis, ...]:
    """The hypotheses with their predicted costs, the best first. known: sensitivity to the model's own parameters."""
    model = tuning.tune(base.deviations)
    errors = residuals_to_fit(measure, base.residuals)

    def predict(hypothesis: Hypothesis) -> ScreenedHypothesis:
        whole = combine(base.hypothesis, hypothesis)
        with np.errstate(over="ignore", invalid="ignore"):
            there = residuals_to_fit(measure, measure.residuals(model, whole.list_placed_effects()))
        return ScreenedHypothesis(whole, _predict_cost(base, known, errors, errors - there, tuning.bound))

    found: list[ScreenedHypothesis] = list(map_(predict, suggested))  # type: ignore[arg-type]
    return tuple(sorted(found, key=lambda screened: screened.cost))


def _predict_cost(base: Fitted, known: Sensitivity, errors: np.ndarray, change: np.ndarray, bound: float) -> float:
    """Predicted `Fitted.cost`; infinite where the simulation diverged or does not change. errors, change: (samples,)
    in units of the noise, e and c of the theory of operation."""
    with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
        strength = float(change @ change)
    if not (np.isfinite(strength) and strength > 0):
        return np.inf
    t = len(base.deviations)
    cross = known.on(change)
    products = np.block([[known.squares + np.eye(t), cross[:, None]], [cross[None, :], np.array([[strength]])]])
    gradient = np.concatenate([known.on(errors) - base.deviations, [float(change @ errors)]])
    low = np.concatenate([-bound - base.deviations, [WEAKEST_START]])
    high = np.concatenate([bound - base.deviations, [STRONGEST_START]])
    step = solve_bounded_step(products, gradient, low, high)
    gain = 2 * float(step @ gradient) - float(step @ products @ step)
    return base.cost - gain / len(errors)
