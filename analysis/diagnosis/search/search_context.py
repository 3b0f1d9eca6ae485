"""Shared state of all fits of a search for missing effects, and the first fits of the screened hypotheses.

Samples have three roles: to fit parameters, to choose between hypotheses, and held out to test. A `SearchContext`
contains the error measure on the first two and on all samples; some of its methods return copies in which a part of the
held-out samples is opened (used to fit and to choose by), where these alone show a mismatch.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore, compute_fit_score, compute_residual_rms
from analysis.diagnosis.errors.hypothesis import Hypothesis, remove_claim
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, build_jacobian, evaluate_fit, fit
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.limits import (
    FITTING_GAIN_SHARE,
    HELD_OUT_ALONE_ERROR,
    LEAST_FITTED,
    LEAST_PART_SAMPLES,
    LOUDER_RATIO,
    MOST_FITTED,
    NOISE_ALONE,
)
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.reference_recordings import ReferenceRecordings
from analysis.diagnosis.search.screening import ScreenedHypothesis
from analysis.diagnosis.types import Mapper, Mask
from equalizer.effects.effect import AxisForce, JointForce
from equalizer.signals.signal import FloatArray

FIRST_FIT_STEPS = 3
"""Most Gauss-Newton steps of a first fit, which only ranks the hypotheses, and of a law with rounded exponents. Chosen
by hand."""
STARTING, SCREENING, FITTING = "its starting values", "its screening", "its fit"
"""Names of the steps of the search in the messages of `Guard` about an effect that crashes."""
LEAST_SENSITIVITY_SHARE = 0.06
"""Least sensitivity of an axis's channel to a parameter for which it is recomputed with forces, relative to the largest
of any parameter there. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedCandidate:
    """A fitted hypothesis with its errors on the samples to fit, to choose by and to test."""

    fitted: Fitted
    score: FitScore
    clean_gain: float = 0.0
    """Reduction of the mean log error power on the clean recordings, by which the errors in `score` were raised."""

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

    def compared_by_test(self) -> "FittedCandidate":
        """Return the candidate with its held-out errors in place of the others, to compare it by these."""
        return replace(self, score=FitScore(self.score.test, self.score.test, self.score.test))


