"""Decide, by the error on held-out samples, which of the effects that a search with a given model found are reported as
named.

Called by `diagnose` after the search, where residuals exceed the noise. Where repeats show that the noise is about as
large as the residual, the decision by likelihood (`verdict`) is kept. Otherwise the residual may be far above the noise
even with the true law. An effect is then named if the model with it has a sufficiently smaller held-out error power
than the model without it, and than the model with the best rival effect (95 % intervals by block bootstrap,
`held_out_gain`). Where all effects together remove less than half of the power, the force balance must confirm them as
well (`find_objection`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.judged_law import INSIGNIFICANT_GAIN_OBJECTION, SIMULATED_AS
from analysis.diagnosis.confirm.balance_with_model import find_balances_with_model
from analysis.diagnosis.confirm.confirm_laws import search_by_balance
from analysis.diagnosis.confirm.fitting_measures import FittingMeasure
from analysis.diagnosis.confirm.held_out_gain import HeldOutGain, estimate_held_out_gain
from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.limits import (
    CANDIDATES_WITH_GAIN,
    FURTHER_LAW_SHARE,
    NAMED_ERROR,
    NAMED_REDUCTION_SHARE,
)
from analysis.diagnosis.search.parsimony import is_refined_candidate
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult, UnconfirmedEffect
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.recording import Recording


@dataclass(frozen=True, slots=True, eq=False)
class ResultWithModel:
    """Result of a search after the decision by held-out error, and the force balances that were used for it."""

    result: SearchResult
    balances: tuple[Balance, ...] = ()
    """Empty where `find_balances_with_model` finds none."""


def decide_with_model(
    recordings: Sequence[Recording], fitting: FittingMeasure, result: SearchResult, time_left: TimeBudget
) -> ResultWithModel:
    """Decide which effects are named. result: of the search by simulation, with errors compared sample by sample, after
    which some error is unexplained; it is returned unchanged if it names effects already, or only refinements of an
    excluded effect explain as much (`Explanation.excluded_name`). Where the noise is known and the residual near it,
    no effect is named, and candidates are listed as unconfirmed. Else, if its effects cannot be named, those of a
    search by force balance are tried; if these cannot be named either, the best candidates are listed as unconfirmed,
    with the reason. Also returns the force balances, with the given model as their base."""
    noise_known = all(floor.method == "repeats" for floor in fitting.chosen.floors)
    balances = find_balances_with_model(recordings, fitting.model, result.context.excluded, time_left)
    residual_near_noise = float(np.nanmax(result.found.retuned.score.test, initial=0.0)) <= NAMED_ERROR
    if result.judgement.named or result.found.excluded_name:
        return ResultWithModel(result, balances)
    if noise_known and residual_near_noise:
        reason = "the noise is known here, and the residual with it is larger than the noise"
        return ResultWithModel(
            replace(result, unconfirmed=(*result.unconfirmed, *_list_unconfirmed(result, reason))), balances
        )
    reason = find_objection(result, balances)
    if result.found.steps and not reason:
        return ResultWithModel(replace(result, judgement=Judgement("partly_explained", True)), balances)
    balance_result = search_by_balance(result.context, balances, noise_known) if balances else None
    if balance_result is not None and not find_objection(balance_result, balances):
        judgement = replace(balance_result.judgement, verdict="partly_explained")
        return ResultWithModel(replace(balance_result, judgement=judgement, remarks=result.remarks), balances)
    return ResultWithModel(
        replace(result, unconfirmed=(*result.unconfirmed, *_list_unconfirmed(result, reason))), balances
    )


def find_objection(result: SearchResult, balances: Sequence[Balance]) -> str:
    """Find the reason not to name the effects that were found, as a clause; empty where they are named. Conditions in
    order: an effect; data held out; gain above its variation and above `FURTHER_LAW_SHARE`; no parameter at its
    tolerance; better than the best rival; confirmed by the force balance, where the gain is below
    `NAMED_REDUCTION_SHARE`."""
    context, explanation = result.context, result.found
    if not explanation.steps:
        return "it explains too little of the error to be added"
    total_gain = estimate_held_out_gain(context.full_measure, explanation.plain, explanation.after)
    previous_step = context.with_test_score(explanation.steps[-2]) if len(explanation.steps) > 1 else explanation.plain
    last_gain = estimate_held_out_gain(context.full_measure, previous_step, explanation.after)
    if total_gain is None or last_gain is None:
        return "too little data was held out to confirm it"
    if min(total_gain.low, last_gain.low) <= 0:
        return INSIGNIFICANT_GAIN_OBJECTION
    if min(total_gain.gain, last_gain.gain) < FURTHER_LAW_SHARE:
        return (
            f"on held-out data it explains {100 * min(total_gain.gain, last_gain.gain):.1f} % of the error's power, "
            f"and {100 * FURTHER_LAW_SHARE:.0f} % are required"
        )
    if context.tuning.is_at_bound(explanation.after.fitted.deviations):
        return "with it, the fit moves a parameter of the model to the limit of its tolerance"
    rival = _find_best_rival(context, result)
    if rival is not None and _is_indistinguishable(context, rival, explanation.after):
        return f"these data cannot distinguish it from {rival.newest.replace('_', ' ')}"
    claims = explanation.after.fitted.hypothesis.claims
    if total_gain.gain < NAMED_REDUCTION_SHARE and not all(_is_named_by_balance(claim, balances) for claim in claims):
        return "it explains less than half of the error's power, and the force balance does not confirm it"
    return ""


def _is_indistinguishable(context: SearchContext, rival: FittedCandidate, with_effect: FittedCandidate) -> bool:
    """Whether the 95 % interval of the gain over the rival reaches zero, or the gain cannot be computed."""
    gain_over_rival = estimate_held_out_gain(context.full_measure, rival, with_effect)
    return gain_over_rival is None or gain_over_rival.low <= 0


def _find_best_rival(context: SearchContext, result: SearchResult) -> FittedCandidate | None:
    """Find the best other candidate of the round that added the last effect, scored on held-out samples; refinements of
    that effect are left out. None without one."""
    steps = result.found.steps
    if len(result.found.rounds) < len(steps):
        return None
    best = steps[-1]
    rivals = [
        rival
        for rival in result.found.rounds[len(steps) - 1]
        if rival.newest != best.newest and not is_refined_candidate(rival, best)
    ]
    return context.with_test_score(rivals[0]) if rivals else None


def _is_named_by_balance(claim: Claim, balances: Sequence[Balance]) -> bool:
    """Whether the balance of the claim's axis names the effect, a law simulated as it, or a law that it rivals; False
    for an effect that is not of one axis."""
    if claim.spread != "one" or claim.sites[0] >= len(balances):
        return False
    names = {
        name
        for judged_law in balances[claim.sites[0]].named
        for name in (judged_law.law.effect, SIMULATED_AS.get(judged_law.law.effect, ""), *judged_law.equivalents)
    }
    return claim.effect.name in names


def _list_unconfirmed(result: SearchResult, reason: str) -> tuple[UnconfirmedEffect, ...]:
    """List candidates with a positive held-out gain, the largest gain first: of the first `CANDIDATES_WITH_GAIN`
    effects of the round that added the last effect, or of the first round where none was added; one candidate per
    effect. reason: why the first candidate of the round is not named."""
    rounds = [fitted_candidates for fitted_candidates in result.found.rounds if fitted_candidates]
    if not rounds:
        return ()
    round_index = max(min(len(result.found.steps), len(rounds)) - 1, 0)
    best_by_effect: dict[str, FittedCandidate] = {}
    for candidate in rounds[round_index]:
        best_by_effect.setdefault(candidate.newest, candidate)
    unconfirmed = []
    for rank, candidate in enumerate([*best_by_effect.values()][:CANDIDATES_WITH_GAIN]):
        gain = estimate_held_out_gain(
            result.context.full_measure, result.found.plain, result.context.with_test_score(candidate)
        )
        if gain is not None and gain.gain > 0:
            unconfirmed.append(
                UnconfirmedEffect(
                    candidate.fitted.hypothesis, gain.gain, reason if rank == 0 else _explain_not_best(gain)
                )
            )
    return tuple(sorted(unconfirmed, key=lambda item: -item.gain))


def _explain_not_best(gain: HeldOutGain) -> str:
    """Explain, as a clause, why a candidate other than the best is not named."""
    if gain.low <= 0:
        return INSIGNIFICANT_GAIN_OBJECTION
    return "another candidate has a smaller error on the data that were fitted"
