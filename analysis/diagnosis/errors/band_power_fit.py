"""Robust Gauss-Newton least squares on band powers, for the parameters of a hypothesis and of the model.

With the differences e of ln a, measured less predicted (`band_power`), and deviations d of the model's own parameters,

    J = (sum of rho(e / s) + d'd) / N        s² = spread² + FLOOR²
    rho(x) = x² for |x| <= k, else k (2 |x| - k)        k = TRUSTED

with Huber's loss rho (Huber, Ann. Math. Stat. 35:73, 1964) over the N fitted bands. Simulations of impacts are chaotic:
the spread of ln a between simulations whose parameters differ by rounding sets the weights, and derivatives are central
differences over large steps.
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

MOVES, WIDEST = (0.02, 0.2), 12.0
"""Least and largest finite-difference step of a logarithmic parameter; and its ratio to `FreeParameter.move` between
these limits."""
LONGEST_STEP = 0.5
"""Largest Gauss-Newton step of a logarithmic parameter; for others it is two finite-difference steps."""
MOST_BY_CHANCE = 0.8
"""Largest share of a parameter's information that is attributed to the chaotic scatter of its finite differences."""
LEAST_KNOWN = 1e-6
"""Lower limit of the information on a combination of parameters to which the prediction is not sensitive."""
SHARES = (1.0, 0.3, 0.1, 0.03)
"""Factors on a step that are tried in turn (line search)."""
FLOOR = 0.04
"""Least standard deviation of ln a: no simulation of impacts predicts it better."""
TRUSTED = 2.0
"""Threshold k of Huber's loss, in standard deviations: more than the fitted effect may be missing."""
RESTS = 1e-4
"""Relative decrease of the cost below which the fit ends."""


PERTURBATION = 1e-9
"""Difference in the logarithm of a parameter between the simulations of an ensemble."""


def perturb(hypothesis: Hypothesis, number: int) -> Hypothesis:
    """The hypothesis with its parameters moved by `number` times `PERTURBATION`, for a further simulation of chaotic
    impacts."""
    return replace(hypothesis, point=hypothesis.point + number * PERTURBATION)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The band powers that are compared, their weights, and the parameters that are fitted."""

    power: BandPower
    tuning: Tuning
    map_: Mapper
    spread: float | FloatArray = 0.05
    """Standard deviation of ln a between simulations: (stretches, bands, c), or a single value."""
    by_deviations: FloatArray | None = None
    """(t, stretches, bands, c): derivatives of ln a by the model's own parameters; None = these are not fitted."""
    ensemble: int = 1
    """Ensemble size: simulations over which a prediction is averaged, from parameters that differ by PERTURBATION."""

    def predict(self, deviations: FloatArray, hypothesis: Hypothesis) -> FloatArray:
        """(stretches, bands, c): mean prediction over the ensemble; NaN throughout where the model is invalid."""
        members = range(self.ensemble if len(hypothesis.point) else 1)

        def member(number: int) -> FloatArray:
            return self._member(deviations, perturb(hypothesis, number))

        return np.asarray(np.mean(list(self.map_(member, members)), axis=0))  # type: ignore[arg-type]

    def _member(self, deviations: FloatArray, hypothesis: Hypothesis) -> FloatArray:
        """(stretches, bands, c): ln a of a single simulation; NaN for an invalid model."""
        try:
            model = self.tuning.tune(deviations)
            return self.power.predict(self.power.measure.residuals(model, hypothesis.list_placed_effects()))
        except (MechanicalModelError, np.linalg.LinAlgError):
            return np.full(self.power.measured.shape, np.nan)

    @property
    def weights(self) -> FloatArray:
        """(stretches, bands, c): 1 / s; 0 for held-out stretches and bands below the noise."""
        fit = np.array([stretch.part != "test" for stretch in self.power.stretches], dtype=np.bool_)
        known = np.isfinite(self.power.measured) & fit[:, None, None]
        return np.asarray(np.where(known, 1 / np.hypot(self.spread, FLOOR), 0.0))


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

    def off(self, view: View) -> FloatArray:
        """(stretches, bands, c): ln of the measured over the predicted amplitude; NaN below the noise."""
        return np.asarray(view.power.measured - self.predicted)


def evaluate_hypothesis(view: View, deviations: FloatArray, hypothesis: Hypothesis) -> BandPowerFit:
    """Predicted band powers and their cost at given parameters, without fitting. The cost is infinite where a
    prediction is not finite."""
    predicted = view.predict(deviations, hypothesis)
    weights = view.weights
    if not np.isfinite(predicted[weights > 0]).all():
        return BandPowerFit(hypothesis, deviations, predicted, np.inf, np.zeros(0))
    weighed = _weight(view, view.power.measured - predicted)
    cost = (float(_huber(weighed).sum()) + float(deviations @ deviations)) / max(len(weighed), 1)
    return BandPowerFit(hypothesis, deviations, predicted, cost, np.zeros(0))


def fit_band_power(view: View, start: BandPowerFit, rounds: int) -> BandPowerFit:
    """The best fit within a number of Gauss-Newton steps; never worse than the start."""
    best = start
    for _ in range(rounds):
        if not np.isfinite(best.cost):
            return best
        better = _gauss_newton_step(view, best)
        gained = best.cost - better.cost
        best = better if gained > 0 else replace(best, errors=better.errors)
        if gained < RESTS * best.cost:
            break
    return best


