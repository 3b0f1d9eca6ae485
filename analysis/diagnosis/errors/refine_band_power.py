"""Joint fit of a hypothesis and of the model's own parameters by band power, with the chance variation as weight."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.band_power_fit import BandPowerFit, View, fit_band_power, perturb
from analysis.diagnosis.errors.output_error import expect_gain
from equalizer.signals.signal import FloatArray

SIMULATIONS = 4
"""Simulations of one hypothesis: their standard deviation is the chance variation, and their mean is what the last fit
compares."""
ROUNDS, STEPS = 4, 2
"""Linearisations of a fit, and steps with each of them."""
GAINED = 0.02
"""Expected relative reduction of the cost above which a further linearisation follows."""


def refine_band_power(view: View, start: BandPowerFit) -> BandPowerFit:
    """The joint fit of the hypothesis's and the model's parameters. The sensitivity to the model's parameters is
    renewed up to `ROUNDS` times, because an effect changes it."""
    view = weight_by_chance(view, start)
    best = start
    last_gain = 0.0
    for _ in range(ROUNDS):
        view = replace(view, by_deviations=_differentiate_by_deviations(view, best))
        better = fit_band_power(view, best, STEPS)
        gain = 1 - better.cost / best.cost if best.cost > 0 else 0.0
        best, expected, last_gain = better, expect_gain(gain, last_gain), gain
        if expected <= GAINED:
            break
    return best


def weight_by_chance(view: View, fit: BandPowerFit) -> View:
    """The view with each band's standard deviation over `SIMULATIONS` simulations, and predictions averaged over as
    many."""

    def predict(number: int) -> FloatArray:
        return view.predict(fit.deviations, perturb(fit.hypothesis, number))

    spread = np.std(np.array(list(view.map_(predict, range(SIMULATIONS)))), axis=0, ddof=1)
    return replace(view, spread=spread, ensemble=SIMULATIONS)


def _differentiate_by_deviations(view: View, fit: BandPowerFit) -> FloatArray:
    """(t, stretches, bands, c): sensitivity to the model's t parameters, by forward differences with steps of one
    standard deviation, which are large compared with the chance variation; 0 where a step gives no finite value."""
    steps = np.eye(len(fit.deviations))

    def difference(number: int) -> FloatArray:
        change = view.predict(fit.deviations + steps[number], fit.hypothesis) - fit.predicted
        return np.where(np.isfinite(change), change, 0.0)

    return np.array(list(view.map_(difference, range(len(steps)))))
