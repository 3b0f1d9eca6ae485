"""One step of forward selection: which effect of the catalogue lowers the error most when added to those selected so
far.

Candidates are screened by linearisation, fitted by output error and compared: steps 2 to 5 of the theory of operation
in `explain`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import Fitted, gather_evidence
from analysis.diagnosis.search.compare_candidates import compare_candidates
from analysis.diagnosis.search.no_prediction import predicts_nothing
from analysis.diagnosis.search.parsimony import excludes, plainest_first
from analysis.diagnosis.search.screening import screen
from analysis.diagnosis.search.search_context import (
    SCREENING,
    STARTING,
    FittedCandidate,
    SearchContext,
    first_fits,
    sensitivity_at,
)
from analysis.diagnosis.search.short_recordings import fits_on_short_recordings, short_recordings_of
from analysis.diagnosis.search.starting_hypotheses import CLOCK_DRIFT, candidates, clock_drift_by_trial, within_data
from analysis.diagnosis.types import Progress
from equalizer.effects.effect import Effect
from equalizer.effects.starts.evidence import Evidence


@dataclass(frozen=True, slots=True)
class Step:
    """Part of the work, for the progress display."""

    what: str
    begun: float
    """Share of the whole work that is done before it, 0 to 1."""
    progress: Progress

    def at(self, share: float) -> None:
        """Report progress. share: of this step, 0 to 1; the step is 0.3 of the whole work."""
        self.progress(self.what, self.begun + 0.3 * share)


def find_next_effect(
    context: SearchContext, catalogue: Sequence[Effect], base: Fitted, step: Step
) -> tuple[FittedCandidate, ...]:
    """The fitted candidates for one more effect beside those of `base`, the preferred one first (`parsimony`)."""
    step.at(0.0)
    evidence = gather_evidence(context.measure, context.tuning, base)[0]
    fits = find_first_fits(context, catalogue, base, evidence, step)
    step.at(0.6)
    return compare_plausible(context, base, fits, evidence)


def find_first_fits(
    context: SearchContext,
    catalogue: Sequence[Effect],
    base: Fitted,
    evidence: Evidence,
    step: Step,
    sites: tuple[int, ...] = (),
) -> list[Fitted]:
    """First fits of one more effect beside those of `base`, the best first. sites: places at which it must act; empty
    where it may act at any."""
    observable = [effect for effect in catalogue if context.measure.can_observe(effect)]

    def suggest(effects: Sequence[Effect], evidence: Evidence) -> list[Hypothesis]:
        suggested = _suggest_hypotheses(context, base.hypothesis, effects, evidence)
        return [each for each in suggested if not sites or each.claims[0].sites == sites]

    short_form = short_recordings_of(context, base)
    if short_form is None:
        suggested = suggest(observable, evidence)
        known = sensitivity_at(context, base.deviations, base.hypothesis, with_forces=True)
        step.at(0.2)
        guarded_map = context.guard.over(context.map_, SCREENING)
        screened = screen(context.measure, context.tuning, base, known, suggested, guarded_map)
        return list(first_fits(context, base, known, screened))
    time_invariant = suggest([effect for effect in observable if not effect.of_time], short_form.of(evidence))
    time_varying = suggest([effect for effect in observable if effect.of_time], evidence)
    step.at(0.2)
    return fits_on_short_recordings(context, short_form, base, time_invariant, time_varying)


def compare_plausible(
    context: SearchContext, base: Fitted, fits: Sequence[Fitted], evidence: Evidence
) -> tuple[FittedCandidate, ...]:
    """The candidates of these first fits, the preferred one first, without those that predict nothing beyond `base` and
    those with a parameter outside the range of the data (such as a limit above the largest command)."""
    return plainest_first(
        [
            candidate
            for candidate in compare_candidates(context, base, fits)
            if not predicts_nothing(context.measure, base, candidate.fitted)
            and within_data(candidate.fitted.hypothesis, evidence)
        ]
    )


def _suggest_hypotheses(
    context: SearchContext, held: Hypothesis, catalogue: Sequence[Effect], evidence: Evidence
) -> list[Hypothesis]:
    """The hypotheses to try beside those of `held`: each effect with its starting values, and drifts of the clock
    by trial where there are reference recordings."""
    suggested = [
        hypothesis
        for hypothesis in candidates(catalogue, evidence, context.guard.over(context.map_, STARTING))
        if not any(excludes(claim, hypothesis.claims[0]) for claim in held.claims)
    ]
    if context.references is not None and not any(claim.effect.name == CLOCK_DRIFT for claim in held.claims):
        suggested += context.guard.part(CLOCK_DRIFT, STARTING, lambda: clock_drift_by_trial(catalogue, evidence), ())
    return suggested
