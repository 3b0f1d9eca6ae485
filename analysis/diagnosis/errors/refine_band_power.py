"""Joint fit of a hypothesis and of the model's own parameters by band power, weighted by the chance variation between
simulations. Called by `impacts` and `second_effect_with_play`: a simulation does not predict single impacts."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.band_power_fit import BandPowerFit, BandPowerProblem, fit_band_power, perturb
from analysis.diagnosis.errors.output_error import expect_gain
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

SIMULATIONS = 4
"""Simulations of one hypothesis: their standard deviation is the chance variation, and their mean is what the last fit
compares."""
ROUNDS, STEPS = 4, 2
"""Linearisations of a fit, and steps with each of them."""
LEAST_GAIN = 0.02
"""Expected relative reduction of the cost above which a further linearisation follows."""


def refine_band_power(weighted: BandPowerProblem, start: BandPowerFit, time_left: TimeBudget) -> BandPowerFit:
    """The joint fit of the hypothesis's and the model's parameters. The sensitivity to the model's parameters is
    renewed up to `ROUNDS` times, because an effect changes it, while time is left. weighted: by the chance variation of
    `start` (`weight_by_chance_variation`)."""
    best = start
    last_gain = 0.0
    for _ in range(ROUNDS):
        problem = replace(weighted, jacobian_by_deviations=_differentiate_by_deviations(weighted, best))
        refined = fit_band_power(problem, best, STEPS)
        gain = 1 - refined.cost / best.cost if best.cost > 0 else 0.0
        best, expected, last_gain = refined, expect_gain(gain, last_gain), gain
        if expected <= LEAST_GAIN or not time_left():
            break
    return best


def weight_by_chance_variation(problem: BandPowerProblem, fit: BandPowerFit) -> BandPowerProblem:
    """The problem with each band's standard deviation over `SIMULATIONS` simulations, and predictions averaged over as
    many."""

    def predict(number: int) -> FloatArray:
        return problem.predict(fit.deviations, perturb(fit.hypothesis, number))

    spread = np.std(np.array(list(problem.map_(predict, range(SIMULATIONS)))), axis=0, ddof=1)
    return replace(problem, spread=spread, ensemble=SIMULATIONS)


def _differentiate_by_deviations(problem: BandPowerProblem, fit: BandPowerFit) -> FloatArray:
    """(t, stretches, bands, c): sensitivity to the model's t parameters, by forward differences with steps of one
    standard deviation, which are large compared with the chance variation; 0 where a step gives no finite value."""
    steps = np.eye(len(fit.deviations))

    def difference(number: int) -> FloatArray:
        change = problem.predict(fit.deviations + steps[number], fit.hypothesis) - fit.predicted
        return np.where(np.isfinite(change), change, 0.0)

    return np.array(list(problem.map_(difference, range(len(steps)))))
