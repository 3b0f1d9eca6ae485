"""The shared state of all fits of a search, and the first fits of hypotheses that passed the screening.

The modules of this package receive a `SearchContext`; copies of it open held-out samples or fit to more samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore, compute_fit_score, compute_residual_rms
from analysis.diagnosis.errors.hypothesis import Hypothesis, remove_claim
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, build_jacobian, evaluate_fit, fit
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
LEAST_SENSITIVITY_SHARE = 0.06
"""Least sensitivity of an axis's channel to a parameter that counts, relative to the largest of any parameter there."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedCandidate:
    """A fitted hypothesis with its errors on the samples to fit, to choose by and to test."""

    fitted: Fitted
    score: FitScore
    clean_gain: float = 0.0
    """Reduction of the mean log error power on clean recordings, which is subtracted from the gain on these."""

    @property
    def newest(self) -> str:
        """Name of the effect that was added last."""
        return self.fitted.hypothesis.claims[-1].effect.name

    @property
    def held_out_error(self) -> float:
        """Mean logarithm of the channels' held-out errors, in units of the noise; infinite without held-out samples, or
        where the simulation diverges."""
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
    full_measure: ErrorMeasure
    """The measure on all samples, held-out ones included."""
    tuning: Tuning
    map_: Mapper
    excluded: frozenset[str] = frozenset()
    """Effects that are not to be named. Those that others refine are simulated nevertheless, as rivals of their
    refinements."""
    references: ReferenceRecordings | None = None
    """Clean recordings: what a candidate gains on them is counted against it."""
    certain: tuple[Hypothesis, ...] = ()
    """Sensor faults that are detected without a model (`model_free_faults`): added without a search."""
    guard: Guard = field(default_factory=Guard)
    """Isolates crashes of single effects."""
    has_opened_samples: bool = False
    """Whether a part of the held-out samples is used to fit and to choose by."""
    least_remaining_error: float = NOISE_ALONE
    """Error of the worst channel, in units of the noise, above which a further effect is searched for."""

    def open_alternate(self, mismatch_fit: FittedCandidate, least_parts: int = HALVES) -> "tuple[SearchContext, int]":
        """Return a copy of the context in which a part of every held-out stretch is used to fit and to choose by, and
        the number of parts per stretch: the first of two; where only one half shows the mismatch (such as in a sweep),
        every other of more. mismatch_fit: see `open_milder`. least_parts: least number of parts that is tried."""
        longest_samples = max(record.compute_longest_test_stretch() for record in self.full_measure.records)
        part_counts = [parts for parts in (HALVES, *FINER_PARTS) if parts >= least_parts]
        for parts in (parts for parts in part_counts if longest_samples >= parts * LEAST_PART):
            opened_masks = [record.mask_alternate_parts(parts) for record in self.full_measure.records]
            if self._is_shown_by_both(opened_masks, mismatch_fit):
                return self._open_samples(opened_masks), parts
        return self._open_samples(
            [record.mask_alternate_parts(least_parts) for record in self.full_measure.records]
        ), least_parts

    def open_milder(self, mismatch_fit: FittedCandidate) -> "SearchContext | None":
        """Return a copy of the context in which all held-out segments but the loudest are used to fit and to choose by;
        the loudest remains as test. None unless both, in the channel with the largest held-out error, show a mismatch
        that the other samples do not. mismatch_fit: a fit with its residuals
        in all samples, and its held-out errors."""
        records = self.full_measure.records
        levels = [level for record in records for _, level in record.list_test_levels()]
        opened_masks = [record.mask_test_below(max(levels, default=0.0) / LOUDER_RATIO) for record in records]
        if not any(mask.any() for mask in opened_masks):
            return None
        return self._open_samples(opened_masks) if self._is_shown_by_both(opened_masks, mismatch_fit) else None

    def _is_shown_by_both(self, opened_masks: list[Mask], mismatch_fit: FittedCandidate) -> bool:
        """Whether opened samples and those that stay held out both show a mismatch that the other samples do not."""
        # Only the worst channel counts: others may show a small remaining error of a fitted effect, such as friction.
        records, worst_channel = self.full_measure.records, int(np.argmax(np.nan_to_num(mismatch_fit.score.test)))
        sealed_masks = [record.test & ~mask for record, mask in zip(records, opened_masks, strict=True)]
        scale = self.full_measure.unit / self.full_measure.noise
        errors = [
            (compute_residual_rms(records, mismatch_fit.fitted.residuals, part) * scale)[[worst_channel]]
            for part in (opened_masks, sealed_masks)
        ]
        return all(shows_only_held_out(channel_errors, mismatch_fit) for channel_errors in errors)

    def _open_samples(self, opened_masks: Sequence[Mask]) -> "SearchContext":
        """Return a copy of the context in which the masked held-out samples are used to fit and to choose by."""
        records = (record.unseal(mask) for record, mask in zip(self.full_measure.records, opened_masks, strict=True))
        full_measure = self.full_measure.with_records(tuple(records))
        return replace(self, measure=full_measure.shorten(), full_measure=full_measure, has_opened_samples=True)

    def fit_to_all(self) -> "SearchContext":
        """Return a copy of the context that also fits to the samples to choose by: laws that a force balance has chosen
        need no further selection."""
        measure, full_measure = (
            source.with_records(tuple(record.fit_to_all() for record in source.records))
            for source in (self.measure, self.full_measure)
        )
        return replace(self, measure=measure, full_measure=full_measure)

    def score_fit(self, fitted: Fitted) -> FittedCandidate:
        """Score the fit on the samples to fit and to choose by; its `test` is NaN."""
        return self._score(fitted, self.measure)

    def with_test_score(self, candidate: FittedCandidate) -> FittedCandidate:
        """Return the candidate scored on all samples, held-out ones included."""
        fitted = evaluate_fit(self.full_measure, self.tuning, candidate.fitted.deviations, candidate.fitted.hypothesis)
        return self._score(fitted, self.full_measure)

    def _score(self, fitted: Fitted, measure: ErrorMeasure) -> FittedCandidate:
        """Score the residuals; errors are raised by the gain on clean recordings where these are given."""
        score = compute_fit_score(measure, fitted.residuals)
        if self.references is None:
            return FittedCandidate(fitted, score)
        clean_gain = self.references.compute_clean_gain(fitted.hypothesis)
        return FittedCandidate(fitted, score.scale_errors(np.exp(clean_gain)), 2 * float(clean_gain.mean()))


