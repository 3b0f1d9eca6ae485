"""Compare hypotheses by band power, for chaotic responses whose waveform cannot be predicted (play with impacts).

A misfit is the rms logarithm of the ratio of measured and simulated amplitudes, divided by its chance variation: the
same quantity between two simulations of one hypothesis, whose coordinates differ by 1e-9 (`perturb`). Impacts make
these simulations diverge, so that no hypothesis can match the recording better than two of its own simulations match
each other.
"""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.band_power_fit import BandPowerFit, perturb
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import IMPACTS_ERROR, IMPACTS_LEAST_SPREAD, IMPACTS_RIVAL_RATIO, IMPACTS_SHARE
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BandPowerComparison:
    """Comparison of candidates by band power on all samples, held-out ones included."""

    context: SearchContext
    power: BandPower
    """Band powers of the recordings."""
    chance_variation: FloatArray
    """(c,): chance variation, the rms difference between two simulations of one hypothesis in the natural logarithm of
    the amplitude; at least `IMPACTS_LEAST_SPREAD`."""

    def score_candidate(self, deviations: FloatArray, hypothesis: Hypothesis) -> FittedCandidate:
        """Simulate the hypothesis and score it: misfits (c,) over the chance variation on the samples to fit, to choose
        by and to test. deviations: of the model's tuned parameters, as for `Tuning.tune`."""
        fitted = evaluate_fit(self.context.full_measure, self.context.tuning, deviations, hypothesis)
        misfits = self.power.compute_misfits(self.power.measured - self.power.predict(fitted.residuals))
        return FittedCandidate(
            fitted,
            FitScore(*(self._divide_by_chance(misfit) for misfit in (misfits.fit, misfits.choose, misfits.test))),
        )

    def _divide_by_chance(self, misfit: FloatArray) -> FloatArray:
        """Divide a misfit (c,) by the chance variation. A NaN, of a channel without a band above the noise, becomes 1,
        unless all channels are NaN: then all stay NaN."""
        return misfit if np.isnan(misfit).all() else np.where(np.isnan(misfit), 1.0, misfit / self.chance_variation)


def make_band_power_comparison(context: SearchContext, best_fit: BandPowerFit) -> BandPowerComparison:
    """Make the comparison with the chance variation of a fit: per channel the largest of its values on the samples to
    fit, to choose by and to test, at least `IMPACTS_LEAST_SPREAD` (also for a channel without comparable bands)."""
    power, tuned_model = BandPower(context.full_measure), context.tuning.tune(best_fit.deviations)

    def predict_perturbed(perturbation_index: int) -> FloatArray:
        return power.predict(
            context.full_measure.residuals(
                tuned_model, perturb(best_fit.hypothesis, perturbation_index).list_placed_effects()
            )
        )

    first_powers, second_powers = (np.asarray(powers) for powers in context.map_(predict_perturbed, range(2)))
    differences = power.compute_misfits(first_powers - second_powers)
    chance_variation = np.fmax(np.fmax(differences.fit, differences.choose), differences.test)
    return BandPowerComparison(context, power, np.fmax(chance_variation, IMPACTS_LEAST_SPREAD))


def is_convincing(explanation: FittedCandidate, retuned_candidate: FittedCandidate) -> bool:
    """Whether an explanation removes at least `IMPACTS_SHARE` of the re-tuned model's misfit and leaves at most
    `IMPACTS_ERROR` times the chance variation, both on the samples to choose by and on those to test. A set in which
    the explanation has no finite misfit is skipped; False if both are skipped."""
    misfit_pairs = [
        (getattr(retuned_candidate.score, role), getattr(explanation.score, role))
        for role in ("choose", "test")
        if np.isfinite(getattr(explanation.score, role)).any()
    ]
    return bool(misfit_pairs) and all(
        _compute_rms_over_channels(named_misfit) <= (1 - IMPACTS_SHARE) * _compute_rms_over_channels(retuned_misfit)
        and _compute_rms_over_channels(named_misfit) <= IMPACTS_ERROR
        for retuned_misfit, named_misfit in misfit_pairs
    )


def is_as_good(rival: FittedCandidate, named_candidate: FittedCandidate) -> bool:
    """Whether a rival's misfit is at most `IMPACTS_RIVAL_RATIO` times that of the named hypothesis, on the samples to
    choose by and on those to test. A set in which the rival has no finite misfit is skipped; True if both are."""
    misfit_pairs = [
        (getattr(candidate.score, role) for candidate in (rival, named_candidate)) for role in ("choose", "test")
    ]
    return all(
        _compute_rms_over_channels(rival_misfit) <= IMPACTS_RIVAL_RATIO * _compute_rms_over_channels(named_misfit)
        for rival_misfit, named_misfit in misfit_pairs
        if np.isfinite(rival_misfit).any()
    )


def _compute_rms_over_channels(misfit: FloatArray) -> float:
    """Compute the root mean square over the channels without those that are NaN. misfit: (c,), not all NaN."""
    return float(np.sqrt(np.nanmean(misfit**2)))


def compute_worst_misfit(candidate: FittedCandidate) -> float:
    """Compute the larger of the misfits on the samples to choose by and on the held-out samples, each the root mean
    square over channels, in units of the chance variation; a set without a finite misfit is skipped, and 0 is
    returned if both are."""
    misfits = (candidate.score.choose, candidate.score.test)
    return max((_compute_rms_over_channels(misfit) for misfit in misfits if np.isfinite(misfit).any()), default=0.0)
