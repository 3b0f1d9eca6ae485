"""The shared state of all fits of a search, and the first fits of hypotheses that passed the screening.

The modules of this package receive a `SearchContext`; copies of it open held-out samples or fit to more samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore, fit_score, rms_over
from analysis.diagnosis.errors.hypothesis import Hypothesis, remove_claim
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, evaluate_fit, fit, sensitivity
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.reference_recordings import ReferenceRecordings
from analysis.diagnosis.search.screening import ScreenedHypothesis
from analysis.diagnosis.settings import (
    HELD_OUT_ALONE_ERROR,
    LEAST_FITTED,
    LEAST_PART,
    LOUDER_RATIO,
    MOST_FITTED,
    NOISE_ALONE,
    WORTH_FITTING,
)
from analysis.diagnosis.types import Mapper, Mask
from equalizer.effects.effect import AxisForce, JointForce
from equalizer.signals.signal import FloatArray

FIRST_FIT_ROUNDS = 3
"""Gauss-Newton steps of a first fit."""
STARTING, SCREENING, FITTING = "its starting values", "its screening", "its fit"
"""Steps of the work on each effect, in words."""
SENSED_SHARE = 0.06
"""Least sensitivity of an axis's channel to a parameter that counts, relative to the largest of any parameter there."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedCandidate:
    """A fitted hypothesis with its errors on the samples to fit, to choose by and to test."""

    fitted: Fitted
    score: FitScore
    clean_gain: float = 0.0
    """Reduction of the mean log error power on clean recordings, which is subtracted from the gain here."""

    @property
    def newest(self) -> str:
        """Name of the effect that was added last."""
        return self.fitted.hypothesis.claims[-1].effect.name

    @property
    def held_out_error(self) -> float:
        """Mean logarithm of the channels' held-out errors; infinite where there is none, or where it runs away."""
        mean_log = float(np.mean(np.log(self.score.test)))
        return np.inf if np.isnan(mean_log) else mean_log


