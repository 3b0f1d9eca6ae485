"""Forward selection of missing effects: re-tune the model, screen candidates, fit the best, add one, repeat.

Theory of operation. A fit minimises J = (sum of e² + d'd) / N over the samples to fit: e are prediction errors in units
of the noise, d deviations of the model's own parameters in standard deviations of their calibration (`output_error`).
Fits are compared by the log error power, a log-likelihood in which each channel's error variance is free,

    L = mean over channels of ln(rms error to fit * rms error to choose)        0 for noise alone

1. The model's own parameters are re-tuned. If no channel is above the noise then, the search ends (exceptions in
   `is_worth_searching`).
2. Each effect of the catalogue estimates starting values from the missing force (`starting_hypotheses`).
3. The gain in J of each hypothesis is predicted by one simulation, linearised at its start, the model's parameters
   free (`screening`); where the drive repeats, on one period of each segment (`short_recordings`).
4. The most promising are fitted, the best of them until convergence (`compare_candidates`).
5. Of candidates equal within the errors, the most parsimonious is taken (`parsimony`).
6. It is added if it lowers L by more than `ADDED_SHARE` of its excess above the noise and `ADDED_GAIN`; where the
   error is as small as right laws leave on a real device (`EXPLAINED_ERROR`), the worst channel's ln(error) must also
   fall by half. Then the next effect is looked for, up to `MOST_EFFECTS`. Two strong effects may hide each other: where
   the best one lowers L by less, it is added with a second one if both lower L by more than twice `ADDED_SHARE`.

In these steps the test samples only decide whether a first effect is looked for although no other sample requires it
(`is_worth_searching`); `verdict` judges the result by them.

References: Miller, Subset Selection in Regression (2002), chapter 3; Ljung, System Identification (1999), chapter 16.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Hypothesis, combine_hypotheses
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit
from analysis.diagnosis.limits import (
    ADDED_GAIN,
    ADDED_SHARE,
    HELD_OUT_MISMATCH_ERROR,
    MOST_EFFECTS,
    NEAR_NOISE_ERROR,
    NOISE_ALONE,
)
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.next_effect import Step, find_next_effect
from analysis.diagnosis.search.parsimony import are_inseparable, compute_excess, has_small_error, is_worthwhile
from analysis.diagnosis.search.search_context import (
    FittedCandidate,
    SearchContext,
)
from analysis.diagnosis.search.time_budget import OutOfTimeError, grant_time, limit_map
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect
from equalizer.signals.signal import FloatArray

LOOK_AHEAD_CANDIDATES = 2
"""Candidates to which a second effect is added on trial, where none alone is worth adding; each takes a round.
Chosen."""
MOST_REFITTED_RIVALS = 3
"""Rivals of a step that are fitted again where a search continues on more samples. Chosen: each takes a second or
more."""


@dataclass(frozen=True, slots=True, eq=False)
class Statistic:
    """A statistic of the response, by which candidates are compared where waveforms cannot be predicted."""

    chance: FloatArray
    """(c,): chance variation of the statistic, between two simulations of one model; used in place of the noise."""
    errors: FloatArray
    """(parameters,): standard errors of the coordinates of the final hypothesis."""


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    """Result of forward selection: the fits before, re-tuned and with effects, and the candidates of each round."""

    before: FittedCandidate
    """The model as given."""
    retuned: FittedCandidate
    """The model re-tuned within its tolerances."""
    after: FittedCandidate
    """The model with the effects found; equal to `retuned` where none was found."""
    rounds: tuple[tuple[FittedCandidate, ...], ...]
    """The candidates of each round (first effect, second, …), the preferred one first. In the last round none may have
    been added."""
    steps: tuple[FittedCandidate, ...]
    """The fit after each effect that was added."""
    statistic: Statistic | None = None
    """The compared statistic; None where samples were compared, in units of their noise."""
    ended_early: bool = False
    """Whether the time limit was reached before the search was done."""
    excluded_name: str = ""
    """Name of an excluded effect that explains best, where another is worth adding; else empty."""
    undetermined: tuple[str, ...] = ()
    """Effects that were found and removed, because the recordings do not determine their parameters."""
    errors: tuple[Fitted, FloatArray] | None = None
    """A fit and the standard errors of all its parameters (`compute_final_errors`), where already computed."""
    jackknife_errors: tuple[Fitted, FloatArray | None] | None = None
    """A fit at its minimum, and the jackknife standard errors of its parameters over segments
    (`compute_segment_errors`); None in place of the errors for a single segment."""

    @property
    def plain(self) -> FittedCandidate:
        """The better of the given and the re-tuned model on held-out samples: re-tuning may overfit, and effects must
        not be credited with undoing that."""
        return min(self.retuned, self.before, key=lambda candidate: candidate.held_out_error)

    @property
    def stages(self) -> dict[str, Fitted]:
        """The fits by the name of their stage: "before", "retuned", "after"."""
        return {"before": self.before.fitted, "retuned": self.retuned.fitted, "after": self.after.fitted}


def explain(
    context: SearchContext,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget = grant_time,
    previous_steps: Sequence[Sequence[FittedCandidate]] = (),
) -> Explanation:
    """Re-tune the model and add effects one by one. progress: called with a text and the completed fraction. time_left:
    time limit, at which the search ends with the effects added so far. previous_steps: those of a search on fewer
    samples, each with its rivals; one effect is added to these, up to `MOST_EFFECTS`. Raises OutOfTimeError where the
    time ends before these are fitted again."""
    explanation = start_explanation(
        replace(context, map_=limit_map(context.map_, time_left)) if previous_steps else context,
        progress,
        previous_steps,
    )
    max_effects = min(len(explanation.rounds) + 1, MOST_EFFECTS) if previous_steps else MOST_EFFECTS
    return add_effects(context, catalogue, explanation, progress, time_left, max_effects)


def start_explanation(
    context: SearchContext, progress: Progress, previous_steps: Sequence[Sequence[FittedCandidate]] = ()
) -> Explanation:
    """Fit the model as given and re-tuned, with the effects that need no search (`_fit_known_rounds`)."""
    given_fit = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    progress("re-tuning the model within its tolerances", 0.02)
    base = context.score_fit(refine(context, given_fit))
    rounds = _fit_known_rounds(context, base, previous_steps)
    steps = tuple(round_candidates[0] for round_candidates in rounds)
    given_and_retuned = (context.with_test_score(context.score_fit(given_fit)), context.with_test_score(base))
    return Explanation(
        *given_and_retuned, context.with_test_score(steps[-1]) if steps else given_and_retuned[1], tuple(rounds), steps
    )


def add_effects(
    context: SearchContext,
    catalogue: Sequence[Effect],
    selected: Explanation,
    progress: Progress,
    time_left: TimeBudget = grant_time,
    max_effects: int = MOST_EFFECTS,
) -> Explanation:
    """Add further effects to an explanation, up to `max_effects` in total. A last round of `selected` in which no
    effect was added is not computed again: a second effect is sought together with its best candidates."""
    rounds, steps = list(selected.rounds), list(selected.steps)
    base = steps[-1] if steps else context.score_fit(_reevaluate(context, selected.retuned))
    limited, excluded, ended_early = replace(context, map_=limit_map(context.map_, time_left)), "", selected.ended_early
    may_extend = not context.certain and not selected.excluded_name and not ended_early
    while may_extend and len(steps) < max_effects and is_worth_searching(context, selected, base):
        step = Step(f"looking for the {_ORDINALS[len(steps)]} effect", 0.1 + 0.3 * len(steps), progress)
        try:
            is_resumed = len(rounds) > len(steps)
            if is_resumed:
                candidates = allowed = rounds[-1]
            else:
                candidates = find_next_effect(limited, catalogue, base.fitted, step)
                allowed = tuple(candidate for candidate in candidates if candidate.newest not in context.excluded)
                rounds.append(allowed)
            can_add_pair = (
                allowed[:1] == candidates[:1] and len(rounds) < max_effects and not (is_resumed and context.excluded)
            )
            pair_rounds = _find_effect_pair(limited, catalogue, base, allowed, step) if can_add_pair else ()
        except OutOfTimeError:
            ended_early = True
            break
        rounds[-1:] = pair_rounds or (allowed,)
        if not pair_rounds and (not allowed or not is_worthwhile(base, allowed[0]) or allowed[0] is not candidates[0]):
            excluded = candidates[0].newest if allowed and is_worthwhile(base, allowed[0]) else ""
            break
        steps += [round_candidates[0] for round_candidates in pair_rounds or (allowed,)]
        base = steps[-1]
    final = selected.after if len(steps) == len(selected.steps) else context.with_test_score(base)
    excluded = excluded or selected.excluded_name
    return replace(
        selected, after=final, rounds=tuple(rounds), steps=tuple(steps), ended_early=ended_early, excluded_name=excluded
    )


def _reevaluate(context: SearchContext, candidate: FittedCandidate) -> Fitted:
    """Simulate the candidate's model again on the samples to fit and to choose by; the candidate was scored on all."""
    return evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, candidate.fitted.hypothesis)


