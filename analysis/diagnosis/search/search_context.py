"""The shared state of all fits of a search, and the first fits of hypotheses that passed the screening."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore, fit_score, rms_over
from analysis.diagnosis.errors.hypothesis import Hypothesis, without_claim
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, evaluate_fit, fit, sensitivity
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.reference_recordings import ReferenceRecordings
from analysis.diagnosis.search.screening import ScreenedHypothesis
from analysis.diagnosis.settings import (
    HELD_OUT_ALONE_ERROR,
    LEAST_FITTED,
    LEAST_PART,
    LOUDER,
    MOST_FITTED,
    NOISE_ALONE,
    WORTH_FITTING,
)
from analysis.diagnosis.types import Mapper, Mask
from equalizer.effects.effect import AxisForce, JointForce
from equalizer.signals.signal import FloatArray

FIRST_ROUNDS = 3
STARTING, SCREENING, FITTING = "its starting values", "its screening", "its fit"
"""Steps of the work on each effect, in words."""
SENSED_SHARE = 0.06
"""Sensitivity of an axis's channel to a number, over the largest one there, from which on it counts."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedCandidate:
    """A fitted hypothesis with its errors on the samples to fit, to choose by and to test."""

    fitted: Fitted
    score: FitScore
    usual: float = 0.0
    """Mean log error power that it gains on clean recordings, which is counted against it here."""

    @property
    def newest(self) -> str:
        """Name of the effect that was added last."""
        return self.fitted.hypothesis.claims[-1].effect.name

    @property
    def held_out(self) -> float:
        """Mean logarithm of the channels' held-out errors; infinite where there is none, or where it runs away."""
        left = float(np.mean(np.log(self.score.test)))
        return np.inf if np.isnan(left) else left


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
    barred: frozenset[str] = frozenset()
    """Effects that are not to be named. Those that others refine are simulated all the same: a refined law is named
    only where its refinement shows, and without it that law is the barred one."""
    references: ReferenceRecordings | None = None
    """Clean recordings: what a candidate gains on them is counted against it."""
    certain: tuple[Hypothesis, ...] = ()
    """Faults that a recording shows by itself (`model_free_faults`): added without a search."""
    guard: Guard = field(default_factory=Guard)
    """Isolates crashes of single effects."""
    opened: bool = False
    """A part of the held-out samples is used to fit and to choose by."""
    least_left: float = NOISE_ALONE
    """Error of the worst channel, times the noise, from which on a further effect is looked for."""

    def open_alternate(self, shows: FittedCandidate, coarsest: int = HALVES) -> "tuple[SearchContext, int]":
        """Copy of the context in which a part of every held-out stretch is used to fit and to choose by, and into how
        many parts stretches were cut: the first of two, or, where one half alone shows the mismatch (as of a sweep),
        every other of more. shows: as of `open_milder`. coarsest: least number of parts that is tried."""
        longest = max(record.longest_held_out() for record in self.whole.records)
        fine_enough = [parts for parts in (HALVES, *FINER_PARTS) if parts >= coarsest]
        for parts in (parts for parts in fine_enough if longest >= parts * LEAST_PART):
            opened = [record.every_other_part(parts) for record in self.whole.records]
            if self._both_show(opened, shows):
                return self._open(opened), parts
        return self._open([record.every_other_part(coarsest) for record in self.whole.records]), coarsest

    def open_milder(self, shows: FittedCandidate) -> "SearchContext | None":
        """Copy of the context in which all held-out segments but the loudest are used to fit and to choose by, where
        both show, in the channel where the held-out samples show most, a mismatch that the other samples do not: the
        loudest still tests by another kind of command. None where they do not. shows: a fit with its residuals in all
        samples, and its held-out errors."""
        records = self.whole.records
        levels = [level for record in records for _, level in record.held_out_levels()]
        opened = [record.held_out_below(max(levels, default=0.0) / LOUDER) for record in records]
        if not any(mask.any() for mask in opened):
            return None
        return self._open(opened) if self._both_show(opened, shows) else None

    def _both_show(self, opened: list[Mask], shows: FittedCandidate) -> bool:
        """Whether opened samples and those that stay held out show what the other samples do not."""
        # Another channel may show a little of something else, such as friction that is not fitted to the last.
        records, most = self.whole.records, int(np.argmax(np.nan_to_num(shows.score.test)))
        sealed = [record.test & ~mask for record, mask in zip(records, opened, strict=True)]
        scale = self.whole.unit / self.whole.noise
        errors = [(rms_over(records, shows.fitted.residuals, part) * scale)[[most]] for part in (opened, sealed)]
        return all(shows_there_alone(each, shows) for each in errors)

    def _open(self, opened: Sequence[Mask]) -> "SearchContext":
        records = (record.unseal(mask) for record, mask in zip(self.whole.records, opened, strict=True))
        whole = self.whole.with_records(tuple(records))
        return replace(self, measure=whole.shorten(), whole=whole, opened=True)

    def fit_to_all(self) -> "SearchContext":
        """Copy of the context that also fits to the samples to choose by: what a force balance has chosen needs no
        choice."""
        measure, whole = (
            each.with_records(tuple(record.fit_to_all() for record in each.records))
            for each in (self.measure, self.whole)
        )
        return replace(self, measure=measure, whole=whole)

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
        gained = self.references.gain_on_clean(fitted.hypothesis)
        return FittedCandidate(fitted, score.larger(np.exp(gained)), 2 * float(gained.mean()))


