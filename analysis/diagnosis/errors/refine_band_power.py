"""Joint fit of the parameters of a hypothesis and of the model to band powers (`band_power_fit`).

For responses with impacts, which are chaotic: simulations of one hypothesis from almost equal parameters diverge. Their
standard deviation, the chance variation, therefore weights the band powers, and predictions are averaged over an
ensemble of simulations.
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.band_power_fit import (
    BandPowerFit,
    BandPowerProblem,
    evaluate_hypothesis,
    fit_band_power,
    perturb,
)
from analysis.diagnosis.errors.output_error import predict_decrease
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

ENSEMBLE_SIZE = 4
"""Number of simulations of one hypothesis: their standard deviation is the chance variation, their mean is compared
with the recording. Chosen."""
MOST_LINEARISATIONS, STEPS_PER_LINEARISATION = 4, 2
"""Largest number of linearisations by the model's parameters, and of Gauss-Newton steps with each of them. Chosen."""
LEAST_EXPECTED_GAIN = 0.02
"""Expected relative reduction of the cost above which another linearisation follows. Chosen."""


def refine_band_power(weighted_problem: BandPowerProblem, start: BandPowerFit, time_left: TimeBudget) -> BandPowerFit:
    """Fit the hypothesis's and the model's parameters jointly, from `start`. The sensitivity to the model's parameters
    depends on the effects and is computed anew up to `MOST_LINEARISATIONS` times, while time is left. weighted_problem:
    the problem with the chance variation of `start` (`weight_by_chance_variation`), under which the cost of `start` is
    computed anew: fits are compared under the same weights."""
    best = evaluate_hypothesis(weighted_problem, start.deviations, start.hypothesis)
    last_decrease = 0.0
    for _ in range(MOST_LINEARISATIONS):
        problem = replace(weighted_problem, jacobian_by_deviations=_differentiate_by_deviations(weighted_problem, best))
        refined = fit_band_power(problem, best, STEPS_PER_LINEARISATION)
        cost_decrease = 1 - refined.cost / best.cost if best.cost > 0 else 0.0
        best, expected_decrease, last_decrease = refined, predict_decrease(cost_decrease, last_decrease), cost_decrease
        if expected_decrease <= LEAST_EXPECTED_GAIN or not time_left():
            break
    return best


def weight_by_chance_variation(problem: BandPowerProblem, fit: BandPowerFit) -> BandPowerProblem:
    """Weight a problem by the chance variation of `fit`: each band's standard deviation over `ENSEMBLE_SIZE`
    simulations. Its predictions are averaged over as many, or are of a single one where chance does not change the
    weights: without impacts all simulations agree."""

    def predict(member: int) -> FloatArray:
        return problem.predict(fit.deviations, perturb(fit.hypothesis, member))

    chance_deviations = np.std(np.array(list(problem.map_(predict, range(ENSEMBLE_SIZE)))), axis=0, ddof=1)
    weighted = replace(problem, spread=chance_deviations, ensemble=ENSEMBLE_SIZE)
    is_certain = np.allclose(weighted.weights, replace(problem, spread=0.0).weights)
    return replace(weighted, ensemble=1) if is_certain else weighted


def _differentiate_by_deviations(problem: BandPowerProblem, fit: BandPowerFit) -> FloatArray:
    """Compute (t, stretches, bands, c): sensitivity to the model's t parameters, by forward differences with steps of
    one standard deviation, which are large compared with the chance variation; 0 where a step gives no finite value."""
    steps = np.eye(len(fit.deviations))

    def compute_difference(parameter_index: int) -> FloatArray:
        change = problem.predict(fit.deviations + steps[parameter_index], fit.hypothesis) - fit.predicted
        return np.where(np.isfinite(change), change, 0.0)

    return np.array(list(problem.map_(compute_difference, range(len(steps)))))
