"""Compares simulations by band power, where waveforms cannot be predicted: misfits in units of chance.

Chance is the difference between two simulations of one hypothesis whose parameters differ by 1e-9: with impacts they
diverge, and no hypothesis can be closer to the recording than to itself.
"""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.band_power_fit import BandPowerFit, perturb
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.settings import IMPACTS_AS_GOOD, IMPACTS_ERROR, IMPACTS_LEAST_SPREAD, IMPACTS_SHARE
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BandPowerComparison:
    """Compares candidates by band power on all samples, held-out ones included."""

    context: SearchContext
    power: BandPower
    """Of the whole recording."""
    chance: FloatArray
    """(c,): difference of two simulations of one hypothesis, in logarithms of the amplitude."""

    def score_candidate(self, deviations: FloatArray, hypothesis: Hypothesis) -> FittedCandidate:
        """The candidate with its misfits over chance, those of the held-out samples included."""
        whole = evaluate_fit(self.context.whole, self.context.tuning, deviations, hypothesis)
        off = self.power.misfits(self.power.measured - self.power.predict(whole.residuals))
        return FittedCandidate(whole, FitScore(*(self._times(misfit) for misfit in (off.fit, off.choose, off.test))))

    def _times(self, off: FloatArray) -> FloatArray:
        """Misfit over chance; 1 for a channel whose bands are all below the noise."""
        return off if np.isnan(off).all() else np.where(np.isnan(off), 1.0, off / self.chance)


def comparison_of(context: SearchContext, best: BandPowerFit) -> BandPowerComparison:
    """The comparison whose chance is that of the given fit."""
    power, model = BandPower(context.whole), context.tuning.tune(best.deviations)

    def predict(number: int) -> FloatArray:
        return power.predict(context.whole.residuals(model, perturb(best.hypothesis, number).list_placed_effects()))

    first, other = (np.asarray(each) for each in context.map_(predict, range(2)))
    differ = power.misfits(first - other)
    chance = np.fmax(np.fmax(differ.fit, differ.choose), differ.test)
    return BandPowerComparison(context, power, np.fmax(chance, IMPACTS_LEAST_SPREAD))


def is_convincing(named: FittedCandidate, retuned: FittedCandidate) -> bool:
    """Whether an explanation takes most of the re-tuned model's misfit and leaves little more than chance, on the
    samples to choose by and on those to test."""
    pairs = [
        (getattr(retuned.score, part), getattr(named.score, part))
        for part in ("choose", "test")
        if np.isfinite(getattr(named.score, part)).any()
    ]
    return bool(pairs) and all(
        _rms_over_channels(left) <= (1 - IMPACTS_SHARE) * _rms_over_channels(of)
        and _rms_over_channels(left) <= IMPACTS_ERROR
        for of, left in pairs
    )


def is_as_good(rival: FittedCandidate, named: FittedCandidate) -> bool:
    """Whether a rival's misfit is hardly larger, on the samples to choose by and on those to test."""
    ways = [(getattr(candidate.score, part) for candidate in (rival, named)) for part in ("choose", "test")]
    return all(
        _rms_over_channels(other) <= IMPACTS_AS_GOOD * _rms_over_channels(own)
        for other, own in ways
        if np.isfinite(other).any()
    )


def _rms_over_channels(times: FloatArray) -> float:
    """Root mean square over the channels."""
    return float(np.sqrt(np.nanmean(times**2)))


def worst_part(candidate: FittedCandidate) -> float:
    """The larger misfit over chance of the samples to choose by and of the held-out ones, each the root mean square of
    channels."""
    parts = (candidate.score.choose, candidate.score.test)
    return max((_rms_over_channels(part) for part in parts if np.isfinite(part).any()), default=0.0)
