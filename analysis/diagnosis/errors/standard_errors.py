"""Standard errors of fitted parameters, valid where residuals are neither white nor of the assumed variance.

Final fit (`finish_fit`), before the errors are computed: a search stops at a relative change of the cost, which with
10^5 samples may leave a parameter several standard errors from the minimum. Gauss-Newton steps therefore continue until
the sum of squares falls by less than `CONVERGED_DECREASE`, or a limit of rounds or time is reached. Sensitivities are
central differences: parameters with the same effect on the prediction (an added mass and that of the model) must have
proportional columns; the curvature error of one-sided differences would make them seem separable.

Random errors (`compute_standard_errors`): sandwich estimate of Huber (1967) and White (1980), with scores summed over
stretches, which are taken to be longer than the residuals' correlation time. Under periodic excitation model errors
repeat: the same stretch of all periods of a segment is one cluster (Liang and Zeger, Biometrika 73:13, 1986), where
that gives the larger error. Systematic errors (`compute_segment_errors`): no law is exact, so that another level or
axis would give other estimates; delete-one jackknife over segments (Efron and Stein, Ann. Stat. 9:586, 1981), each
estimate by one Gauss-Newton step,

    theta_g - theta = -(A - A_g)^-1 b_g,   A = sum of A_g + prior,   A_g = X_g X_g',   b_g = X_g r_g,

with the sensitivities X_g (parameters, samples) and the residuals r_g of segment g. Residuals are in units of the
noise. Throughout, t is the number of the model's free parameters (deviations); those of the hypothesis follow.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import DIFFERENCE_STEP, Fitted, Sensitivity, stack_fit_residuals, take_step
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.noise.periods import find_settled_periods
from analysis.diagnosis.types import Mapper, Mask, TimeBudget
from equalizer.effects.effect import Structure
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.signal import FloatArray

IndexArray = npt.NDArray[np.int64]
"""Array of indices."""

STRETCH_S = 0.5
"""Length (s) of the stretches over which scores are summed. Chosen by hand."""
BOUND_TOLERANCE = 1e-6
"""Distance of a coordinate from its bound at or below which it counts as at the bound. Chosen by hand."""
CONVERGED_DECREASE = 0.01
"""Fall of the sum of squares, in noise variances, below which a fit ends: the minimum is then within about a tenth of a
standard error."""
FINAL_DAMPINGS = ((1e-13, True), (1e-13, False), (1e-9, True), (1e-3, False), (0.1, False))
"""Dampings of the final steps (pairs as in `output_error.Dampings`), the first smaller than in a search: in a direction
that the data do not determine, the prior of the calibration must decide, not the damping. Chosen by hand."""
MOST_ROUNDS, STEPS_PER_ROUND = 4, 3
"""Largest number of rounds, each with a newly computed sensitivity, and of Gauss-Newton steps per round. Chosen by
hand."""
STEP_FACTOR_LINEAR, STEP_FACTOR = 0.02, 0.2
"""Steps of the central differences, relative to those of a search. Linear simulation: short, because curvature is the
only error. Other effects, with thresholds or forces that are solved for: longer, because a short step would magnify the
numerical errors of the simulation. Chosen by hand."""


def compute_full_sensitivity(
    measure: ErrorMeasure, tuning: Tuning, deviations: FloatArray, hypothesis: Hypothesis, map_: Mapper = map
) -> Sensitivity:
    """Compute the sensitivity (t + parameters, samples) to the model's parameters, then to the hypothesis's parameters,
    by central differences; one-sided at a bound and where the other side gives no valid model, zero where no difference
    can be formed. map_: a possibly parallel `map`."""
    t, placed_effects = len(deviations), hypothesis.list_placed_effects()
    is_linear = all(isinstance(placed_effect.effect.action, Structure) for placed_effect in placed_effects)
    step_factor = STEP_FACTOR_LINEAR if is_linear else STEP_FACTOR

    def compute_residuals(parameter_index: int, displacement: float) -> FloatArray | None:
        """Compute the residuals (samples,) with one coordinate displaced; None where model or residuals are invalid."""
        displaced, point = deviations.copy(), hypothesis.point.copy()
        (displaced if parameter_index < t else point)[
            parameter_index if parameter_index < t else parameter_index - t
        ] += displacement
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                residuals = stack_fit_residuals(
                    measure, measure.residuals(tuning.tune(displaced), hypothesis.list_placed_effects(point))
                )
        except (MechanicalModelError, np.linalg.LinAlgError):
            return None
        return residuals if np.isfinite(residuals).all() else None

    def compute_column(parameter_index: int) -> FloatArray:
        """Compute the change of the prediction per unit of one coordinate, (samples,)."""
        trial_sides = [
            (displacement, compute_residuals(parameter_index, displacement))
            for displacement in _limit_steps(hypothesis, parameter_index - t, step_factor)
        ]
        valid_sides = [(displacement, residuals) for displacement, residuals in trial_sides if residuals is not None]
        if len(valid_sides) == 1 and (unchanged := compute_residuals(parameter_index, 0.0)) is not None:
            valid_sides.append((0.0, unchanged))
        if len(valid_sides) < 2 or valid_sides[0][0] == valid_sides[1][0]:
            return np.zeros(sample_count)
        (first_step, first_residuals), (second_step, second_residuals) = valid_sides
        return np.asarray((first_residuals - second_residuals) / (second_step - first_step))

    sample_count = sum(int(record.fit.sum()) * record.measured.shape[1] for record in measure.records)
    parameter_count = t + len(hypothesis.parameters)
    columns = np.array(list(map_(compute_column, range(parameter_count)))).reshape(parameter_count, sample_count)
    return Sensitivity(deviations, columns, columns @ columns.T)


def _limit_steps(hypothesis: Hypothesis, parameter_index: int, step_factor: float) -> tuple[float, float]:
    """Limit the steps of a coordinate, down and up, to its bounds. parameter_index: among the hypothesis's parameters;
    below 0: a parameter of the model, which has no bounds here."""
    if parameter_index < 0:
        return -step_factor * DIFFERENCE_STEP, step_factor * DIFFERENCE_STEP
    (low, high), coordinate = hypothesis.parameters[parameter_index].bounds, hypothesis.point[parameter_index]
    step = step_factor * hypothesis.parameters[parameter_index].difference_step
    return max(-step, low - coordinate), min(step, high - coordinate)


def finish_fit(
    measure: ErrorMeasure,
    tuning: Tuning,
    fitted: Fitted,
    compute_sensitivity: Callable[[Fitted], Sensitivity],
    time_left: TimeBudget,
) -> tuple[Fitted, Sensitivity]:
    """Continue a fit to its minimum; returns the fit and the sensitivity to all its parameters. compute_sensitivity:
    `compute_full_sensitivity` of a fit; called once, and again after each round that lowered the sum of squares by
    `CONVERGED_DECREASE` or more, even where no time is left for a further round."""
    jacobian, sample_count = compute_sensitivity(fitted), len(stack_fit_residuals(measure, fitted.residuals))
    for _ in range(MOST_ROUNDS):
        round_start_cost = fitted.cost
        for _ in range(STEPS_PER_ROUND):
            next_fit = take_step(
                measure, tuning, fitted, _build_normal_equations(measure, fitted, jacobian), FINAL_DAMPINGS
            )
            if next_fit is None:
                break
            decrease, fitted = sample_count * (fitted.cost - next_fit.cost), next_fit
            if decrease < CONVERGED_DECREASE:
                break
        if (
            not sample_count * (round_start_cost - fitted.cost) >= CONVERGED_DECREASE
        ):  # also where both costs are infinite (NaN)
            break
        jacobian = compute_sensitivity(fitted)
        if not time_left():
            break
    return fitted, jacobian


def _build_normal_equations(
    measure: ErrorMeasure, fitted: Fitted, jacobian: Sensitivity
) -> tuple[FloatArray, FloatArray]:
    """Build normal matrix and right side of a Gauss-Newton step in all parameters, with the calibration as prior."""
    rhs, t = jacobian.multiply(stack_fit_residuals(measure, fitted.residuals)), len(fitted.deviations)
    rhs[:t] -= fitted.deviations
    return _add_calibration_prior(jacobian.gram, t), rhs


def _add_calibration_prior(gram: FloatArray, t: int) -> FloatArray:
    """Add the prior of the calibration to a Gram matrix (t + parameters, t + parameters): one observation of each of
    the model's t parameters, with a standard deviation of 1 in its coordinate."""
    normal_matrix = gram.copy()
    normal_matrix[:t, :t] += np.eye(t)
    return normal_matrix