HALVES, FINER_PARTS = 2, (8, 32, 128)
"""Numbers of equal parts into which each held-out stretch is cut, alternately opened and held out. More parts are used
where fewer do not leave the mismatch in both halves, or where no effect is found with fewer. The largest is chosen for
contacts with a stop: a 128th of a stretch of some seconds is about as long as a contact."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchContext:
    """The measures, the open parameters and the rules that all fits of a search share."""

    measure: ErrorMeasure
    """Error measure on the samples to fit and to choose by."""
    full_measure: ErrorMeasure
    """Error measure on all samples, held-out ones included."""
    tuning: Tuning
    """Parameters of the model itself that every fit adjusts."""
    map_: Mapper
    """`map`, or a parallel one."""
    excluded: frozenset[str] = frozenset()
    """Names of effects that are not to be named. Those that others refine are simulated nevertheless, as rivals of
    their refinements."""
    references: ReferenceRecordings | None = None
    """Clean recordings; None: there are none. The gain of a candidate on them is counted against it."""
    certain: tuple[Hypothesis, ...] = ()
    """Sensor faults that are detected without a model (`model_free_faults`): added without a search."""
    guard: Guard = field(default_factory=Guard)
    """Isolates crashes of single effects."""
    has_opened_samples: bool = False
    """Whether a part of the held-out samples is used to fit and to choose by."""
    least_remaining_error: float = NOISE_ALONE
    """Error of the worst channel, in units of the noise, above which a second or third effect is searched for."""

    def open_alternate_parts(
        self, mismatch_fit: FittedCandidate, least_parts: int = HALVES
    ) -> "tuple[SearchContext, int]":
        """Return a copy of the context in which every other part of each held-out stretch is opened, and the number of
        parts per stretch: the first number, from least_parts on, with which opened and held-out parts both show the
        mismatch (two parts do not in a sweep, for example), else least_parts. Numbers with parts below
        `LEAST_PART_SAMPLES` samples, of the longest stretch, are not tried. mismatch_fit: see
        `open_quieter_segments`."""
        longest_samples = max(record.compute_longest_test_stretch() for record in self.full_measure.records)
        part_counts = [part_count for part_count in (HALVES, *FINER_PARTS) if part_count >= least_parts]
        for part_count in (
            part_count for part_count in part_counts if longest_samples >= part_count * LEAST_PART_SAMPLES
        ):
            opened_masks = [record.mask_alternate_parts(part_count) for record in self.full_measure.records]
            if self._has_mismatch_in_both(opened_masks, mismatch_fit):
                return self._open_samples(opened_masks), part_count
        return self._open_samples(
            [record.mask_alternate_parts(least_parts) for record in self.full_measure.records]
        ), least_parts

    def open_quieter_segments(self, mismatch_fit: FittedCandidate) -> "SearchContext | None":
        """Return a copy of the context in which the held-out segments with a level below that of the loudest (by the
        factor `LOUDER_RATIO`) are opened; the others remain held out. None unless both, in the channel with the largest
        held-out error, show a mismatch that the other samples do not. mismatch_fit: fit with residuals in all samples
        and its held-out errors."""
        records = self.full_measure.records
        levels = [level for record in records for _, level in record.list_test_levels()]
        opened_masks = [record.mask_test_below(max(levels, default=0.0) / LOUDER_RATIO) for record in records]
        if not any(mask.any() for mask in opened_masks):
            return None
        return self._open_samples(opened_masks) if self._has_mismatch_in_both(opened_masks, mismatch_fit) else None

    def _has_mismatch_in_both(self, opened_masks: list[Mask], mismatch_fit: FittedCandidate) -> bool:
        """Whether opened samples and those that stay held out both have a mismatch that the other samples do not."""
        # Only the worst channel counts: others may show a small remaining error of a fitted effect, such as friction.
        records, worst_channel = self.full_measure.records, int(np.argmax(np.nan_to_num(mismatch_fit.score.test)))
        held_out_masks = [record.test & ~mask for record, mask in zip(records, opened_masks, strict=True)]
        noise_units = self.full_measure.unit / self.full_measure.noise
        errors_by_mask = [
            (compute_residual_rms(mismatch_fit.fitted.residuals, sample_mask) * noise_units)[[worst_channel]]
            for sample_mask in (opened_masks, held_out_masks)
        ]
        return all(has_held_out_mismatch(channel_errors, mismatch_fit) for channel_errors in errors_by_mask)

    def _open_samples(self, opened_masks: Sequence[Mask]) -> "SearchContext":
        """Return a copy of the context in which the masked held-out samples are used to fit and to choose by."""
        records = (
            record.release_test_samples(mask)
            for record, mask in zip(self.full_measure.records, opened_masks, strict=True)
        )
        full_measure = self.full_measure.with_records(tuple(records))
        return replace(self, measure=full_measure.shorten(), full_measure=full_measure, has_opened_samples=True)

    def join_fit_and_choose(self) -> "SearchContext":
        """Return a copy of the context that also fits to the samples to choose by, for laws that a force balance has
        already selected."""
        measure, full_measure = (
            original.with_records(tuple(record.join_fit_and_choose() for record in original.records))
            for original in (self.measure, self.full_measure)
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


def has_held_out_mismatch(errors: FloatArray, candidate: FittedCandidate) -> bool:
    """Whether held-out samples have a mismatch that those to fit and to choose by do not. errors: (c,), rms on held-out
    samples in units of the noise; NaN (no such samples) does not count."""
    largest_error = float(np.nanmax(errors, initial=0.0))
    return largest_error > HELD_OUT_ALONE_ERROR * max(candidate.score.worst_channel, 1.0)


def fit_first(
    context: SearchContext,
    base: Fitted,
    jacobian: Sensitivity,
    screened: Sequence[ScreenedHypothesis],
    rival_gain: float = 0.0,
) -> list[Fitted]:
    """Fit the hypotheses with the largest predicted gains, at most `FIRST_FIT_STEPS` steps each; the smallest cost
    first. Hypotheses whose fit crashes are omitted. base: the fit without the further effect; jacobian: its
    sensitivity. rival_gain: largest predicted reduction of the cost by hypotheses that are fitted elsewhere."""
    measure, tuning = context.measure, context.tuning

    def make_first_fit(candidate: ScreenedHypothesis) -> Fitted:
        return fit(
            measure,
            tuning,
            evaluate_fit(measure, tuning, base.deviations, candidate.hypothesis),
            jacobian,
            FIRST_FIT_STEPS,
        )

    guarded_map = context.guard.wrap(context.map_, FITTING)
    fits: list[Fitted] = list(guarded_map(make_first_fit, _select_worth_fitting(base, screened, rival_gain)))  # type: ignore[arg-type]
    return sorted(fits, key=lambda fitted: fitted.cost)


def compute_sensitivity(
    context: SearchContext, deviations: np.ndarray, hypothesis: Hypothesis, with_forces: bool = False
) -> Sensitivity:
    """Compute the sensitivity of the prediction to the parameters of the model itself at deviations (t,). Effects that
    are motion-dependent forces are omitted, because simulations are fast without them and small forces hardly change
    it; with_forces recomputes it with them for the parameters of `find_sensitive_parameters`."""
    forceless_hypothesis = hypothesis
    for claim_index in reversed(range(len(hypothesis.claims))):
        if isinstance(hypothesis.claims[claim_index].effect.action, (AxisForce, JointForce)):
            forceless_hypothesis = remove_claim(forceless_hypothesis, claim_index)
    base_jacobian = build_jacobian(context.measure, context.tuning, deviations, forceless_hypothesis, context.map_)
    if not with_forces or forceless_hypothesis is hypothesis:
        return base_jacobian
    parameters = find_sensitive_parameters(context.measure, context.tuning, base_jacobian, hypothesis)
    return build_jacobian(
        context.measure, context.tuning, deviations, hypothesis, context.map_, (base_jacobian.columns, parameters)
    )


def _select_worth_fitting(
    base: Fitted, screened: Sequence[ScreenedHypothesis], rival_gain: float
) -> list[ScreenedHypothesis]:
    """Select the hypotheses with at least `FITTING_GAIN_SHARE` of the largest predicted gain, that of rivals included;
    from `LEAST_FITTED` (fewer if there are fewer) to `MOST_FITTED` of them. rival_gain: as for `fit_first`."""
    ordered = _interleave_starts(screened)
    best_gain = max([rival_gain, *(base.cost - candidate.cost for candidate in ordered)])
    promising = [candidate for candidate in ordered if base.cost - candidate.cost >= FITTING_GAIN_SHARE * best_gain]
    return (promising if len(promising) >= LEAST_FITTED else ordered[:LEAST_FITTED])[:MOST_FITTED]


def _interleave_starts(screened: Sequence[ScreenedHypothesis]) -> list[ScreenedHypothesis]:
    """Reorder the hypotheses, given in order of cost: the best starting point of each before the second of any."""
    start_counts: dict[object, int] = {}
    ranked_candidates = []
    for candidate in screened:
        hypothesis_key = candidate.hypothesis.key
        start_counts[hypothesis_key] = start_counts.get(hypothesis_key, -1) + 1
        ranked_candidates.append((start_counts[hypothesis_key], candidate))
    return [
        candidate for _, candidate in sorted(ranked_candidates, key=lambda rank_and_candidate: rank_and_candidate[0])
    ]


def find_sensitive_parameters(
    measure: ErrorMeasure, tuning: Tuning, base_jacobian: Sensitivity, hypothesis: Hypothesis
) -> list[int]:
    """Find the indices of the parameters whose sensitivity changes with the hypothesis's forces: those to which the
    response channel that a force moves most is sensitive (`LEAST_SENSITIVITY_SHARE`); all of them without forces or
    for a force in a joint. base_jacobian: sensitivity without motion-dependent forces."""
    placed_forces = [
        placed_effect
        for placed_effect in hypothesis.list_placed_effects()
        if isinstance(placed_effect.effect.action, (AxisForce, JointForce))
    ]
    model = tuning.tune(np.zeros(len(tuning.names)))
    if not placed_forces or any(isinstance(placed_force.effect.action, JointForce) for placed_force in placed_forces):
        return list(range(len(tuning.names)))
    mobility = np.abs(model.output @ np.linalg.solve(model.mass, model.input))
    sites = {site for placed_force in placed_forces for site in placed_force.sites}
    channel_norms = _compute_channel_norms(measure, base_jacobian.columns, model.outputs)
    is_sensitive = np.zeros(len(tuning.names), dtype=bool)
    for site in sites:
        parameter_norms = channel_norms[:, int(np.argmax(mobility[:, site]))]
        is_sensitive |= parameter_norms > LEAST_SENSITIVITY_SHARE * parameter_norms.max(initial=0.0)
    return np.flatnonzero(is_sensitive).tolist()


def _compute_channel_norms(measure: ErrorMeasure, columns: FloatArray, output_count: int) -> FloatArray:
    """Compute (t, p): Euclidean norm, over the samples to fit, of each parameter's sensitivity per response channel; p
    = output_count. columns: (t, samples), over all records; further channels (positions) are skipped."""
    square_sums, first_index = np.zeros((len(columns), output_count)), 0
    for record in measure.records:
        sample_count, channel_count = int(record.fit.sum()), record.measured.shape[1]
        record_columns = columns[:, first_index : first_index + sample_count * channel_count].reshape(
            len(columns), sample_count, channel_count
        )[:, :, :output_count]
        square_sums += np.einsum("tnc,tnc->tc", record_columns, record_columns)
        first_index += sample_count * channel_count
    return np.sqrt(square_sums)