def is_worth_searching(context: SearchContext, explanation: Explanation, base: FittedCandidate) -> bool:
    """Whether `base`, the last step of `explanation`, leaves enough error to search for one more effect. No third
    effect is sought where two fit as well as right laws fit a real device, because it might only absorb their small
    errors; except with clean recordings, and with opened held-out samples, which are few and may show an effect that
    the others do not."""
    if base.fitted.hypothesis.claims:
        has_noise_limit = context.references is None and not context.has_opened_samples
        if has_noise_limit and len(base.fitted.hypothesis.claims) > 1 and has_small_error(explanation.retuned, base):
            return False
        return base.score.worst_channel > context.least_remaining_error
    has_held_out_mismatch = bool(np.nanmax(explanation.retuned.score.test, initial=0.0) > HELD_OUT_MISMATCH_ERROR)
    return has_held_out_mismatch or context.references is not None or base.score.worst_channel > NOISE_ALONE


def _find_effect_pair(
    context: SearchContext,
    catalogue: Sequence[Effect],
    base: FittedCandidate,
    candidates: tuple[FittedCandidate, ...],
    step: "Step",
) -> tuple[tuple[FittedCandidate, ...], ...]:
    """Find two effects of which none alone is worth adding, but which together remove more than twice `ADDED_SHARE` of
    the excess error. Returns their two rounds; empty where the best of `candidates` is worth adding, the error is near
    the noise (`NEAR_NOISE_ERROR`), or no such pair, without excluded rivals of its second, is found."""
    if not candidates or is_worthwhile(base, candidates[0]) or base.score.worst_channel <= NEAR_NOISE_ERROR:
        return ()
    best_by_name = {candidate.newest: candidate for candidate in reversed(candidates)}
    for first_candidate in [candidate for candidate in candidates if best_by_name[candidate.newest] is candidate][
        :LOOK_AHEAD_CANDIDATES
    ]:
        if base.score.mean_log_error - first_candidate.score.mean_log_error <= ADDED_GAIN:
            break
        second_candidates = find_next_effect(context, catalogue, first_candidate.fitted, step)
        gain = base.score.mean_log_error - second_candidates[0].score.mean_log_error if second_candidates else 0.0
        is_gain_sufficient = gain > 2 * ADDED_SHARE * compute_excess(base) and is_worthwhile(
            first_candidate, second_candidates[0]
        )
        if is_gain_sufficient and not any(candidate.newest in context.excluded for candidate in second_candidates):
            return (
                first_candidate,
                *(rival for rival in candidates if rival is not first_candidate),
            ), second_candidates
    return ()