def compute_standard_errors(measure: ErrorMeasure, fitted: Fitted, jacobian: Sensitivity) -> FloatArray:
    """Compute the standard errors (t + parameters,) of the model's deviations and the hypothesis's point; 0 for
    parameters at a bound, infinite for others of the point without effect on the prediction. jacobian: sensitivity to
    all parameters (`compute_full_sensitivity`).

    Scores sum to zero at the minimum, so that few clusters underestimate the variance. For each parameter, the larger
    of the two estimates, with and without common clusters, is returned. Directions with less than 1e-12 of the largest
    scaled information, undetermined up to rounding, are left out."""
    t, is_free = len(fitted.deviations), _mask_free_parameters(fitted)
    residuals = stack_fit_residuals(measure, fitted.residuals)
    information = _add_calibration_prior(jacobian.gram * np.outer(is_free, is_free), t)
    diagonal_roots = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
    inverse = np.linalg.pinv(information / np.outer(diagonal_roots, diagonal_roots), rcond=1e-12) / np.outer(
        diagonal_roots, diagonal_roots
    )
    variances = []
    for pool_periods in (False, True):
        scores = _sum_scores(measure, jacobian, residuals, pool_periods) * is_free[:, None]
        variances.append(np.diagonal(inverse @ _add_calibration_prior(scores @ scores.T, t) @ inverse))
    errors = np.sqrt(np.maximum(np.max(variances, axis=0), 0.0))
    errors[is_free & (np.diagonal(information) == 0)] = np.inf
    return np.asarray(errors)


