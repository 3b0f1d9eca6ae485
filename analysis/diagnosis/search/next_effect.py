"""Find the effect of the catalogue that lowers the error most when added to the selected ones (forward selection).

Candidates are screened by linearisation, fitted by output error and compared: steps 2 to 5 of the theory of operation
in `explain`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import Fitted, gather_evidence
from analysis.diagnosis.search.compare_candidates import compare_candidates
from analysis.diagnosis.search.no_prediction import has_unpredicted_channel
from analysis.diagnosis.search.parsimony import are_exclusive, move_preferred_first
from analysis.diagnosis.search.screening import screen
from analysis.diagnosis.search.search_context import (
    SCREENING,
    STARTING,
    FittedCandidate,
    SearchContext,
    compute_sensitivity,
    fit_first,
)
from analysis.diagnosis.search.short_recordings import fit_on_short_recordings, shorten_recordings
from analysis.diagnosis.search.starting_hypotheses import (
    CLOCK_DRIFT,
    is_newest_within_data,
    list_candidates,
    search_clock_drift,
)
from analysis.diagnosis.types import Progress
from equalizer.effects.effect import Effect
from equalizer.effects.starts.evidence import Evidence


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the search, for the progress display (`Progress`)."""

    label: str
    start_share: float
    """Share of the search's work that precedes this step, 0 to 1."""
    progress: Progress

    def report(self, step_fraction: float) -> None:
        """Report progress. step_fraction: completed fraction of this step, 0 to 1; a step counts as 0.3 of the search,
        which has at most three."""
        self.progress(self.label, self.start_share + 0.3 * step_fraction)


def find_next_effect(
    context: SearchContext, catalogue: Sequence[Effect], base: Fitted, step: Step
) -> tuple[FittedCandidate, ...]:
    """Find candidates for one more effect in addition to those of `base`, fitted, the preferred one first
    (`parsimony`)."""
    step.report(0.0)
    evidence = gather_evidence(context.measure, context.tuning, base)[0]
    fits = find_first_fits(context, catalogue, base, evidence, step)
    step.report(0.6)
    return compare_plausible_fits(context, base, fits, evidence)


def find_first_fits(
    context: SearchContext,
    catalogue: Sequence[Effect],
    base: Fitted,
    evidence: Evidence,
    step: Step,
    sites: tuple[int, ...] = (),
) -> list[Fitted]:
    """Find first fits of one more effect in addition to those of `base`, the best first. sites: places at which it must
    act; empty where it may act at any."""
    observable_effects = [effect for effect in catalogue if context.measure.can_observe(effect)]

    def suggest_at_sites(effects: Sequence[Effect], evidence: Evidence) -> list[Hypothesis]:
        hypotheses = _suggest_hypotheses(context, base.hypothesis, effects, evidence)
        return [hypothesis for hypothesis in hypotheses if not sites or hypothesis.claims[0].sites == sites]

    short_form = shorten_recordings(context, base)
    if short_form is None:
        hypotheses = suggest_at_sites(observable_effects, evidence)
        jacobian = compute_sensitivity(context, base.deviations, base.hypothesis, with_forces=True)
        step.report(0.2)
        guarded_map = context.guard.wrap(context.map_, SCREENING)
        screened_hypotheses = screen(context.measure, context.tuning, base, jacobian, hypotheses, guarded_map)
        return list(fit_first(context, base, jacobian, screened_hypotheses))
    time_invariant_hypotheses = suggest_at_sites(
        [effect for effect in observable_effects if not effect.of_time], short_form.restrict_evidence(evidence)
    )
    time_varying_hypotheses = suggest_at_sites([effect for effect in observable_effects if effect.of_time], evidence)
    step.report(0.2)
    return fit_on_short_recordings(context, short_form, base, time_invariant_hypotheses, time_varying_hypotheses)


def compare_plausible_fits(
    context: SearchContext, base: Fitted, fits: Sequence[Fitted], evidence: Evidence
) -> tuple[FittedCandidate, ...]:
    """Compare the candidates of these first fits, the preferred one first, without those that predict nothing beyond
    `base` and those with a parameter outside the range of the data (such as a limit above the largest command)."""
    return move_preferred_first(
        [
            candidate
            for candidate in compare_candidates(context, base, fits)
            if not has_unpredicted_channel(context.measure, base, candidate.fitted)
            and is_newest_within_data(candidate.fitted.hypothesis, evidence)
        ]
    )


def _suggest_hypotheses(
    context: SearchContext, base_hypothesis: Hypothesis, catalogue: Sequence[Effect], evidence: Evidence
) -> list[Hypothesis]:
    """Suggest hypotheses in addition to `base_hypothesis`: each effect with its starting values, unless it excludes one
    of the base, and clock drift by grid search where there are reference recordings."""
    hypotheses = [
        hypothesis
        for hypothesis in list_candidates(catalogue, evidence, context.guard.wrap(context.map_, STARTING))
        if not any(are_exclusive(base_claim, hypothesis.claims[0]) for base_claim in base_hypothesis.claims)
    ]
    if context.references is not None and not any(
        base_claim.effect.name == CLOCK_DRIFT for base_claim in base_hypothesis.claims
    ):
        hypotheses += context.guard.run(CLOCK_DRIFT, STARTING, lambda: search_clock_drift(catalogue, evidence), ())
    return hypotheses
