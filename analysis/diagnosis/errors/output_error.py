"""Output-error fit: regularised nonlinear least squares by bounded, damped Gauss-Newton steps.

Theory of operation. Unknowns are d, the deviations of the model's own parameters in standard deviations of their
calibration, and p, the parameters of a hypothesis (scaled to logarithms, starts or units). With the prediction errors e
in units of the noise,

    J(d, p) = (sum of e(d, p)² + d'd) / N       over the N residuals to fit (samples times channels of all records)

subject to |d| <= Tuning.bound and p within its limits. d'd is the calibration's Gaussian prior, so that the minimum is
the maximum a posteriori estimate. One step solves, with S = [de/dd, de/dp],

    (S'S + diag(1, 0)) step = -(S'e + (d, 0))        parameters that would leave their range are fixed at its end

with growing multiples of the matrix's diagonal added until J falls (Marquardt's damping). de/dd, one simulation per
parameter of the model, is computed once, de/dp at each step, by finite differences. Sources: Ljung, System
Identification (1999), 10.2; Marquardt, J. SIAM 11:431 (1963).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.data.recorded_conditions import is_unstable_within
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import Hypothesis, move_point
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.signal import FloatArray

DIFFERENCE_STEP = 0.1
"""Step of the finite differences for the model's parameters, in standard deviations of the calibration."""
Dampings = Sequence[tuple[float, bool]]
"""Per trial, the share of the normal matrix's diagonal that is added, and `along_values` of `move_point`."""
DAMPINGS: Dampings = ((1e-9, False), (1e-3, False), (0.1, False), (3.0, False))  # chosen
LARGEST_STEPS = {"log": 1.0, "signed": 10.0, "linear": np.inf}
"""Largest step of an effect's parameter, by its scale (chosen): factor e; ten times its starting value; unlimited."""


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """Jacobian of the prediction at the residuals to fit ("samples" below): of the model's, or of all t parameters."""

    base_deviations: FloatArray
    """Deviations of the model's parameters (standard deviations of the calibration) at which it was computed."""
    columns: FloatArray
    """(t, samples): change of the prediction per standard deviation (or coordinate of a hypothesis): -de/dd."""
    gram: FloatArray  # (t, t): Gram matrix of the columns
    period_indices: npt.NDArray[np.int64] | None = None
    """Where columns contain one period of each segment: per sample to fit, index of its sample in the columns."""

    def multiply(self, errors: FloatArray) -> FloatArray:
        """Multiply the columns with errors on the samples to fit, (samples,) or (k, samples): (t,) or (t, k)."""
        rows = np.atleast_2d(errors)
        if self.period_indices is not None:
            rows = np.array([self._sum_periods(row) for row in rows]).reshape(len(rows), self.columns.shape[1])
        products = self.columns @ rows.T
        return products if errors.ndim > 1 else products[:, 0]

    def select_samples(self, first: int, last: int) -> FloatArray:
        """Select (t, last - first): columns on the residuals `first` to `last`, ordered by instant, then by channel;
        both limits are multiples of the number of channels."""
        if self.period_indices is None:
            return self.columns[:, first:last]
        t, c = len(self.columns), self._channels
        sample_indices = self.period_indices[first // c : last // c]
        if len(sample_indices) and (np.diff(sample_indices) == 1).all():
            return self.columns[:, c * sample_indices[0] : c * (sample_indices[-1] + 1)]
        return self.columns.reshape(t, -1, c)[:, sample_indices].reshape(t, -1)

    @property
    def _channels(self) -> int:
        """Number of channels c; needs `period_indices`."""
        assert self.period_indices is not None
        return int(self.columns.shape[1] // (int(self.period_indices.max(initial=-1)) + 1))

    def _sum_periods(self, errors: FloatArray) -> FloatArray:
        """Sum errors over the periods of each segment. errors: (samples,), channel after channel at each instant."""
        assert self.period_indices is not None
        by_channel = errors.reshape(len(self.period_indices), -1)
        period_samples = self.columns.shape[1] // by_channel.shape[1]
        sums = np.stack([np.bincount(self.period_indices, channel, period_samples) for channel in by_channel.T], axis=1)
        return np.asarray(sums.ravel())


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A hypothesis and the model's own parameters at a point of the fit, with the residuals and the cost there."""

    hypothesis: Hypothesis
    deviations: FloatArray
    """(t,): deviations of the model's own parameters, in standard deviations of the calibration."""
    residuals: tuple[FloatArray, ...]  # (n, c) per record, in units of the noise
    cost: float  # J of the module's equation


def stack_fit_residuals(measure: ErrorMeasure, residuals: tuple[FloatArray, ...]) -> FloatArray:
    """Stack (samples,): the residuals of the samples to fit, of all records and channels in one row."""
    fit_residuals = [residual[record.fit].ravel() for residual, record in zip(residuals, measure.records, strict=True)]
    return np.concatenate(fit_residuals)


def build_jacobian(
    measure: ErrorMeasure,
    tuning: Tuning,
    deviations: FloatArray,
    hypothesis: Hypothesis,
    map_: object = map,
    known_columns: tuple[FloatArray, Sequence[int]] | None = None,
) -> Sensitivity:
    """Build the Jacobian of the prediction by the model's own parameters, by finite differences. map_: `map` or a
    parallel one. known_columns: columns (t, samples), and the indices of those that must be computed; None = all."""
    base = stack_fit_residuals(measure, measure.residuals(tuning.tune(deviations), hypothesis.list_placed_effects()))

    def compute_column(parameter_index: int) -> FloatArray:
        for step in (DIFFERENCE_STEP, -DIFFERENCE_STEP):
            displaced = deviations.copy()
            displaced[parameter_index] += step
            try:
                with np.errstate(over="ignore", invalid="ignore"):
                    change = base - stack_fit_residuals(
                        measure, measure.residuals(tuning.tune(displaced), hypothesis.list_placed_effects())
                    )
            except (MechanicalModelError, np.linalg.LinAlgError):
                continue
            if np.isfinite(change).all():
                return np.divide(change, step, out=change)
        return np.zeros(len(base))  # Neither direction gives a valid model: the parameter stays fixed.

    columns, indices = (
        (np.zeros((len(deviations), len(base))), range(len(deviations)))
        if known_columns is None
        else (known_columns[0].copy(), known_columns[1])
    )
    for parameter_index, column in zip(indices, map_(compute_column, indices), strict=True):  # type: ignore[operator]
        columns[parameter_index] = column
    return Sensitivity(deviations, columns, columns @ columns.T)


def fit(
    measure: ErrorMeasure, tuning: Tuning, start: Fitted, jacobian: Sensitivity, rounds: int, map_: object = map
) -> Fitted:
    """Find the best fit within a number of Gauss-Newton steps; never worse than the start. jacobian: sensitivity to the
    model's parameters, computed at a point nearby. map_: as for `build_jacobian`."""
    best = start
    for _ in range(rounds):
        next_fit = _take_gauss_newton_step(measure, tuning, best, jacobian, map_)
        if next_fit is None:
            return best
        cost_decrease = best.cost - next_fit.cost
        best = next_fit
        if cost_decrease < 1e-4 * best.cost:  # converged
            break
    return best


def predict_decrease(last_decrease: float, previous_decrease: float) -> float:
    """Predict the decrease of the cost by the next fit, from those by the last two: they shrink about geometrically."""
    return last_decrease * min(last_decrease / previous_decrease, 1.0) if previous_decrease > 0 else last_decrease


def evaluate_fit(measure: ErrorMeasure, tuning: Tuning, deviations: FloatArray, hypothesis: Hypothesis) -> Fitted:
    """Compute residuals and cost of a hypothesis at given deviations, by simulation without fitting."""
    residuals = measure.residuals(tuning.tune(deviations), hypothesis.list_placed_effects())
    return Fitted(hypothesis, deviations, residuals, _compute_cost(stack_fit_residuals(measure, residuals), deviations))


def _compute_cost(residuals: FloatArray, deviations: FloatArray) -> float:
    """Compute the cost J of the module's equation; infinite for a diverged simulation. residuals: (samples,) to fit."""
    with np.errstate(over="ignore", invalid="ignore"):  # A simulation may have diverged.
        cost = float(residuals @ residuals + deviations @ deviations) / max(len(residuals), 1)
    return cost if np.isfinite(cost) else np.inf


def _take_gauss_newton_step(
    measure: ErrorMeasure, tuning: Tuning, iterate: Fitted, jacobian: Sensitivity, map_: object
) -> Fitted | None:
    """Take one step; None where no step lowers the cost, or a derivative is not finite."""
    errors = stack_fit_residuals(measure, iterate.residuals)
    effect_columns = compute_effect_columns(measure, tuning, iterate, errors, map_)
    t = len(iterate.deviations)
    with np.errstate(over="ignore", invalid="ignore"):
        cross = jacobian.multiply(effect_columns)
        products = np.block([[jacobian.gram + np.eye(t), cross], [cross.T, effect_columns @ effect_columns.T]])
        rhs = np.concatenate([jacobian.multiply(errors) - iterate.deviations, effect_columns @ errors])
    if not (np.isfinite(products).all() and np.isfinite(rhs).all()):
        return None  # A parameter made the simulation diverge.
    return take_step(measure, tuning, iterate, (products, rhs))


def take_step(
    measure: ErrorMeasure,
    tuning: Tuning,
    iterate: Fitted,
    system: tuple[FloatArray, FloatArray],
    dampings: Dampings = DAMPINGS,
) -> Fitted | None:
    """Take a damped Gauss-Newton step within the bounds; None where no damping lowers the cost. system: normal matrix
    and right side, of the model's parameters, then the hypothesis's."""
    t = len(iterate.deviations)
    unknowns = np.concatenate([iterate.deviations, iterate.hypothesis.point])
    low, high = (bound - unknowns for bound in _list_bounds(iterate.hypothesis, tuning))
    largest_steps = np.array([LARGEST_STEPS[unknown.parameter.scale] for unknown in iterate.hypothesis.parameters])
    low[t:], high[t:] = np.maximum(low[t:], -largest_steps), np.minimum(high[t:], largest_steps)
    next_fit, is_invalid = _search_damping(measure, tuning, iterate, system, (low, high), dampings)
    if next_fit is None and is_invalid:
        # A mass whose best value is negative must not stop the other parameters: all masses stay fixed.
        mass_indices = [index for index, parameter_name in enumerate(tuning.names) if parameter_name.startswith("mass")]
        low[mass_indices] = high[mass_indices] = 0.0
        next_fit, _ = _search_damping(measure, tuning, iterate, system, (low, high), dampings)
    return next_fit


def _search_damping(
    measure: ErrorMeasure,
    tuning: Tuning,
    iterate: Fitted,
    system: tuple[FloatArray, FloatArray],
    bounds: tuple[FloatArray, FloatArray],
    dampings: Dampings,
) -> tuple[Fitted | None, bool]:
    """Find the first of the damped steps that lowers the cost (by more than 1e-9 of it), None where none does; and
    whether any step led to an invalid mechanical model. system: normal matrix and right side."""
    (products, rhs), t, is_invalid = system, len(iterate.deviations), False
    # Steps that make the model unstable within the longest record are refused, unless it is so already.
    is_unstable = is_unstable_within(tuning.tune(iterate.deviations), _find_longest_s(measure))
    for damping, along_values in dampings:
        step = solve_bounded_step(products + damping * np.diag(np.diagonal(products)), rhs, *bounds)
        trial_hypothesis = move_point(iterate.hypothesis, step[t:], along_values)
        try:
            model = tuning.tune(iterate.deviations + step[:t])
            if not is_unstable and is_unstable_within(model, _find_longest_s(measure)):
                continue
            trial = evaluate_fit(measure, tuning, iterate.deviations + step[:t], trial_hypothesis)
        except (MechanicalModelError, np.linalg.LinAlgError):
            is_invalid = True
            continue
        if trial.cost < iterate.cost * (1 - 1e-9):
            return trial, is_invalid
    return None, is_invalid


def _find_longest_s(measure: ErrorMeasure) -> float:
    """Find the length (s) of the longest record."""
    return max(len(record.command) / record.recording.sample_rate_hz for record in measure.records)


def compute_effect_columns(
    measure: ErrorMeasure, tuning: Tuning, iterate: Fitted, errors: FloatArray, map_: object = map
) -> FloatArray:
    """Compute (parameters, samples): -de/dp, per coordinate. errors: residuals to fit at `iterate`."""
    model: MechanicalModel = tuning.tune(iterate.deviations)
    steps = [parameter.difference_step for parameter in iterate.hypothesis.parameters]

    def compute_column(parameter_index: int) -> FloatArray:
        point, step = iterate.hypothesis.point.copy(), steps[parameter_index]
        point[parameter_index] += step
        with np.errstate(over="ignore", invalid="ignore"):
            residuals = measure.residuals(model, iterate.hypothesis.list_placed_effects(point))
            change = errors - stack_fit_residuals(measure, residuals)
            return np.divide(change, step, out=change)

    columns = list(map_(compute_column, range(len(steps))))  # type: ignore[operator]
    return np.array(columns).reshape(len(steps), len(errors))


def _list_bounds(hypothesis: Hypothesis, tuning: Tuning) -> tuple[FloatArray, FloatArray]:
    """List the bounds of all unknowns: of the model's parameters, then of the hypothesis's coordinates."""
    limits = np.array([parameter.bounds for parameter in hypothesis.parameters]).reshape(-1, 2)
    largest_deviations = np.full(len(tuning.names), tuning.bound)
    return np.concatenate([-largest_deviations, limits[:, 0]]), np.concatenate([largest_deviations, limits[:, 1]])


def solve_bounded_step(products: FloatArray, rhs: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Solve for the least-squares step (t,) within bounds: parameters that would leave their range are fixed at its end
    (active set). products, rhs: matrix (t, t) and right-hand side (t,) of the normal equations."""
    step, is_fixed = np.zeros(len(rhs)), np.zeros(len(rhs), dtype=bool)
    for _ in range(2 * len(rhs) + 2):
        is_free = ~is_fixed
        free_step = step.copy()
        reduced_rhs = rhs[is_free] - products[np.ix_(is_free, is_fixed)] @ step[is_fixed]
        free_step[is_free] = np.linalg.lstsq(products[np.ix_(is_free, is_free)], reduced_rhs, rcond=1e-14)[0]
        is_outside = is_free & ((free_step < low) | (free_step > high))
        if not is_outside.any():
            return free_step
        step[is_outside] = np.clip(free_step[is_outside], low[is_outside], high[is_outside])
        is_fixed |= is_outside
    return np.clip(step, low, high)


def gather_evidence(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> tuple[Evidence, ...]:
    """Gather motion and missing force of a fit, one per record, from which starting values are estimated."""
    return measure.evidence(tuning.tune(fitted.deviations), fitted.hypothesis.list_placed_effects(), fitted.residuals)
