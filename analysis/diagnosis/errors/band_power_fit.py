"""Robust Gauss-Newton least squares on band powers, for the parameters of a hypothesis and of the model.

With the differences e of ln a, measured less predicted (`band_power`), and deviations d of the model's own parameters,

    J = (sum of rho(e / s) + d'd) / N        s² = spread² + SPREAD_FLOOR²
    rho(x) = x² for |x| <= k, else k (2 |x| - k)        k = HUBER_THRESHOLD

with Huber's loss rho (Huber, Ann. Math. Stat. 35:73, 1964) over the N fitted bands. Simulations of impacts are chaotic:
the spread of ln a between simulations whose parameters differ by rounding sets the weights, and derivatives are central
differences over large steps. All constants are chosen by hand.
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.hypothesis import FreeParameter, Hypothesis
from analysis.diagnosis.errors.output_error import solve_bounded_step
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.types import Mapper
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.signal import FloatArray

STEP_LIMITS, STEP_RATIO = (0.02, 0.2), 12.0
"""Least and largest finite-difference step of a logarithmic parameter; and its ratio to `FreeParameter.difference_step`
between these limits."""
LONGEST_STEP = 0.5
"""Largest Gauss-Newton step of a logarithmic parameter; for others it is two finite-difference steps."""
MOST_CHANCE_SHARE = 0.8
"""Largest share of a parameter's information that is attributed to the chaotic scatter of its finite differences."""
LEAST_INFORMATION = 1e-6
"""Lower limit of the information on a combination of parameters to which the prediction is not sensitive."""
STEP_FACTORS = (1.0, 0.3, 0.1, 0.03)
"""Factors on a step that are tried in turn (line search)."""
SPREAD_FLOOR = 0.04
"""Least standard deviation of ln a that is assumed, besides the spread."""
HUBER_THRESHOLD = 2.0
"""Threshold k of Huber's loss, in standard deviations. The loss is robust, because effects other than the fitted one
may be missing."""
CONVERGED_SHARE = 1e-4
"""Relative decrease of the cost below which the fit ends."""


PERTURBATION = 1e-9
"""Difference in the coordinate of a parameter (mostly its logarithm) between the simulations of an ensemble."""


def perturb(hypothesis: Hypothesis, member_index: int) -> Hypothesis:
    """Move the coordinates of a hypothesis by `member_index` times `PERTURBATION`: a further member of an ensemble of
    simulations, which diverge because impacts are chaotic."""
    return replace(hypothesis, point=hypothesis.point + member_index * PERTURBATION)