def shows_only_held_out(errors: FloatArray, candidate: FittedCandidate) -> bool:
    """Whether held-out samples show a mismatch that those to fit and to choose by do not. errors: (c,), on held-out
    samples, times the noise."""
    largest_error = float(np.nanmax(errors, initial=0.0))
    return largest_error > HELD_OUT_ALONE_ERROR * max(candidate.score.worst_channel, 1.0)


def fit_first(
    context: SearchContext, base: Fitted, jacobian: Sensitivity, screened: Sequence[ScreenedHypothesis]
) -> list[Fitted]:
    """Fit the hypotheses with the largest predicted gains, `FIRST_FIT_ROUNDS` steps each; the smallest cost first.
    Hypotheses whose fit crashes are left out."""
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
    """Compute the sensitivity of the prediction to the model's own parameters. Motion-dependent forces are left out,
    because simulations are fast without them and small forces hardly change it; with_forces recomputes it with them
    for the parameters of `find_sensitive_parameters`."""
    reduced = hypothesis
    for number in reversed(range(len(hypothesis.claims))):
        if isinstance(hypothesis.claims[number].effect.action, (AxisForce, JointForce)):
            reduced = remove_claim(reduced, number)
    base_jacobian = build_jacobian(context.measure, context.tuning, deviations, reduced, context.map_)
    if not with_forces or reduced is hypothesis:
        return base_jacobian
    parameters = find_sensitive_parameters(context.measure, context.tuning, base_jacobian, hypothesis)
    return build_jacobian(
        context.measure, context.tuning, deviations, hypothesis, context.map_, (base_jacobian.columns, parameters)
    )


def _select_worth_fitting(base: Fitted, screened: Sequence[ScreenedHypothesis]) -> list[ScreenedHypothesis]:
    """Select the hypotheses with at least `WORTH_FITTING` of the largest predicted gain; from `LEAST_FITTED` to
    `MOST_FITTED` of them."""
    interleaved = _interleave_starts(screened)
    best_gain = max((base.cost - entry.cost for entry in interleaved), default=0.0)
    selected = [entry for entry in interleaved if base.cost - entry.cost >= WORTH_FITTING * best_gain]
    return (selected if len(selected) >= LEAST_FITTED else interleaved[:LEAST_FITTED])[:MOST_FITTED]


def _interleave_starts(screened: Sequence[ScreenedHypothesis]) -> list[ScreenedHypothesis]:
    """Reorder the hypotheses: the best start of each before the second start of any."""
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
    """Find the parameters whose sensitivity changes with the hypothesis's forces: those that move the axes at which
    these act; all of them for a force in a joint.
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
        is_sensitive |= parameter_rms > LEAST_SENSITIVITY_SHARE * parameter_rms.max(initial=0.0)
    return np.flatnonzero(is_sensitive).tolist()


def _compute_channel_rms(measure: ErrorMeasure, columns: FloatArray, outputs: int) -> FloatArray:
    """(t, p): rms of each parameter's sensitivity per response channel. columns: (t, samples), over all records."""
    squares, first_column = np.zeros((len(columns), outputs)), 0
    for record in measure.records:
        count, channels = int(record.fit.sum()), record.measured.shape[1]
        part = columns[:, first_column : first_column + count * channels].reshape(len(columns), count, channels)[
            :, :, :outputs
        ]
        squares += np.einsum("tnc,tnc->tc", part, part)
        first_column += count * channels
    return np.sqrt(squares)
