"""The gain of a hypothesis on clean recordings, where its effect is absent: a baseline for its gain on other
recordings.

A hypothesis may reduce the error on a clean recording by absorbing model errors. Only a larger reduction on the
recordings under test is evidence for its effect. Gains are reductions of the logarithm of the rms error, per channel.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.errors.fit_score import rms_over
from analysis.diagnosis.errors.hypothesis import NOTHING, Hypothesis, combine, hypothesis_of_claim, without_claim
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, evaluate_fit, fit, gather_evidence, sensitivity
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.errors.whitened_measure import WhitenedMeasure
from analysis.diagnosis.search.starting_hypotheses import candidates
from analysis.diagnosis.types import Mapper
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

ROUNDS = 4
"""Gauss-Newton steps of a fit."""
TRIED = 2
"""Starting points, those of least cost, from which a fit is made."""

SETTLED = 1e-4
"""Relative reduction of the cost that counts as evidence in `hold`; smaller ones are within a fit's tolerance."""


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceRecording:
    """A clean recording with the model re-tuned to it, on which hypotheses are fitted for comparison."""

    measure: WhitenedMeasure
    tuning: Tuning
    base: Fitted
    """The re-tuned model without any effect."""
    known: Sensitivity
    """Sensitivity to the model's parameters at `base`."""
    evidence: Evidence
    """Signals and residuals of `base`, from which starting values are estimated."""

    def gain_on_clean(self, wanted: Hypothesis) -> FloatArray:
        """(c,): reduction of the logarithm of the rms error by the hypothesis, both models fitted to this recording."""
        measure, tuning = self.measure, self.tuning
        starts = [
            evaluate_fit(measure, tuning, self.base.deviations, hypothesis) for hypothesis in self._starts(wanted)
        ]
        starts.sort(key=lambda fitted: fitted.cost)
        ends = [fit(measure, tuning, start, self.known, ROUNDS) for start in starts[:TRIED]]
        best = min([*ends, self.base], key=lambda fitted: fitted.cost)
        without, with_it = self._channel_rms(self.base), self._channel_rms(best)
        return np.asarray(np.log(without) - np.log(np.maximum(with_it, np.finfo(float).tiny)))

    def costs_of(self, fixed: Hypothesis) -> tuple[float, float]:
        """Cost without and with a hypothesis whose parameters are fixed; the model is re-tuned in both cases."""
        start = evaluate_fit(self.measure, self.tuning, self.base.deviations, fixed)
        without, with_it = (fit(self.measure, self.tuning, each, self.known, ROUNDS) for each in (self.base, start))
        return without.cost, with_it.cost

    def _starts(self, wanted: Hypothesis) -> list[Hypothesis]:
        """Starting points: the parameters of the given hypothesis, and for its last claim also the starting values that
        this recording suggests."""
        last = wanted.claims[-1]
        own = [hypothesis for hypothesis in candidates([last.effect], self.evidence) if hypothesis.claims == (last,)]
        held = without_claim(wanted, len(wanted.claims) - 1)
        return [wanted, *(combine(held, hypothesis) for hypothesis in own)]

    def _channel_rms(self, fitted: Fitted) -> FloatArray:
        """(c,): rms residual on the samples to fit and to choose by, in units of `measure.unit`."""
        masks = [record.fit | record.choose for record in self.measure.records]
        return rms_over(self.measure.records, fitted.residuals, masks)


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceRecordings:
    """All clean recordings of a search; a hypothesis's gain on them counts against its gain elsewhere."""

    each: tuple[ReferenceRecording, ...]
    beyond: float
    """Factor on the largest gain among the reference recordings, which a gain elsewhere must exceed; the fewer these
    recordings, the larger the factor."""
    seen: dict[object, FloatArray] = field(default_factory=dict)
    """Gains computed so far, by `Hypothesis.key`."""

    def gain_on_clean(self, hypothesis: Hypothesis) -> FloatArray:
        """(c,): the gain that is counted against the hypothesis, `beyond` times the largest gain on the clean
        recordings (at least 0); (1,) zero for a model without effects."""
        if not hypothesis.claims:
            return np.zeros(1)
        if hypothesis.key not in self.seen:
            gains = np.max([each.gain_on_clean(hypothesis) for each in self.each], axis=0)
            self.seen[hypothesis.key] = self.beyond * np.maximum(gains, 0.0)
        return self.seen[hypothesis.key]

    def hold(self, hypothesis: Hypothesis, claim: int) -> bool:
        """Whether an effect with the parameters fitted elsewhere also improves the prediction of the clean recordings:
        then it was present before, and is no new fault. claim: index of the effect in the hypothesis."""
        effect = hypothesis.claims[claim].effect
        numbers = tuple(replace(parameter, fixed=True) for parameter in effect.parameters)
        held = replace(hypothesis.claims[claim], effect=replace(effect, parameters=numbers))
        fixed = hypothesis_of_claim(held, [placed.values for placed in hypothesis.of_claim(claim)])
        without, with_it = np.sum([each.costs_of(fixed) for each in self.each], axis=0)
        return bool(with_it < (1 - SETTLED) * without)


def reference_recording(
    measure: WhitenedMeasure, tuning: Tuning, deviations: FloatArray, map_: Mapper
) -> ReferenceRecording:
    """A clean recording prepared for comparison. deviations: of the model re-tuned to this recording, in standard
    deviations of the calibration; the fit is continued from there."""
    known = sensitivity(measure, tuning, deviations, NOTHING, map_)
    base = fit(measure, tuning, evaluate_fit(measure, tuning, deviations, NOTHING), known, ROUNDS)
    return ReferenceRecording(measure, tuning, base, known, gather_evidence(measure, tuning, base)[0])
