"""Compute the gain of a hypothesis on clean recordings, where its effect is absent, as a baseline for its gain on
others.

A hypothesis may reduce the error on a clean recording by absorbing model errors. Only a larger reduction on the
recordings under test is evidence for its effect. Gains are reductions of the logarithm of the rms error, per channel.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.errors.fit_score import compute_residual_rms
from analysis.diagnosis.errors.hypothesis import (
    NO_EFFECTS,
    Hypothesis,
    combine_hypotheses,
    make_claim_hypothesis,
    remove_claim,
)
from analysis.diagnosis.errors.output_error import (
    Fitted,
    Sensitivity,
    build_jacobian,
    evaluate_fit,
    fit,
    gather_evidence,
)
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.errors.whitened_measure import WhitenedMeasure
from analysis.diagnosis.search.starting_hypotheses import list_candidates
from analysis.diagnosis.types import Mapper
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

FIT_STEPS = 4
"""Gauss-Newton steps of a fit. Chosen."""
MAX_FITTED_STARTS = 2
"""Number of starting points, those of least cost, from which a fit is made. Chosen."""

SIGNIFICANT_COST_DECREASE = 1e-4
"""Relative reduction of the cost above which an effect counts as present (`is_present_on_clean`). Chosen: smaller ones
are within a fit's tolerance."""


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceRecording:
    """A clean recording with the model re-tuned to it, on which hypotheses are fitted for comparison."""

    measure: WhitenedMeasure
    tuning: Tuning
    base: Fitted
    """The re-tuned model without any effect."""
    jacobian: Sensitivity
    """Sensitivity to the model's parameters at `base`."""
    evidence: Evidence
    """Signals and residuals of `base` in the first record, from which starting values are estimated."""

    def compute_clean_gain(self, tested_hypothesis: Hypothesis) -> FloatArray:
        """Compute (c,): reduction of the logarithm of the rms error by the hypothesis, both models fitted to this
        recording."""
        measure, tuning = self.measure, self.tuning
        starts = [
            evaluate_fit(measure, tuning, self.base.deviations, hypothesis)
            for hypothesis in self._list_starts(tested_hypothesis)
        ]
        starts.sort(key=lambda fitted: fitted.cost)
        fits = [fit(measure, tuning, start, self.jacobian, FIT_STEPS) for start in starts[:MAX_FITTED_STARTS]]
        best_fit = min([*fits, self.base], key=lambda fitted: fitted.cost)
        rms_without, rms_with = self._compute_channel_rms(self.base), self._compute_channel_rms(best_fit)
        return np.asarray(np.log(rms_without) - np.log(np.maximum(rms_with, np.finfo(float).tiny)))

    def compute_costs(self, fixed_hypothesis: Hypothesis) -> tuple[float, float]:
        """Compute the cost without and with a hypothesis whose parameters are fixed; the model is re-tuned in both
        cases."""
        start = evaluate_fit(self.measure, self.tuning, self.base.deviations, fixed_hypothesis)
        base_fit, fixed_fit = (
            fit(self.measure, self.tuning, start_fit, self.jacobian, FIT_STEPS) for start_fit in (self.base, start)
        )
        return base_fit.cost, fixed_fit.cost

    def _list_starts(self, tested_hypothesis: Hypothesis) -> list[Hypothesis]:
        """List starting points: the parameters of the given hypothesis, and for its last claim also the starting values
        that are estimated from this recording."""
        last_claim = tested_hypothesis.claims[-1]
        suggested_hypotheses = [
            hypothesis
            for hypothesis in list_candidates([last_claim.effect], self.evidence)
            if hypothesis.claims == (last_claim,)
        ]
        other_claims = remove_claim(tested_hypothesis, len(tested_hypothesis.claims) - 1)
        return [
            tested_hypothesis,
            *(combine_hypotheses(other_claims, hypothesis) for hypothesis in suggested_hypotheses),
        ]

    def _compute_channel_rms(self, fitted: Fitted) -> FloatArray:
        """Compute (c,): rms residual on the samples to fit and to choose by, in units of `measure.unit`."""
        masks = [record.fit | record.choose for record in self.measure.records]
        return compute_residual_rms(fitted.residuals, masks)


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceRecordings:
    """All clean recordings of a search; a hypothesis's gain on them counts against its gain on those under test."""

    recordings: tuple[ReferenceRecording, ...]
    gain_factor: float
    """Factor on the largest gain among the clean recordings, which a gain on the recordings under test must exceed; the
    fewer the clean recordings, the larger the factor."""
    gains_by_key: dict[object, FloatArray] = field(default_factory=dict)
    """Results of `compute_clean_gain` so far, by `Hypothesis.key`: hypotheses that differ in parameters alone share
    one. The model is no part of the key, because `recordings` contain their own, re-tuned to them."""

    def compute_clean_gain(self, hypothesis: Hypothesis) -> FloatArray:
        """Compute (c,): the gain that is counted against the hypothesis, `gain_factor` times the largest gain on the
        clean recordings (at least 0); (1,) zero for a model without effects."""
        if not hypothesis.claims:
            return np.zeros(1)
        if hypothesis.key not in self.gains_by_key:
            gains = np.max([reference.compute_clean_gain(hypothesis) for reference in self.recordings], axis=0)
            self.gains_by_key[hypothesis.key] = self.gain_factor * np.maximum(gains, 0.0)
        return self.gains_by_key[hypothesis.key]

    def is_present_on_clean(self, hypothesis: Hypothesis, claim_index: int) -> bool:
        """Whether an effect, with the parameters fitted to the recordings under test, also improves the prediction of
        the clean recordings: then it was present before, and is no new fault. claim_index: of the effect in the
        hypothesis."""
        effect = hypothesis.claims[claim_index].effect
        fixed_parameters = tuple(replace(parameter, fixed=True) for parameter in effect.parameters)
        fixed_claim = replace(hypothesis.claims[claim_index], effect=replace(effect, parameters=fixed_parameters))
        fixed_hypothesis = make_claim_hypothesis(
            fixed_claim, [placed_effect.values for placed_effect in hypothesis.list_effects_of(claim_index)]
        )
        cost_without, cost_with = np.sum(
            [reference.compute_costs(fixed_hypothesis) for reference in self.recordings], axis=0
        )
        return bool(cost_with < (1 - SIGNIFICANT_COST_DECREASE) * cost_without)


def prepare_reference_recording(
    measure: WhitenedMeasure, tuning: Tuning, deviations: FloatArray, map_: Mapper
) -> ReferenceRecording:
    """Prepare a clean recording for comparison. deviations: of the model re-tuned to this recording, in standard
    deviations of the calibration; the fit is continued from there."""
    jacobian = build_jacobian(measure, tuning, deviations, NO_EFFECTS, map_)
    base = fit(measure, tuning, evaluate_fit(measure, tuning, deviations, NO_EFFECTS), jacobian, FIT_STEPS)
    return ReferenceRecording(measure, tuning, base, jacobian, gather_evidence(measure, tuning, base)[0])
