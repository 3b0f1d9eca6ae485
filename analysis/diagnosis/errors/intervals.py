"""Final steps of a fit, and standard errors valid where residuals are neither white nor of the assumed variance.

Final fit (`finish_fit`): a search stops at a relative change of the cost, which with 10^5 samples may leave a parameter
several standard errors from the minimum. Gauss-Newton steps therefore continue until the sum of squares falls by less
than `CONVERGED_DECREASE`. Sensitivities are central differences: parameters with the same effect on the prediction (an
added mass and the model's own) must have proportional columns; curvature in one-sided differences would seem to
separate them.

Random errors (`standard_errors`): sandwich estimate of Huber (1967) and White (1980), with scores summed over stretches
longer than the residuals' correlation time. Under periodic excitation model errors repeat: the same stretch of all
periods of a segment is one cluster (Liang and Zeger, Biometrika 73:13, 1986), where that gives the larger error.
Systematic errors (`segment_errors`): no law is exact, so that another level or axis would give other estimates;
delete-one jackknife over segments (Efron and Stein, Ann. Stat. 9:586, 1981), each estimate by one Gauss-Newton step,

    theta_g - theta = -(A - A_g)^-1 b_g,   A = sum of A_g + prior,   A_g = X_g X_g',   b_g = X_g r_g,

with the sensitivities X_g (parameters, samples) and the residuals r_g of segment g.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import DIFFERENCE_STEP, Fitted, Sensitivity, residuals_to_fit, take_step
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.noise.periods import find_settled_periods
from analysis.diagnosis.types import Mapper, Mask, TimeBudget
from equalizer.effects.effect import Structure
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.signal import FloatArray

Places = npt.NDArray[np.int64]

STRETCH_S = 0.5
"""Length (s) of the stretches over which scores are summed: longer than the residuals' correlation time."""
BOUND_TOLERANCE = 1e-6
"""Distance of a coordinate from its bound at or below which it counts as at the bound."""
CONVERGED_DECREASE = 0.01
"""Fall of the sum of squares, in noise variances, that ends a fit: the minimum is then within a tenth of a standard
error."""
FINAL_DAMPINGS = ((1e-13, True), (1e-13, False), (1e-9, True), (1e-3, False), (0.1, False))
"""Dampings of the final steps (see `DAMPINGS`), smaller than in a search: in a direction that the data do not
determine, the prior of the calibration must decide, not the damping."""
LARGEST_ROUNDS, STEPS_PER_ROUND = 4, 3
"""Largest number of rounds, each with a newly computed sensitivity, and of Gauss-Newton steps per round."""
STEP_FACTOR_LINEAR, STEP_FACTOR = 0.02, 0.2
"""Steps of the central differences, relative to those of a search. Linear simulation: short, because curvature is the
only error. Other effects, with thresholds or forces that are solved for: longer, because a short step would magnify the
numerical errors of the simulation."""


def sensitivity_to_all(
    measure: ErrorMeasure, tuning: Tuning, deviations: FloatArray, hypothesis: Hypothesis, map_: Mapper = map
) -> Sensitivity:
    """Sensitivity (t + parameters, samples) to the model's parameters, then to the hypothesis's parameters, by central
    differences; one-sided at a bound and where the other side gives no valid model, zero where neither does."""
    t, placed_effects = len(deviations), hypothesis.list_placed_effects()
    linear = all(isinstance(placed_effect.effect.action, Structure) for placed_effect in placed_effects)
    step_factor = STEP_FACTOR_LINEAR if linear else STEP_FACTOR

    def residuals_at(number: int, step: float) -> FloatArray | None:
        displaced, point = deviations.copy(), hypothesis.point.copy()
        (displaced if number < t else point)[number if number < t else number - t] += step
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                residuals = residuals_to_fit(
                    measure, measure.residuals(tuning.tune(displaced), hypothesis.list_placed_effects(point))
                )
        except (MechanicalModelError, np.linalg.LinAlgError):
            return None
        return residuals if np.isfinite(residuals).all() else None

    def column(number: int) -> FloatArray:
        sides = [(step, residuals_at(number, step)) for step in _bounded_steps(hypothesis, number - t, step_factor)]
        valid = [(step, residuals) for step, residuals in sides if residuals is not None]
        if len(valid) == 1 and (unchanged := residuals_at(number, 0.0)) is not None:
            valid.append((0.0, unchanged))
        if len(valid) < 2 or valid[0][0] == valid[1][0]:
            return np.zeros(samples)
        (first_step, first_residuals), (second_step, second_residuals) = valid
        return np.asarray((first_residuals - second_residuals) / (second_step - first_step))

    samples = sum(int(record.fit.sum()) * record.measured.shape[1] for record in measure.records)
    count = t + len(hypothesis.parameters)
    columns = np.array(list(map_(column, range(count)))).reshape(count, samples)
    return Sensitivity(deviations, columns, columns @ columns.T)