@dataclass(frozen=True, slots=True, eq=False)
class BandPowerProblem:
    """Least-squares problem: the band powers that are compared, their weights, and the parameters that are fitted."""

    power: BandPower
    tuning: Tuning
    map_: Mapper
    spread: float | FloatArray = 0.05
    """Standard deviation of ln a between simulations: (stretches, bands, c), or a single value."""
    jacobian_by_deviations: FloatArray | None = None
    """(t, stretches, bands, c): derivatives of ln a by the model's own parameters; None = these are not fitted."""
    ensemble: int = 1
    """Ensemble size: simulations over which a prediction is averaged, from parameters that differ by PERTURBATION."""

    def predict(self, deviations: FloatArray, hypothesis: Hypothesis) -> FloatArray:
        """Compute (stretches, bands, c): mean prediction over the ensemble; NaN throughout where the model is
        invalid."""
        members = range(self.ensemble if len(hypothesis.point) else 1)

        def simulate_member(member_index: int) -> FloatArray:
            return self._predict_member(deviations, perturb(hypothesis, member_index))

        return np.asarray(np.mean(list(self.map_(simulate_member, members)), axis=0))  # type: ignore[arg-type]

    def _predict_member(self, deviations: FloatArray, hypothesis: Hypothesis) -> FloatArray:
        """Compute (stretches, bands, c): ln a of a single simulation; NaN for an invalid model."""
        try:
            model = self.tuning.tune(deviations)
            return self.power.predict(self.power.measure.residuals(model, hypothesis.list_placed_effects()))
        except (MechanicalModelError, np.linalg.LinAlgError):
            return np.full(self.power.measured.shape, np.nan)

    @property
    def weights(self) -> FloatArray:
        """(stretches, bands, c): 1 / s; 0 for held-out stretches and bands below the noise."""
        is_fitted = np.array([stretch.role != "test" for stretch in self.power.stretches], dtype=np.bool_)
        is_compared = np.isfinite(self.power.measured) & is_fitted[:, None, None]
        return np.asarray(np.where(is_compared, 1 / np.hypot(self.spread, SPREAD_FLOOR), 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class BandPowerFit:
    """A hypothesis and deviations of the model's parameters, with the predicted band powers and the cost."""

    hypothesis: Hypothesis
    deviations: FloatArray
    """(t,): in standard deviations of the calibration."""
    predicted: FloatArray
    """(stretches, bands, c): ln a."""
    cost: float
    """J of the module's equation; inf for an invalid model."""
    errors: FloatArray
    """(parameters,): standard errors of the point; empty before a step."""


def evaluate_hypothesis(problem: BandPowerProblem, deviations: FloatArray, hypothesis: Hypothesis) -> BandPowerFit:
    """Compute the predicted band powers and their cost at given parameters, without fitting. The cost is infinite where
    a prediction is not finite."""
    predicted = problem.predict(deviations, hypothesis)
    weights = problem.weights
    if not np.isfinite(predicted[weights > 0]).all():
        return BandPowerFit(hypothesis, deviations, predicted, np.inf, np.zeros(0))
    weighted_errors = _select_weighted(problem, problem.power.measured - predicted)
    cost = (float(_compute_huber_loss(weighted_errors).sum()) + float(deviations @ deviations)) / max(
        len(weighted_errors), 1
    )
    return BandPowerFit(hypothesis, deviations, predicted, cost, np.zeros(0))


def fit_band_power(problem: BandPowerProblem, start: BandPowerFit, rounds: int) -> BandPowerFit:
    """Find the best fit within a number of Gauss-Newton steps; never worse than the start, and unchanged for an invalid
    one."""
    best = start
    for _ in range(rounds):
        if not np.isfinite(best.cost):
            return best
        next_fit = _take_gauss_newton_step(problem, best)
        cost_decrease = best.cost - next_fit.cost
        best = next_fit if cost_decrease > 0 else replace(best, errors=next_fit.errors)
        if cost_decrease < CONVERGED_SHARE * best.cost:
            break
    return best


def differentiate_hypothesis(problem: BandPowerProblem, iterate: BandPowerFit) -> FloatArray:
    """Compute (parameters, stretches, bands, c): derivatives of ln a by the hypothesis's coordinates (central
    differences)."""
    parameters = iterate.hypothesis.parameters
    jobs = [(parameter_index, sign) for parameter_index in range(len(parameters)) for sign in (1.0, -1.0)]

    def predict_displaced(job: tuple[int, float]) -> FloatArray:
        """Predict with one coordinate moved by a step of the given sign."""
        parameter_index, sign = job
        point = iterate.hypothesis.point.copy()
        point[parameter_index] += sign * _get_step(parameters[parameter_index])
        return problem.predict(iterate.deviations, replace(iterate.hypothesis, point=point))

    predictions: list[FloatArray] = list(problem.map_(predict_displaced, jobs))  # type: ignore[arg-type]
    return np.array(
        [
            (forward - backward) / (2 * _get_step(parameter))
            for parameter, forward, backward in zip(parameters, predictions[::2], predictions[1::2], strict=True)
        ]
    ).reshape(len(parameters), *iterate.predicted.shape)


def _take_gauss_newton_step(problem: BandPowerProblem, iterate: BandPowerFit) -> BandPowerFit:
    """Take a bounded step with line search, and estimate the standard errors; the cost is not lower than before where
    no factor of `STEP_FACTORS` reduces it."""
    hypothesis_columns = np.array(
        [_select_weighted(problem, column) for column in differentiate_hypothesis(problem, iterate)]
    )
    errors = _select_weighted(problem, problem.power.measured - iterate.predicted)
    tuned_count = 0 if problem.jacobian_by_deviations is None else len(iterate.deviations)
    model_columns = [
        _select_weighted(problem, column)
        for column in (() if problem.jacobian_by_deviations is None else problem.jacobian_by_deviations)
    ]
    columns = np.vstack([*model_columns, *hypothesis_columns])
    columns[~np.isfinite(columns).all(axis=1)] = 0.0
    huber_weights = np.minimum(1.0, HUBER_THRESHOLD / np.maximum(np.abs(errors), HUBER_THRESHOLD))
    # Re-tuning within the calibration makes small changes, so a residual that stays large shows a missing effect: with
    # the model's own parameters in the fit, large residuals get less weight.
    weighted_columns = columns * (huber_weights**3 if tuned_count else huber_weights)
    rhs = weighted_columns @ errors
    information = weighted_columns @ columns.T
    if tuned_count:
        rhs[:tuned_count] -= iterate.deviations
        information[:tuned_count, :tuned_count] += np.eye(tuned_count)
    # A small ridge keeps the matrix regular.
    information += 1e-9 * np.diag(np.maximum(np.diagonal(information), 1e-9))
    low, high = _compute_step_bounds(iterate, tuned_count)
    step = solve_bounded_step(information, rhs, low, high)
    next_fit = iterate
    for factor in STEP_FACTORS:
        deviations = iterate.deviations + factor * step[:tuned_count] if tuned_count else iterate.deviations
        next_fit = evaluate_hypothesis(
            problem,
            deviations,
            replace(iterate.hypothesis, point=iterate.hypothesis.point + factor * step[tuned_count:]),
        )
        if next_fit.cost < iterate.cost:
            break
    return replace(next_fit, errors=_estimate_errors(problem, iterate, information))


def _estimate_errors(problem: BandPowerProblem, iterate: BandPowerFit, information: FloatArray) -> FloatArray:
    """Estimate (parameters,): standard errors from the information matrix, reduced by the information due to chaotic
    scatter. Scatter adds to the diagonal only; subtracted there, it would make the matrix of correlated parameters
    indefinite, so rows and columns are scaled instead. This underestimates errors of strongly correlated parameters:
    twenty parameters of five simulated devices (seeds 7000 to 7004) were wrong by 1.09 standard errors (rms)."""
    parameters = iterate.hypothesis.parameters
    first_parameter = len(information) - len(parameters)
    scatter = _select_weighted(
        problem, np.broadcast_to(np.asarray(problem.spread, dtype=np.float64), iterate.predicted.shape)
    )
    information_shares = np.ones(len(information))
    for index, parameter in enumerate(parameters, start=first_parameter):
        scatter_information = float(scatter @ scatter) / (2 * problem.ensemble * _get_step(parameter) ** 2)
        information_shares[index] -= min(
            scatter_information / max(float(information[index, index]), 1e-300), MOST_CHANCE_SHARE
        )
    eigenvalues, eigenvectors = np.linalg.eigh(information * np.sqrt(np.outer(information_shares, information_shares)))
    eigenvalues = np.maximum(eigenvalues, max(1e-9 * float(eigenvalues[-1]), LEAST_INFORMATION))
    variances = (eigenvectors**2 / eigenvalues).sum(axis=1) * max(iterate.cost, 1.0)
    return np.asarray(np.sqrt(variances[first_parameter:]))


def _compute_step_bounds(iterate: BandPowerFit, tuned_count: int) -> tuple[FloatArray, FloatArray]:
    """Compute the bounds of a step, (tuned_count + parameters,) each: the model's own parameters stay within 3 standard
    deviations of their calibration, those of the hypothesis within their limits and a largest step."""
    parameters = iterate.hypothesis.parameters
    largest_steps = np.array(
        [LONGEST_STEP if parameter.parameter.scale == "log" else 2 * _get_step(parameter) for parameter in parameters]
    )
    relative_bounds = (
        np.array([parameter.bounds for parameter in parameters]).reshape(-1, 2) - iterate.hypothesis.point[:, None]
    )
    lower_bounds = np.concatenate(
        [-3.0 - iterate.deviations[:tuned_count], np.clip(relative_bounds[:, 0], -largest_steps, 0.0)]
    )
    upper_bounds = np.concatenate(
        [3.0 - iterate.deviations[:tuned_count], np.clip(relative_bounds[:, 1], 0.0, largest_steps)]
    )
    return lower_bounds, upper_bounds


def _get_step(parameter: FreeParameter) -> float:
    """Get the step of the finite differences, in the parameter's coordinate."""
    if parameter.parameter.scale != "log":
        return parameter.difference_step
    return float(np.clip(STEP_RATIO * parameter.difference_step, *STEP_LIMITS))


def _compute_huber_loss(errors: FloatArray) -> FloatArray:
    """Compute Huber's loss rho of the module's equation, element by element."""
    magnitude = np.abs(errors)
    return np.asarray(
        np.where(magnitude <= HUBER_THRESHOLD, magnitude**2, HUBER_THRESHOLD * (2 * magnitude - HUBER_THRESHOLD))
    )


def _select_weighted(problem: BandPowerProblem, values: FloatArray) -> FloatArray:
    """Select (N,): values (stretches, bands, c) in the fitted bands, times their weights 1 / s."""
    weights = problem.weights
    return np.asarray((values * weights)[weights > 0])