def shows_there_alone(errors: FloatArray, candidate: FittedCandidate) -> bool:
    """Whether held-out samples show a mismatch that those to fit and to choose by do not. errors: (c,), there, times
    the noise."""
    shown = float(np.nanmax(errors, initial=0.0))
    return shown > HELD_OUT_ALONE_ERROR * max(candidate.score.worst_channel, 1.0)


def first_fits(
    context: SearchContext, base: Fitted, known: Sensitivity, screened: Sequence[ScreenedHypothesis]
) -> list[Fitted]:
    """Fits of the hypotheses with the largest predicted gains, the best first."""
    measure, tuning = context.measure, context.tuning

    def first(entry: ScreenedHypothesis) -> Fitted:
        return fit(
            measure, tuning, evaluate_fit(measure, tuning, base.deviations, entry.hypothesis), known, FIRST_ROUNDS
        )

    each = context.guard.over(context.map_, FITTING)
    fits: list[Fitted] = list(each(first, _worth_fitting(base, screened)))  # type: ignore[arg-type]
    return sorted(fits, key=lambda found: found.cost)


def sensitivity_at(
    context: SearchContext, deviations: np.ndarray, hypothesis: Hypothesis, with_forces: bool = False
) -> Sensitivity:
    """Sensitivity of the prediction to the model's own parameters. Motion-dependent forces are left out first:
    simulations are quick without them, and small forces hardly change the sensitivity."""
    kept = hypothesis
    for number in reversed(range(len(hypothesis.claims))):
        if isinstance(hypothesis.claims[number].effect.acts, (AxisForce, JointForce)):
            kept = without_claim(kept, number)
    plain = sensitivity(context.measure, context.tuning, deviations, kept, context.map_)
    if not with_forces or kept is hypothesis:
        return plain
    sensed = sensitive_parameters(context.measure, context.tuning, plain, hypothesis)
    return sensitivity(context.measure, context.tuning, deviations, hypothesis, context.map_, (plain.columns, sensed))


def _worth_fitting(base: Fitted, screened: Sequence[ScreenedHypothesis]) -> list[ScreenedHypothesis]:
    varied = _interleave_starts(screened)
    best = max((base.cost - entry.cost for entry in varied), default=0.0)
    worth = [entry for entry in varied if base.cost - entry.cost >= WORTH_FITTING * best]
    return (worth if len(worth) >= LEAST_FITTED else varied[:LEAST_FITTED])[:MOST_FITTED]


def _interleave_starts(screened: Sequence[ScreenedHypothesis]) -> list[ScreenedHypothesis]:
    """The best start of each hypothesis before the second start of any."""
    seen: dict[object, int] = {}
    ranked = []
    for entry in screened:
        key = entry.hypothesis.key
        seen[key] = seen.get(key, -1) + 1
        ranked.append((seen[key], entry))
    return [entry for _, entry in sorted(ranked, key=lambda pair: pair[0])]


def sensitive_parameters(
    measure: ErrorMeasure, tuning: Tuning, plain: Sensitivity, hypothesis: Hypothesis
) -> list[int]:
    """Parameters whose sensitivity changes with the hypothesis's forces: those that move the axes at which these act.
    plain: sensitivity without motion-dependent forces."""
    forces = [
        effect for effect in hypothesis.list_placed_effects() if isinstance(effect.effect.acts, (AxisForce, JointForce))
    ]
    model = tuning.tune(np.zeros(len(tuning.names)))
    if not forces or any(isinstance(force.effect.acts, JointForce) for force in forces):
        return list(range(len(tuning.names)))
    reached = np.abs(model.output @ np.linalg.solve(model.mass, model.input))
    sites = {site for force in forces for site in force.sites}
    strength = _strengths(measure, plain.columns, model.outputs)
    sensed = np.zeros(len(tuning.names), dtype=bool)
    for site in sites:
        in_channel = strength[:, int(np.argmax(reached[:, site]))]
        sensed |= in_channel > SENSED_SHARE * in_channel.max(initial=0.0)
    return np.flatnonzero(sensed).tolist()


def _strengths(measure: ErrorMeasure, columns: FloatArray, outputs: int) -> FloatArray:
    """(t, p): rms in each response channel."""
    squares, first = np.zeros((len(columns), outputs)), 0
    for record in measure.records:
        count, channels = int(record.fit.sum()), record.measured.shape[1]
        part = columns[:, first : first + count * channels].reshape(len(columns), count, channels)[:, :, :outputs]
        squares += np.einsum("tnc,tnc->tc", part, part)
        first += count * channels
    return np.sqrt(squares)