HALVES, FINER_PARTS = 2, (8, 32, 128)
"""Parts into which held-out stretches are cut where some are opened; finer ones only where coarser ones do not leave
the mismatch in both, or nothing is found with these. A 128th of some seconds is as long as a contact with a stop."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchContext:
    """The measures, the open parameters and the rules that all fits of a search share."""

    measure: ErrorMeasure
    """On the samples to fit and to choose by."""
    whole: ErrorMeasure
    """With the held-out samples, too."""
    tuning: Tuning
    map_: Mapper
    excluded: frozenset[str] = frozenset()
    """Effects that are not to be named. Those that others refine are simulated all the same: a refined law is named
    only where its refinement shows, and without it that law is the excluded one."""
    references: ReferenceRecordings | None = None
    """Clean recordings: what a candidate gains on them is counted against it."""
    certain: tuple[Hypothesis, ...] = ()
    """Faults that a recording shows by itself (`model_free_faults`): added without a search."""
    guard: Guard = field(default_factory=Guard)
    """Isolates crashes of single effects."""
    opened: bool = False
    """A part of the held-out samples is used to fit and to choose by."""
    least_remaining_error: float = NOISE_ALONE
    """Error of the worst channel, in units of the noise, above which a further effect is searched for."""

    def open_alternate(self, mismatch_fit: FittedCandidate, coarsest: int = HALVES) -> "tuple[SearchContext, int]":
        """Copy of the context in which a part of every held-out stretch is used to fit and to choose by, and into how
        many parts stretches were cut: the first of two; where only one half shows the mismatch (such as in a sweep),
        every other of more. mismatch_fit: see `open_milder`. coarsest: least number of parts that is tried."""
        longest_samples = max(record.longest_held_out() for record in self.whole.records)
        part_counts = [parts for parts in (HALVES, *FINER_PARTS) if parts >= coarsest]
        for parts in (parts for parts in part_counts if longest_samples >= parts * LEAST_PART):
            opened_masks = [record.every_other_part(parts) for record in self.whole.records]
            if self._both_show(opened_masks, mismatch_fit):
                return self._open(opened_masks), parts
        return self._open([record.every_other_part(coarsest) for record in self.whole.records]), coarsest

    def open_milder(self, mismatch_fit: FittedCandidate) -> "SearchContext | None":
        """Copy of the context in which all held-out segments but the loudest are used to fit and to choose by, where
        both show, in the channel where the held-out samples show most, a mismatch that the other samples do not: the
        loudest still tests by another kind of command. None where they do not. mismatch_fit: a fit with its residuals
        in all samples, and its held-out errors."""
        records = self.whole.records
        levels = [level for record in records for _, level in record.held_out_levels()]
        opened_masks = [record.held_out_below(max(levels, default=0.0) / LOUDER_RATIO) for record in records]
        if not any(mask.any() for mask in opened_masks):
            return None
        return self._open(opened_masks) if self._both_show(opened_masks, mismatch_fit) else None

    def _both_show(self, opened_masks: list[Mask], mismatch_fit: FittedCandidate) -> bool:
        """Whether opened samples and those that stay held out show what the other samples do not."""
        # Another channel may show a little of something else, such as friction that is not fitted to the last.
        records, worst_channel = self.whole.records, int(np.argmax(np.nan_to_num(mismatch_fit.score.test)))
        sealed_masks = [record.test & ~mask for record, mask in zip(records, opened_masks, strict=True)]
        scale = self.whole.unit / self.whole.noise
        errors = [
            (rms_over(records, mismatch_fit.fitted.residuals, part) * scale)[[worst_channel]]
            for part in (opened_masks, sealed_masks)
        ]
        return all(shows_only_held_out(channel_errors, mismatch_fit) for channel_errors in errors)

    def _open(self, opened_masks: Sequence[Mask]) -> "SearchContext":
        records = (record.unseal(mask) for record, mask in zip(self.whole.records, opened_masks, strict=True))
        full_measure = self.whole.with_records(tuple(records))
        return replace(self, measure=full_measure.shorten(), whole=full_measure, opened=True)

    def fit_to_all(self) -> "SearchContext":
        """Copy of the context that also fits to the samples to choose by: what a force balance has chosen needs no
        choice."""
        measure, full_measure = (
            source.with_records(tuple(record.fit_to_all() for record in source.records))
            for source in (self.measure, self.whole)
        )
        return replace(self, measure=measure, whole=full_measure)

    def candidate(self, fitted: Fitted) -> FittedCandidate:
        """The fit scored on the samples to fit and to choose by; its `test` is NaN."""
        return self._score(fitted, self.measure)

    def with_test_score(self, candidate: FittedCandidate) -> FittedCandidate:
        """The candidate scored on all samples, held-out ones included."""
        fitted = evaluate_fit(self.whole, self.tuning, candidate.fitted.deviations, candidate.fitted.hypothesis)
        return self._score(fitted, self.whole)

    def _score(self, fitted: Fitted, measure: ErrorMeasure) -> FittedCandidate:
        score = fit_score(measure, fitted.residuals)
        if self.references is None:
            return FittedCandidate(fitted, score)
        clean_gain = self.references.compute_clean_gain(fitted.hypothesis)
        return FittedCandidate(fitted, score.larger(np.exp(clean_gain)), 2 * float(clean_gain.mean()))


def shows_only_held_out(errors: FloatArray, candidate: FittedCandidate) -> bool:
    """Whether held-out samples show a mismatch that those to fit and to choose by do not. errors: (c,), on held-out
    samples, times the noise."""
    largest_error = float(np.nanmax(errors, initial=0.0))
    return largest_error > HELD_OUT_ALONE_ERROR * max(candidate.score.worst_channel, 1.0)


def fit_first(
    context: SearchContext, base: Fitted, jacobian: Sensitivity, screened: Sequence[ScreenedHypothesis]
) -> list[Fitted]:
    """Fits of the hypotheses with the largest predicted gains, the best first."""
    measure, tuning = context.measure, context.tuning

    def make_first_fit(entry: ScreenedHypothesis) -> Fitted:
        return fit(
            measure,
            tuning,
            evaluate_fit(measure, tuning, base.deviations, entry.hypothesis),
            jacobian,
            FIRST_FIT_ROUNDS,
        )

    guarded_map = context.guard.wrap(context.map_, FITTING)
    fits: list[Fitted] = list(guarded_map(make_first_fit, _select_worth_fitting(base, screened)))  # type: ignore[arg-type]
    return sorted(fits, key=lambda fitted: fitted.cost)


def compute_sensitivity(
    context: SearchContext, deviations: np.ndarray, hypothesis: Hypothesis, with_forces: bool = False
) -> Sensitivity:
    """Sensitivity of the prediction to the model's own parameters. Motion-dependent forces are left out first:
    simulations are quick without them, and small forces hardly change the sensitivity."""
    reduced = hypothesis
    for number in reversed(range(len(hypothesis.claims))):
        if isinstance(hypothesis.claims[number].effect.action, (AxisForce, JointForce)):
            reduced = remove_claim(reduced, number)
    base_jacobian = sensitivity(context.measure, context.tuning, deviations, reduced, context.map_)
    if not with_forces or reduced is hypothesis:
        return base_jacobian
    parameters = find_sensitive_parameters(context.measure, context.tuning, base_jacobian, hypothesis)
    return sensitivity(
        context.measure, context.tuning, deviations, hypothesis, context.map_, (base_jacobian.columns, parameters)
    )


def _select_worth_fitting(base: Fitted, screened: Sequence[ScreenedHypothesis]) -> list[ScreenedHypothesis]:
    interleaved = _interleave_starts(screened)
    best_gain = max((base.cost - entry.cost for entry in interleaved), default=0.0)
    selected = [entry for entry in interleaved if base.cost - entry.cost >= WORTH_FITTING * best_gain]
    return (selected if len(selected) >= LEAST_FITTED else interleaved[:LEAST_FITTED])[:MOST_FITTED]


def _interleave_starts(screened: Sequence[ScreenedHypothesis]) -> list[ScreenedHypothesis]:
    """The hypotheses in a new order: the best start of each before the second start of any."""
    start_counts: dict[object, int] = {}
    ranked = []
    for entry in screened:
        key = entry.hypothesis.key
        start_counts[key] = start_counts.get(key, -1) + 1
        ranked.append((start_counts[key], entry))
    return [entry for _, entry in sorted(ranked, key=lambda pair: pair[0])]


def find_sensitive_parameters(
    measure: ErrorMeasure, tuning: Tuning, base_jacobian: Sensitivity, hypothesis: Hypothesis
) -> list[int]:
    """Parameters whose sensitivity changes with the hypothesis's forces: those that move the axes at which these act.
    base_jacobian: sensitivity without motion-dependent forces."""
    forces = [
        effect
        for effect in hypothesis.list_placed_effects()
        if isinstance(effect.effect.action, (AxisForce, JointForce))
    ]
    model = tuning.tune(np.zeros(len(tuning.names)))
    if not forces or any(isinstance(force.effect.action, JointForce) for force in forces):
        return list(range(len(tuning.names)))
    mobility = np.abs(model.output @ np.linalg.solve(model.mass, model.input))
    sites = {site for force in forces for site in force.sites}
    channel_rms = _compute_channel_rms(measure, base_jacobian.columns, model.outputs)
    is_sensitive = np.zeros(len(tuning.names), dtype=bool)
    for site in sites:
        parameter_rms = channel_rms[:, int(np.argmax(mobility[:, site]))]
        is_sensitive |= parameter_rms > SENSED_SHARE * parameter_rms.max(initial=0.0)
    return np.flatnonzero(is_sensitive).tolist()


def _compute_channel_rms(measure: ErrorMeasure, columns: FloatArray, outputs: int) -> FloatArray:
    """(t, p): rms of each parameter's sensitivity per response channel. columns: (t, samples), over all records."""
    squares, first = np.zeros((len(columns), outputs)), 0
    for record in measure.records:
        count, channels = int(record.fit.sum()), record.measured.shape[1]
        part = columns[:, first : first + count * channels].reshape(len(columns), count, channels)[:, :, :outputs]
        squares += np.einsum("tnc,tnc->tc", part, part)
        first += count * channels
    return np.sqrt(squares)
