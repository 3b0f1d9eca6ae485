"""Find the effect of the catalogue that lowers the error most when added to the selected ones (forward selection).

Candidates are screened by linearisation, fitted by output error and compared: steps 2 to 5 of the theory of operation
in `explain`. First fits of periodic recordings are made on short ones (`short_recordings`), then continued on all
samples. Effects that depend on time cannot be compared there and are fitted on all samples; where the base contains
motion-dependent forces, simulations are slow, and both kinds share the time by their gains.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.hypothesis import Hypothesis, combine_hypotheses, has_motion_forces
from analysis.diagnosis.errors.output_error import (
    Fitted,
    Sensitivity,
    build_jacobian,
    evaluate_fit,
    fit,
    gather_evidence,
)
from analysis.diagnosis.limits import FITTING_GAIN_SHARE, LEAST_FITTED
from analysis.diagnosis.search.compare_candidates import compare_candidates
from analysis.diagnosis.search.no_prediction import has_unpredicted_channel
from analysis.diagnosis.search.parsimony import are_exclusive, move_preferred_first
from analysis.diagnosis.search.screening import ScreenedHypothesis, screen
from analysis.diagnosis.search.search_context import (
    FITTING,
    SCREENING,
    STARTING,
    FittedCandidate,
    SearchContext,
    compute_sensitivity,
    fit_first,
)
from analysis.diagnosis.search.short_recordings import ShortRecordings, coarsen_steps, shorten_recordings
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
    return _fit_on_short_recordings(context, short_form, base, time_invariant_hypotheses, time_varying_hypotheses)


def compare_plausible_fits(
    context: SearchContext, base: Fitted, fits: Sequence[Fitted], evidence: Evidence
) -> tuple[FittedCandidate, ...]:
    """Compare the candidates of these first fits (`compare_candidates`), and select from them (`select_plausible`)."""
    return select_plausible(context, base, compare_candidates(context, base, fits), evidence)


def select_plausible(
    context: SearchContext, base: Fitted, candidates: Iterable[FittedCandidate], evidence: Evidence
) -> tuple[FittedCandidate, ...]:
    """Select the candidates, the preferred one first, then by their errors, without those that predict nothing beyond
    `base` and those with a parameter outside the range of the data (such as a limit above the largest command)."""
    return move_preferred_first(
        [
            candidate
            for candidate in sorted(candidates, key=lambda candidate: candidate.score.mean_log_error)
            if not has_unpredicted_channel(context.measure, base, candidate.fitted)
            and is_newest_within_data(candidate.fitted.hypothesis, evidence)
        ]
    )


def combine_known_fits(
    context: SearchContext,
    base: Fitted,
    candidates: Sequence[FittedCandidate],
    effects: Sequence[Effect],
    sites: tuple[int, ...],
    largest_cost: float,
) -> list[Fitted]:
    """Combine the effects of `base` with those of these effects that the candidates have at these sites, without
    fitting: the best of each effect, with a smaller cost than the largest; the model's parameters are those of the
    candidate or of `base`, whichever fit better. candidates: of one effect each."""
    best_by_name: dict[str, Fitted] = {}
    for candidate in candidates:
        (claim,) = candidate.fitted.hypothesis.claims
        is_exclusive = any(are_exclusive(base_claim, claim) for base_claim in base.hypothesis.claims)
        if claim.effect not in effects or claim.sites != sites or is_exclusive:
            continue
        hypothesis = combine_hypotheses(base.hypothesis, candidate.fitted.hypothesis)
        for deviations in (candidate.fitted.deviations, base.deviations):
            combined_fit = evaluate_fit(context.measure, context.tuning, deviations, hypothesis)
            best_fit = best_by_name.get(claim.effect.name)
            if combined_fit.cost < (largest_cost if best_fit is None else best_fit.cost):
                best_by_name[claim.effect.name] = combined_fit
    return list(best_by_name.values())


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


def _fit_on_short_recordings(
    context: SearchContext,
    short_form: ShortRecordings,
    base: Fitted,
    invariant: Sequence[Hypothesis],
    varying: Sequence[Hypothesis],
) -> list[Fitted]:
    """Fit hypotheses on short recordings, then by at most one step on all samples; returns the finite fits, the best
    first. invariant, varying: without and with dependence on time. The latter are fitted only where the predicted gain
    is not far below the former's (`_keep_promising`). If `base` contains motion-dependent forces, gains far below the
    best of all are not fitted (`fit_first`), or not continued on all samples (`_select_worth_continuing`), either."""
    short = replace(short_form.context, measure=coarsen_steps(short_form.context.measure))
    coarse = replace(context, measure=coarsen_steps(context.measure))
    screening = context.guard.wrap(context.map_, SCREENING)
    short_base, coarse_base = (
        evaluate_fit(each.measure, context.tuning, base.deviations, base.hypothesis) for each in (short, coarse)
    )
    jacobian = compute_sensitivity(short, base.deviations, base.hypothesis, with_forces=True)
    screened = screen(short.measure, context.tuning, short_base, jacobian, invariant, screening)
    full_jacobian, has_forces = short_form.repeat_sensitivity(jacobian), has_motion_forces(base.hypothesis)
    if has_forces:
        full_jacobian = build_jacobian(context.measure, context.tuning, base.deviations, base.hypothesis, context.map_)
    varying_screened = screen(coarse.measure, context.tuning, coarse_base, full_jacobian, varying, screening)
    rival_gain = max((1 - trial.cost / coarse_base.cost for trial in varying_screened), default=0.0)
    short_fits = fit_first(short, short_base, jacobian, screened, rival_gain * short_base.cost if has_forces else 0.0)
    promising = _keep_promising((short_base, short_fits), coarse_base, varying_screened)
    coarse_fits = fit_first(coarse, coarse_base, full_jacobian, promising)
    if not has_forces:
        return _evaluate_on_all(context, [*short_fits, *coarse_fits], None)
    return _evaluate_on_all(
        context, _select_worth_continuing((short_base, short_fits), (coarse_base, coarse_fits)), full_jacobian
    )


def _evaluate_on_all(context: SearchContext, fits: Sequence[Fitted], jacobian: Sensitivity | None) -> list[Fitted]:
    """Evaluate fits on all samples, or continue them there by one step with the sensitivity `jacobian`; returns the
    finite ones, the best first."""

    def fit_to_all(fitted: Fitted) -> Fitted:
        full_fit = evaluate_fit(context.measure, context.tuning, fitted.deviations, fitted.hypothesis)
        # One Gauss-Newton step on all samples fits the slow drift under friction, which one period does not contain.
        return full_fit if jacobian is None else fit(context.measure, context.tuning, full_fit, jacobian, 1)

    full_fits: list[Fitted] = list(context.guard.wrap(context.map_, FITTING)(fit_to_all, fits))  # type: ignore[arg-type]
    # Hypotheses whose parameters the short recordings do not determine may diverge on all samples: left out.
    return sorted((trial for trial in full_fits if np.isfinite(trial.cost)), key=lambda trial: trial.cost)


def _select_worth_continuing(*groups: tuple[Fitted, Sequence[Fitted]]) -> list[Fitted]:
    """Select, by falling gain, the fits with at least `FITTING_GAIN_SHARE` of the best gain, or `LEAST_FITTED` of them;
    a gain is the relative reduction of the cost. groups: per set of samples, the base fit and the fits."""
    ranked = sorted(
        ((1 - trial.cost / base.cost, trial) for base, fits in groups for trial in fits), key=lambda entry: -entry[0]
    )
    return [
        trial
        for rank, (gain, trial) in enumerate(ranked)
        if rank < LEAST_FITTED or gain >= FITTING_GAIN_SHARE * ranked[0][0]
    ]


def _keep_promising(
    reference: tuple[Fitted, Sequence[Fitted]], coarse_base: Fitted, screened: Sequence[ScreenedHypothesis]
) -> list[ScreenedHypothesis]:
    """Keep hypotheses whose predicted relative reduction of the cost is at least `FITTING_GAIN_SHARE` times the largest
    of the reference; relative, because its costs refer to other samples and steps. reference: base fit, and fits."""
    base, fits = reference
    best = max((1 - trial.cost / base.cost for trial in fits), default=0.0)
    return [trial for trial in screened if 1 - trial.cost / coarse_base.cost >= max(FITTING_GAIN_SHARE * best, 0.0)]