def hypothesis_columns(view: View, at: BandPowerFit) -> FloatArray:
    """(parameters, stretches, bands, c): derivatives of ln a by the hypothesis's coordinates (central differences)."""
    parameters = at.hypothesis.parameters
    jobs = [(number, way) for number in range(len(parameters)) for way in (1.0, -1.0)]

    def moved(job: tuple[int, float]) -> FloatArray:
        number, way = job
        point = at.hypothesis.point.copy()
        point[number] += way * _move(parameters[number])
        return view.predict(at.deviations, replace(at.hypothesis, point=point))

    there: list[FloatArray] = list(view.map_(moved, jobs))  # type: ignore[arg-type]
    return np.array(
        [(up - down) / (2 * _move(free)) for free, up, down in zip(parameters, there[::2], there[1::2], strict=True)]
    ).reshape(len(parameters), *at.predicted.shape)


def _gauss_newton_step(view: View, at: BandPowerFit) -> BandPowerFit:
    """The fit after a bounded step with line search, with its standard errors; its cost may be higher than before."""
    own = np.array([_weight(view, column) for column in hypothesis_columns(view, at)])
    off = _weight(view, view.power.measured - at.predicted)
    t = 0 if view.by_deviations is None else len(at.deviations)
    known = [_weight(view, column) for column in (() if view.by_deviations is None else view.by_deviations)]
    columns = np.vstack([*known, *own])
    columns[~np.isfinite(columns).all(axis=1)] = 0.0
    trust = np.minimum(1.0, TRUSTED / np.maximum(np.abs(off), TRUSTED))
    # Re-tuning within the calibration makes small changes, so a residual that stays large shows a missing effect: with
    # the model's own parameters in the fit, large residuals get less weight.
    weighted = columns * (trust**3 if t else trust)
    rhs = weighted @ off
    products = weighted @ columns.T
    if t:
        rhs[:t] -= at.deviations
        products[:t, :t] += np.eye(t)
    products += 1e-9 * np.diag(np.maximum(np.diagonal(products), 1e-9))
    low, high = _step_bounds(at, t)
    step = solve_bounded_step(products, rhs, low, high)
    there = at
    for share in SHARES:
        deviations = at.deviations + share * step[:t] if t else at.deviations
        there = evaluate_hypothesis(
            view, deviations, replace(at.hypothesis, point=at.hypothesis.point + share * step[t:])
        )
        if there.cost < at.cost:
            break
    return replace(there, errors=_errors(view, at, products))


def _errors(view: View, at: BandPowerFit, products: FloatArray) -> FloatArray:
    """(parameters,): standard errors from the information matrix, reduced by the information due to chaotic scatter.
    Scatter adds to the diagonal only; subtracted there, it would make the matrix of correlated parameters indefinite,
    so rows and columns are scaled instead. This underestimates errors of strongly correlated parameters: twenty
    parameters of five simulated devices (seeds 7000 to 7004) were wrong by 1.09 standard errors (rms)."""
    parameters = at.hypothesis.parameters
    first = len(products) - len(parameters)
    chance = _weight(view, np.broadcast_to(np.asarray(view.spread, dtype=np.float64), at.predicted.shape))
    share = np.ones(len(products))
    for k, free in enumerate(parameters, start=first):
        by_chance = float(chance @ chance) / (2 * view.ensemble * _move(free) ** 2)
        share[k] -= min(by_chance / max(float(products[k, k]), 1e-300), MOST_BY_CHANCE)
    values, vectors = np.linalg.eigh(products * np.sqrt(np.outer(share, share)))
    values = np.maximum(values, max(1e-9 * float(values[-1]), LEAST_KNOWN))
    spread = (vectors**2 / values).sum(axis=1) * max(at.cost, 1.0)
    return np.asarray(np.sqrt(spread[first:]))


def _step_bounds(at: BandPowerFit, t: int) -> tuple[FloatArray, FloatArray]:
    """Bounds of a step, (t + parameters,) each: the model's own parameters stay within 3 standard deviations."""
    parameters = at.hypothesis.parameters
    most = np.array([LONGEST_STEP if free.parameter.scale == "log" else 2 * _move(free) for free in parameters])
    bounds = np.array([free.bounds for free in parameters]).reshape(-1, 2) - at.hypothesis.point[:, None]
    low = np.concatenate([-3.0 - at.deviations[:t], np.clip(bounds[:, 0], -most, 0.0)])
    high = np.concatenate([3.0 - at.deviations[:t], np.clip(bounds[:, 1], 0.0, most)])
    return low, high


def _move(free: FreeParameter) -> float:
    """Step of the finite differences, in the parameter's coordinate."""
    if free.parameter.scale != "log":
        return free.move
    return float(np.clip(WIDEST * free.move, *MOVES))


def _huber(off: FloatArray) -> FloatArray:
    """Huber's loss rho of the module's equation, element by element."""
    size = np.abs(off)
    return np.asarray(np.where(size <= TRUSTED, size**2, TRUSTED * (2 * size - TRUSTED)))


def _weight(view: View, of: FloatArray) -> FloatArray:
    """(N,): weighted values of (stretches, bands, c) in the fitted bands."""
    weights = view.weights
    return np.asarray((of * weights)[weights > 0])