def _fit_known_rounds(
    context: SearchContext, base: FittedCandidate, previous_steps: Sequence[Sequence[FittedCandidate]]
) -> list[tuple[FittedCandidate, ...]]:
    """Fit the rounds that need no search: the certain hypotheses, and the steps of a search on fewer samples with the
    rivals that were inseparable from them."""
    rounds: list[tuple[FittedCandidate, ...]] = []
    for hypothesis in context.certain:
        base = _add_certain(context, base, hypothesis)
        rounds.append((base,))
    for step, *step_rivals in previous_steps:
        rivals = [rival for rival in step_rivals if are_inseparable(step, rival)]
        rounds.append(tuple(_refit(context, candidate) for candidate in (step, *rivals[:MOST_REFITTED_RIVALS])))
    return rounds


def _refit(context: SearchContext, candidate: FittedCandidate) -> FittedCandidate:
    """Fit the candidate again to the context's samples, starting from its parameters."""
    return context.score_fit(refine(context, _reevaluate(context, candidate)))


def _add_certain(context: SearchContext, base: FittedCandidate, hypothesis: Hypothesis) -> FittedCandidate:
    """Add a certain hypothesis to a fit, even where that does not lower the error, and refine it."""
    start = evaluate_fit(
        context.measure, context.tuning, base.fitted.deviations, combine_hypotheses(base.fitted.hypothesis, hypothesis)
    )
    return context.score_fit(refine(context, start))


def retune_alone(context: SearchContext) -> Fitted:
    """Re-tune the model, without any added effect."""
    return refine(
        context, evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    )


_ORDINALS = ("first", "second", "third")
"""Ordinal numbers of the effects in progress texts, up to `MOST_EFFECTS`."""