def _bounded_steps(hypothesis: Hypothesis, number: int, step_factor: float) -> tuple[float, float]:
    """Steps down and up within the bounds. number: index among the hypothesis's parameters; below 0: a parameter of the
    model."""
    if number < 0:
        return -step_factor * DIFFERENCE_STEP, step_factor * DIFFERENCE_STEP
    (low, high), coordinate = hypothesis.parameters[number].bounds, hypothesis.point[number]
    step = step_factor * hypothesis.parameters[number].difference_step
    return max(-step, low - coordinate), min(step, high - coordinate)


def finish_fit(
    measure: ErrorMeasure,
    tuning: Tuning,
    fitted: Fitted,
    sensitivity_of: Callable[[Fitted], Sensitivity],
    time_left: TimeBudget,
) -> tuple[Fitted, Sensitivity]:
    """The fit at its minimum, and the sensitivity to all its parameters there. sensitivity_of: as `sensitivity_to_all`;
    called once, and again after each round that lowered the sum of squares by `CONVERGED_DECREASE` or more, even where
    no time is left for further steps."""
    jacobian, samples = sensitivity_of(fitted), len(residuals_to_fit(measure, fitted.residuals))
    for _ in range(LARGEST_ROUNDS):
        round_start_cost = fitted.cost
        for _ in range(STEPS_PER_ROUND):
            next_fit = take_step(measure, tuning, fitted, _normal_equations(measure, fitted, jacobian), FINAL_DAMPINGS)
            if next_fit is None:
                break
            decrease, fitted = samples * (fitted.cost - next_fit.cost), next_fit
            if decrease < CONVERGED_DECREASE:
                break
        if (
            not samples * (round_start_cost - fitted.cost) >= CONVERGED_DECREASE
        ):  # also where both costs are infinite (NaN)
            break
        jacobian = sensitivity_of(fitted)
        if not time_left():
            break
    return fitted, jacobian


def _normal_equations(measure: ErrorMeasure, fitted: Fitted, jacobian: Sensitivity) -> tuple[FloatArray, FloatArray]:
    """Normal matrix and right side of a Gauss-Newton step in all parameters, with the calibration as prior."""
    rhs, t = jacobian.multiply(residuals_to_fit(measure, fitted.residuals)), len(fitted.deviations)
    rhs[:t] -= fitted.deviations
    return _with_calibration(jacobian.gram, t), rhs


def _with_calibration(squares: FloatArray, t: int) -> FloatArray:
    """Normal matrix with the prior of the calibration: one observation of each of the model's t parameters, with a
    standard deviation of 1 in its coordinate."""
    normal_matrix = squares.copy()
    normal_matrix[:t, :t] += np.eye(t)
    return normal_matrix


def standard_errors(measure: ErrorMeasure, fitted: Fitted, jacobian: Sensitivity) -> FloatArray:
    """(t + parameters,): standard errors of the deviations and of the hypothesis's point; 0 for parameters at a bound.
    jacobian: sensitivity to all parameters (`sensitivity_to_all`).

    Scores sum to zero at the minimum, so that few clusters underestimate the variance. The larger of two estimates is
    returned: with all periods of a segment in common clusters, and with separate ones."""
    t, free = len(fitted.deviations), _free(fitted)
    errors = residuals_to_fit(measure, fitted.residuals)
    information = _with_calibration(jacobian.gram * np.outer(free, free), t)
    scale = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-12) / np.outer(scale, scale)
    variances = []
    for pool_periods in (False, True):
        scores = _scores(measure, jacobian, errors, pool_periods) * free[:, None]
        variances.append(np.diagonal(inverse @ _with_calibration(scores @ scores.T, t) @ inverse))
    return np.asarray(np.sqrt(np.maximum(np.max(variances, axis=0), 0.0)))


