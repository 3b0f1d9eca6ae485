"""Output-error fit: regularised nonlinear least squares by bounded, damped Gauss-Newton steps.

Theory of operation. Unknowns are d, the deviations of the model's own parameters in standard deviations of their
calibration, and p, the parameters of a hypothesis (scaled to logarithms, starts or units). With the prediction errors e
in units of the noise,

    J(d, p) = (sum of e(d, p)² + d'd) / N       over the N residuals to fit (samples times channels of all records)

subject to |d| <= Tuning.bound and p within its limits. d'd is the calibration's Gaussian prior, so that the minimum is
the maximum a posteriori estimate. One step solves, with S = [de/dd, de/dp],

    (S'S + diag(1, 0)) step = -(S'e + (d, 0))        parameters that would leave their range are fixed at its end

with growing multiples of the matrix's diagonal added until J falls (Marquardt's damping). de/dd costs one simulation
per parameter of the model, so it is computed once and kept; de/dp is recomputed at each step, by finite differences.
Standard errors: `intervals`. Sources: Ljung, System Identification (1999), sec. 10.2; Marquardt, J. SIAM 11:431 (1963).
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
"""Per trial, the share of the normal matrix's diagonal that is added, and the argument `straight` of `move_point`."""
DAMPINGS: Dampings = ((1e-9, False), (1e-3, False), (0.1, False), (3.0, False))
LARGEST_STEPS = {"log": 1.0, "signed": 10.0, "linear": np.inf}
"""Largest step of an effect's parameter, by its scale: a factor of e; ten times its starting value; unlimited."""


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """Jacobian of the prediction at the residuals to fit ("samples" below): of the model's, or of all t parameters."""

    at: FloatArray
    """(t,): deviations (standard deviations of the calibration) at which it was computed."""
    columns: FloatArray
    """(t, samples): change of the prediction per standard deviation, in units of the noise: -de/dd."""
    squares: FloatArray
    """(t, t): Gram matrix of the columns."""
    repeated: npt.NDArray[np.int64] | None = None
    """Where columns contain one period of each segment: per sample to fit, index of its sample in the columns."""

    def on(self, errors: FloatArray) -> FloatArray:
        """(t,) or (t, k): products of the columns with errors on the samples to fit, (samples,) or (k, samples)."""
        rows = np.atleast_2d(errors)
        if self.repeated is not None:
            rows = np.array([self._sum_periods(row) for row in rows]).reshape(len(rows), self.columns.shape[1])
        products = self.columns @ rows.T
        return products if errors.ndim > 1 else products[:, 0]

    def over(self, first: int, last: int) -> FloatArray:
        """(t, last - first): columns on the residuals `first` to `last`, ordered by instant, then by channel; both
        limits are multiples of the number of channels."""
        if self.repeated is None:
            return self.columns[:, first:last]
        t, c = len(self.columns), self._channels
        where = self.repeated[first // c : last // c]
        if len(where) and (np.diff(where) == 1).all():
            return self.columns[:, c * where[0] : c * (where[-1] + 1)]
        return self.columns.reshape(t, -1, c)[:, where].reshape(t, -1)

    @property
    def _channels(self) -> int:
        assert self.repeated is not None
        return int(self.columns.shape[1] // (int(self.repeated.max(initial=-1)) + 1))

    def _sum_periods(self, errors: FloatArray) -> FloatArray:
        """Errors summed over the periods of each segment. errors: (samples,), channel after channel at each instant."""
        assert self.repeated is not None
        each = errors.reshape(len(self.repeated), -1)
        short = self.columns.shape[1] // each.shape[1]
        summed = np.stack([np.bincount(self.repeated, channel, short) for channel in each.T], axis=1)
        return np.asarray(summed.ravel())


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A hypothesis and the model's own parameters at a point of the fit, with the residuals and the cost there."""

    hypothesis: Hypothesis
    deviations: FloatArray
    """(t,): deviations of the model's own parameters, in standard deviations of the calibration."""
    residuals: tuple[FloatArray, ...]
    """Residuals per record (n, c), in units of the noise."""
    cost: float
    """The cost J of the module's equation."""


def residuals_to_fit(measure: ErrorMeasure, residuals: tuple[FloatArray, ...]) -> FloatArray:
    """(samples,): the residuals of the samples to fit, of all records and channels in one row."""
    parts = [each[record.fit].ravel() for each, record in zip(residuals, measure.records, strict=True)]
    return np.concatenate(parts)


def sensitivity(
    measure: ErrorMeasure,
    tuning: Tuning,
    at: FloatArray,
    hypothesis: Hypothesis,
    map_: object = map,
    beside: tuple[FloatArray, Sequence[int]] | None = None,
) -> Sensitivity:
    """Sensitivity to the model's own parameters by finite differences. map_: `map`, or a parallel equivalent.
    beside: known columns (t, samples), and the indices of those that must be computed; None = all."""
    base = residuals_to_fit(measure, measure.residuals(tuning.tune(at), hypothesis.list_placed_effects()))

    def moved(number: int) -> FloatArray:
        for move in (DIFFERENCE_STEP, -DIFFERENCE_STEP):
            there = at.copy()
            there[number] += move
            try:
                with np.errstate(over="ignore", invalid="ignore"):
                    change = base - residuals_to_fit(
                        measure, measure.residuals(tuning.tune(there), hypothesis.list_placed_effects())
                    )
            except (MechanicalModelError, np.linalg.LinAlgError):
                continue
            if np.isfinite(change).all():
                return np.divide(change, move, out=change)
        # Neither direction gives a valid model: the parameter stays fixed.
        return np.zeros(len(base))

    columns, numbers = (
        (np.zeros((len(at), len(base))), range(len(at))) if beside is None else (beside[0].copy(), beside[1])
    )
    for number, column in zip(numbers, map_(moved, numbers), strict=True):  # type: ignore[operator]
        columns[number] = column
    return Sensitivity(at, columns, columns @ columns.T)


def fit(
    measure: ErrorMeasure, tuning: Tuning, start: Fitted, known: Sensitivity, rounds: int, map_: object = map
) -> Fitted:
    """The best fit within a number of Gauss-Newton steps; never worse than the start. known: sensitivity to the model's
    parameters, computed at a point nearby. map_: as for `sensitivity`."""
    best = start
    for _ in range(rounds):
        better = _gauss_newton_step(measure, tuning, best, known, map_)
        if better is None:
            return best
        gained = best.cost - better.cost
        best = better
        if gained < 1e-4 * best.cost:
            break
    return best


def expect_gain(gained: float, before: float) -> float:
    """Reduction of the cost expected of the next fit, after `gained` by the last fit and `before` by the fit before it:
    reductions shrink about geometrically."""
    return gained * min(gained / before, 1.0) if before > 0 else gained


def evaluate_fit(measure: ErrorMeasure, tuning: Tuning, deviations: FloatArray, hypothesis: Hypothesis) -> Fitted:
    """Residuals and cost of a hypothesis at given deviations, by simulation without fitting."""
    residuals = measure.residuals(tuning.tune(deviations), hypothesis.list_placed_effects())
    return Fitted(hypothesis, deviations, residuals, _cost(residuals_to_fit(measure, residuals), deviations))


def _cost(errors: FloatArray, deviations: FloatArray) -> float:
    with np.errstate(over="ignore", invalid="ignore"):  # A simulation may have diverged.
        cost = float(errors @ errors + deviations @ deviations) / max(len(errors), 1)
    return cost if np.isfinite(cost) else np.inf


def _gauss_newton_step(
    measure: ErrorMeasure, tuning: Tuning, from_: Fitted, known: Sensitivity, map_: object
) -> Fitted | None:
    """The fit after one step; None where no step lowers the cost, or a derivative is not finite."""
    errors = residuals_to_fit(measure, from_.residuals)
    own = hypothesis_sensitivity(measure, tuning, from_, errors, map_)
    t = len(from_.deviations)
    with np.errstate(over="ignore", invalid="ignore"):
        cross = known.on(own)
        products = np.block([[known.squares + np.eye(t), cross], [cross.T, own @ own.T]])
        rhs = np.concatenate([known.on(errors) - from_.deviations, own @ errors])
    if not (np.isfinite(products).all() and np.isfinite(rhs).all()):
        # A parameter made the simulation diverge.
        return None
    return take_step(measure, tuning, from_, (products, rhs))


def take_step(
    measure: ErrorMeasure,
    tuning: Tuning,
    from_: Fitted,
    system: tuple[FloatArray, FloatArray],
    dampings: Dampings = DAMPINGS,
) -> Fitted | None:
    """The fit after a damped Gauss-Newton step within the bounds; None where no damping lowers the cost. system: normal
    matrix and right side, of the model's parameters, then the hypothesis's."""
    t = len(from_.deviations)
    now = np.concatenate([from_.deviations, from_.hypothesis.point])
    low, high = (bound - now for bound in _bounds(from_.hypothesis, tuning))
    longest = _longest(from_.hypothesis)
    low[t:], high[t:] = np.maximum(low[t:], -longest), np.minimum(high[t:], longest)
    found, impossible = _first_better(measure, tuning, from_, system, (low, high), dampings)
    if found is None and impossible:
        # A mass whose best value is negative must not stop the other parameters: it stays fixed.
        masses = [place for place, name in enumerate(tuning.names) if name.startswith("mass")]
        low[masses] = high[masses] = 0.0
        found, _ = _first_better(measure, tuning, from_, system, (low, high), dampings)
    return found


def _first_better(
    measure: ErrorMeasure,
    tuning: Tuning,
    from_: Fitted,
    system: tuple[FloatArray, FloatArray],
    bounds: tuple[FloatArray, FloatArray],
    dampings: Dampings,
) -> tuple[Fitted | None, bool]:
    """The fit after the first of ever shorter steps that lowers the cost, None where none does; and whether any step
    led to an invalid mechanical model. system: normal matrix and right side."""
    (products, rhs), t, impossible = system, len(from_.deviations), False
    # Steps that make the model less stable are refused, unless it is unstable already.
    grows = is_unstable_within(tuning.tune(from_.deviations), _longest_s(measure))
    for damping, straight in dampings:
        step = solve_bounded_step(products + damping * np.diag(np.diagonal(products)), rhs, *bounds)
        there = move_point(from_.hypothesis, step[t:], straight)
        try:
            model = tuning.tune(from_.deviations + step[:t])
            if not grows and is_unstable_within(model, _longest_s(measure)):
                continue
            tried = evaluate_fit(measure, tuning, from_.deviations + step[:t], there)
        except (MechanicalModelError, np.linalg.LinAlgError):
            impossible = True
            continue
        if tried.cost < from_.cost * (1 - 1e-9):
            return tried, impossible
    return None, impossible


def _longest_s(measure: ErrorMeasure) -> float:
    return max(len(record.command) / record.recording.sample_rate_hz for record in measure.records)


def hypothesis_sensitivity(
    measure: ErrorMeasure, tuning: Tuning, from_: Fitted, errors: FloatArray, map_: object = map
) -> FloatArray:
    """(parameters, samples): change of the prediction per unit of each coordinate of the hypothesis, -de/dp. errors:
    residuals to fit at `from_`."""
    model: MechanicalModel = tuning.tune(from_.deviations)
    moves = [free.move for free in from_.hypothesis.parameters]

    def moved(number: int) -> FloatArray:
        point, move = from_.hypothesis.point.copy(), moves[number]
        point[number] += move
        with np.errstate(over="ignore", invalid="ignore"):
            there = measure.residuals(model, from_.hypothesis.list_placed_effects(point))
            change = errors - residuals_to_fit(measure, there)
            return np.divide(change, move, out=change)

    columns = list(map_(moved, range(len(moves))))  # type: ignore[operator]
    return np.array(columns).reshape(len(moves), len(errors))


def _bounds(hypothesis: Hypothesis, tuning: Tuning) -> tuple[FloatArray, FloatArray]:
    own = np.array([free.bounds for free in hypothesis.parameters]).reshape(-1, 2)
    widest = np.full(len(tuning.names), tuning.bound)
    return np.concatenate([-widest, own[:, 0]]), np.concatenate([widest, own[:, 1]])


def _longest(hypothesis: Hypothesis) -> FloatArray:
    return np.array([LARGEST_STEPS[free.parameter.scale] for free in hypothesis.parameters])


def solve_bounded_step(products: FloatArray, rhs: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Least-squares step (t,) within bounds: parameters that would leave their range are fixed at its end (active set).
    products, rhs: matrix (t, t) and right-hand side (t,) of the normal equations."""
    step, held = np.zeros(len(rhs)), np.zeros(len(rhs), dtype=bool)
    for _ in range(2 * len(rhs) + 2):
        free = ~held
        wanted = step.copy()
        rest = rhs[free] - products[np.ix_(free, held)] @ step[held]
        wanted[free] = np.linalg.lstsq(products[np.ix_(free, free)], rest, rcond=1e-14)[0]
        out = free & ((wanted < low) | (wanted > high))
        if not out.any():
            return wanted
        step[out] = np.clip(wanted[out], low[out], high[out])
        held |= out
    return np.clip(step, low, high)


def gather_evidence(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> tuple[Evidence, ...]:
    """Motion and missing force of a fit, one per record, from which starting values are estimated."""
    return measure.evidence(tuning.tune(fitted.deviations), fitted.hypothesis.list_placed_effects(), fitted.residuals)
