"""Compares hypotheses by band power, for responses whose waveform cannot be predicted (rattling play).

A misfit is the rms logarithm of the ratio of measured and simulated amplitudes, divided by its chance variation: the
same quantity between two simulations of one hypothesis, whose coordinates differ by 1e-9 (`perturb`). Impacts make
these simulations diverge, and no hypothesis can be expected to match the recording better than it matches itself.
Called by `impacts`.
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
    """Band powers of the whole recording."""
    chance: FloatArray
    """(c,): chance variation, the rms difference between two simulations of one hypothesis in the natural logarithm of
    the amplitude; at least `IMPACTS_LEAST_SPREAD`."""

    def score_candidate(self, deviations: FloatArray, hypothesis: Hypothesis) -> FittedCandidate:
        """Simulate the hypothesis and return the candidate with its misfits over the chance variation, those on
        held-out samples included."""
        fitted = evaluate_fit(self.context.full_measure, self.context.tuning, deviations, hypothesis)
        misfits = self.power.compute_misfits(self.power.measured - self.power.predict(fitted.residuals))
        return FittedCandidate(
            fitted,
            FitScore(*(self._divide_by_chance(misfit) for misfit in (misfits.fit, misfits.choose, misfits.test))),
        )

    def _divide_by_chance(self, misfit: FloatArray) -> FloatArray:
        """(c,): misfit over the chance variation; 1 for a channel whose bands are all below the noise, NaN where no
        channel has a band above it."""
        return misfit if np.isnan(misfit).all() else np.where(np.isnan(misfit), 1.0, misfit / self.chance)


def make_comparison(context: SearchContext, best: BandPowerFit) -> BandPowerComparison:
    """Make the comparison with the chance variation of the given fit: per channel the largest of its values on the
    samples to fit, to choose by and to test."""
    power, model = BandPower(context.full_measure), context.tuning.tune(best.deviations)

    def predict(number: int) -> FloatArray:
        return power.predict(
            context.full_measure.residuals(model, perturb(best.hypothesis, number).list_placed_effects())
        )

    first_powers, second_powers = (np.asarray(powers) for powers in context.map_(predict, range(2)))
    differences = power.compute_misfits(first_powers - second_powers)
    chance = np.fmax(np.fmax(differences.fit, differences.choose), differences.test)
    return BandPowerComparison(context, power, np.fmax(chance, IMPACTS_LEAST_SPREAD))


def is_convincing(named: FittedCandidate, retuned: FittedCandidate) -> bool:
    """Whether an explanation removes at least `IMPACTS_SHARE` of the re-tuned model's misfit and leaves at most
    `IMPACTS_ERROR` times the chance variation, on the samples to choose by and on those to test."""
    misfit_pairs = [
        (getattr(retuned.score, part), getattr(named.score, part))
        for part in ("choose", "test")
        if np.isfinite(getattr(named.score, part)).any()
    ]
    return bool(misfit_pairs) and all(
        _compute_rms_over_channels(named_misfit) <= (1 - IMPACTS_SHARE) * _compute_rms_over_channels(retuned_misfit)
        and _compute_rms_over_channels(named_misfit) <= IMPACTS_ERROR
        for retuned_misfit, named_misfit in misfit_pairs
    )


def is_as_good(rival: FittedCandidate, named: FittedCandidate) -> bool:
    """Whether a rival's misfit is at most `IMPACTS_AS_GOOD` times that of the named hypothesis, on the samples to
    choose by and on those to test."""
    misfit_pairs = [(getattr(candidate.score, part) for candidate in (rival, named)) for part in ("choose", "test")]
    return all(
        _compute_rms_over_channels(rival_misfit) <= IMPACTS_AS_GOOD * _compute_rms_over_channels(named_misfit)
        for rival_misfit, named_misfit in misfit_pairs
        if np.isfinite(rival_misfit).any()
    )


def _compute_rms_over_channels(misfit: FloatArray) -> float:
    """Compute the root mean square over the channels; NaN is left out. misfit: (c,)."""
    return float(np.sqrt(np.nanmean(misfit**2)))


def compute_worst_misfit(candidate: FittedCandidate) -> float:
    """Compute the larger of the misfits on the samples to choose by and on the held-out samples, each the root mean
    square over channels, in units of the chance variation; 0 where there is none."""
    parts = (candidate.score.choose, candidate.score.test)
    return max((_compute_rms_over_channels(part) for part in parts if np.isfinite(part).any()), default=0.0)