def segment_errors(measure: ErrorMeasure, fitted: Fitted, jacobian: Sensitivity) -> FloatArray | None:
    """(t + parameters,): jackknife standard errors over segments; None where there is a single segment. jacobian: as in
    `standard_errors`."""
    errors, free = residuals_to_fit(measure, fitted.residuals), _free(fitted)
    products, scores = [], []
    for begin, end in _segments(measure):
        segment_columns = jacobian.select_samples(begin, end) * free[:, None]
        products.append(segment_columns @ segment_columns.T)
        scores.append(segment_columns @ errors[begin:end])
    if len(products) < 2:
        return None
    normal_matrix = _with_calibration(np.sum(products, axis=0), len(fitted.deviations))
    scale = np.sqrt(np.maximum(np.diagonal(normal_matrix), np.finfo(float).tiny))
    omission_steps = []
    for segment_matrix, rhs in zip(products, scores, strict=True):
        remaining_matrix = (normal_matrix - segment_matrix) / np.outer(scale, scale)
        omission_steps.append(np.linalg.pinv(remaining_matrix, rcond=1e-12, hermitian=True) @ (rhs / scale) / scale)
    steps, count = np.array(omission_steps), len(omission_steps)
    return np.asarray(np.sqrt((count - 1) / count * np.sum((steps - steps.mean(axis=0)) ** 2, axis=0)))


def _segments(measure: ErrorMeasure) -> Iterator[tuple[int, int]]:
    """Ranges (begin, end) of the residuals to fit: one per segment, up to the next, or one per recording without
    segments."""
    first = 0
    for record in measure.records:
        width, samples = record.measured.shape[1], np.flatnonzero(record.fit)
        starts = np.sort([segment.start for segment in record.recording.segments[1:]])
        edges = [0, *np.searchsorted(samples, starts), len(samples)]
        yield from ((first + width * a, first + width * b) for a, b in pairwise(edges) if b > a)
        first += width * len(samples)


def _free(fitted: Fitted) -> Mask:
    """(t + parameters,): whether a parameter is away from its bounds; always true for the model's parameters."""
    point, bounds = fitted.hypothesis.point, [free.bounds for free in fitted.hypothesis.parameters]
    is_interior = [
        not np.isclose(coordinate, limits, rtol=0.0, atol=BOUND_TOLERANCE).any()
        for coordinate, limits in zip(point, bounds, strict=True)
    ]
    return np.array([True] * len(fitted.deviations) + is_interior, dtype=np.bool_)


def _scores(measure: ErrorMeasure, jacobian: Sensitivity, errors: FloatArray, pool_periods: bool) -> FloatArray:
    """(t + parameters, clusters): score of each parameter (column times residual), summed per cluster. pool_periods: as
    in `_clusters`."""
    sums: list[FloatArray] = []
    first = 0
    for record in measure.records:
        width, clusters = record.measured.shape[1], _clusters(record, pool_periods)[record.fit]
        by_cluster = np.zeros((int(clusters.max(initial=-1)) + 1, len(jacobian.columns)))
        edges = [0, *(np.flatnonzero(np.diff(clusters)) + 1).tolist(), len(clusters)]
        for begin, end in pairwise(edges):
            if end > begin:
                part = slice(first + width * begin, first + width * end)
                by_cluster[clusters[begin]] += jacobian.select_samples(part.start, part.stop) @ errors[part]
        first += width * len(clusters)
        sums.append(by_cluster)
    return np.concatenate(sums).T


def _clusters(record: Observed, pool_periods: bool) -> Places:
    """(n,): number of the cluster of each sample: stretches of `STRETCH_S`. pool_periods: the same stretch of all
    periods of a segment is one cluster."""
    width = max(int(STRETCH_S * record.recording.sample_rate_hz), 1)
    position = np.arange(len(record.fit))
    for periods in find_settled_periods(record.recording) if pool_periods else ():
        segment_samples = slice(periods.segment.start, min(periods.segment.stop, len(position)))
        position[segment_samples] = (
            periods.segment.start + (position[segment_samples] - periods.segment.start) % periods.length
        )
    return np.asarray(np.unique(position // width, return_inverse=True)[1])