def compute_segment_errors(measure: ErrorMeasure, fitted: Fitted, jacobian: Sensitivity) -> FloatArray | None:
    """Compute the jackknife standard errors over segments, (t + parameters,); None for fewer than two segments (or
    recordings without segments) with samples to fit. jacobian, limit 1e-12: as in `compute_standard_errors`."""
    residuals, is_free = stack_fit_residuals(measure, fitted.residuals), _mask_free_parameters(fitted)
    products, scores = [], []
    for first, stop in _list_segment_ranges(measure):
        segment_columns = jacobian.select_samples(first, stop) * is_free[:, None]
        products.append(segment_columns @ segment_columns.T)
        scores.append(segment_columns @ residuals[first:stop])
    if len(products) < 2:
        return None
    normal_matrix = _add_calibration_prior(np.sum(products, axis=0), len(fitted.deviations))
    diagonal_roots = np.sqrt(np.maximum(np.diagonal(normal_matrix), np.finfo(float).tiny))
    omission_steps = []
    for segment_matrix, rhs in zip(products, scores, strict=True):
        remaining_matrix = (normal_matrix - segment_matrix) / np.outer(diagonal_roots, diagonal_roots)
        omission_steps.append(
            np.linalg.pinv(remaining_matrix, rcond=1e-12, hermitian=True) @ (rhs / diagonal_roots) / diagonal_roots
        )
    steps, segment_count = np.array(omission_steps), len(omission_steps)
    return np.asarray(np.sqrt((segment_count - 1) / segment_count * np.sum((steps - steps.mean(axis=0)) ** 2, axis=0)))


def _list_segment_ranges(measure: ErrorMeasure) -> Iterator[tuple[int, int]]:
    """List the ranges (start, exclusive stop) of the residuals to fit: one per segment, from its start (the first: of
    the recording) to the next, or one per recording without segments; empty ranges are left out."""
    record_start = 0
    for record in measure.records:
        channel_count, fit_samples = record.measured.shape[1], np.flatnonzero(record.fit)
        starts = np.sort([segment.start for segment in record.recording.segments[1:]])
        edges = [0, *np.searchsorted(fit_samples, starts), len(fit_samples)]
        yield from (
            (record_start + channel_count * start, record_start + channel_count * stop)
            for start, stop in pairwise(edges)
            if stop > start
        )
        record_start += channel_count * len(fit_samples)


def _mask_free_parameters(fitted: Fitted) -> Mask:
    """Make the mask (t + parameters,) of the parameters that are not at a bound; True for the model's."""
    point, bounds = fitted.hypothesis.point, [parameter.bounds for parameter in fitted.hypothesis.parameters]
    is_interior = [
        not np.isclose(coordinate, limits, rtol=0.0, atol=BOUND_TOLERANCE).any()
        for coordinate, limits in zip(point, bounds, strict=True)
    ]
    return np.array([True] * len(fitted.deviations) + is_interior, dtype=np.bool_)


def _sum_scores(measure: ErrorMeasure, jacobian: Sensitivity, residuals: FloatArray, pool_periods: bool) -> FloatArray:
    """Sum the score of each parameter (column times residual) per cluster, (t + parameters, clusters). pool_periods: as
    in `_assign_clusters`."""
    scores_by_record: list[FloatArray] = []
    record_start = 0
    for record in measure.records:
        channel_count, clusters = record.measured.shape[1], _assign_clusters(record, pool_periods)[record.fit]
        scores_by_cluster = np.zeros((int(clusters.max(initial=-1)) + 1, len(jacobian.columns)))
        edges = [0, *(np.flatnonzero(np.diff(clusters)) + 1).tolist(), len(clusters)]
        for start, stop in pairwise(edges):
            if stop > start:
                sample_range = slice(record_start + channel_count * start, record_start + channel_count * stop)
                scores_by_cluster[clusters[start]] += (
                    jacobian.select_samples(sample_range.start, sample_range.stop) @ residuals[sample_range]
                )
        record_start += channel_count * len(clusters)
        scores_by_record.append(scores_by_cluster)
    return np.concatenate(scores_by_record).T


def _assign_clusters(record: Observed, pool_periods: bool) -> IndexArray:
    """Assign each sample of a record the number of its cluster, (n,): a stretch of `STRETCH_S`. pool_periods: whether
    the same stretch of all periods of a segment is one cluster."""
    stretch_samples = max(int(STRETCH_S * record.recording.sample_rate_hz), 1)
    folded_index = np.arange(len(record.fit))
    for periods in find_settled_periods(record.recording) if pool_periods else ():
        segment_samples = slice(periods.segment.start, min(periods.segment.stop, len(folded_index)))
        folded_index[segment_samples] = (
            periods.segment.start + (folded_index[segment_samples] - periods.segment.start) % periods.length
        )
    return np.asarray(np.unique(folded_index // stretch_samples, return_inverse=True)[1])
