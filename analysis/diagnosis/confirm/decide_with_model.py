"""Decides by the error on held-out samples which effects a search with a given model names.

Used where residuals exceed the noise. Where repeats show that the noise is about as large as the residual, the
likelihood decides (`verdict`). Otherwise the residual of a real device is far above its noise, and remains so even with
a true law. An effect is then named if it removes enough of the held-out error power, with a 95 % interval by block
bootstrap (`held_out_gain`): compared with the model without it and with its best rival. An effect that removes less
than half of the power must also be named by the force balance. `objection` tests these conditions in their order.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import PLAYED_AS, Balance
from analysis.diagnosis.confirm.balance_with_model import find_balances_beside_model
from analysis.diagnosis.confirm.confirm_laws import search_by_balance
from analysis.diagnosis.confirm.fitting_measures import FittingMeasure
from analysis.diagnosis.confirm.held_out_gain import HeldOutGain, held_out_gain
from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.search.parsimony import only_refines
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult, Unconfirmed
from analysis.diagnosis.settings import (
    CANDIDATES_WITH_GAIN,
    FURTHER_LAW_OF_ALL,
    NAMED_ERROR,
    NAMED_OF_CEILING,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.recording import Recording


@dataclass(frozen=True, slots=True, eq=False)
class ResultWithModel:
    """A search's result after the decision by held-out gain, and the force balances that were used for it."""

    result: SearchResult
    balances: tuple[Balance, ...] = ()
    """Empty where no motion was measured."""


def decide_with_model(
    recordings: Sequence[Recording], fitting: FittingMeasure, result: SearchResult, time_left: TimeBudget
) -> ResultWithModel:
    """The result after the decision, and the force balances with the model as their base. result: of the search by
    simulation, with errors compared sample by sample, after which some error is unexplained."""
    known_noise = all(floor.how == "repeats" for floor in fitting.chosen.floors)
    balances = find_balances_beside_model(recordings, fitting.model, result.context.barred, time_left)
    near_noise = float(np.nanmax(result.found.retuned.score.test, initial=0.0)) <= NAMED_ERROR
    if result.judgement.named or result.found.barred:
        return ResultWithModel(result, balances)
    if known_noise and near_noise:
        why_not = "the noise is known here, and the residual with it is larger than the noise"
        return ResultWithModel(
            replace(result, unconfirmed=(*result.unconfirmed, *_list_unconfirmed(result, why_not))), balances
        )
    why_not = objection(result, balances)
    if result.found.steps and not why_not:
        return ResultWithModel(replace(result, judgement=Judgement("partly_explained", True)), balances)
    found = search_by_balance(result.context, balances, known_noise) if balances else None
    if found is not None and not objection(found, balances):
        judged = replace(found.judgement, verdict="partly_explained")
        return ResultWithModel(replace(found, judgement=judged, remarks=result.remarks), balances)
    return ResultWithModel(
        replace(result, unconfirmed=(*result.unconfirmed, *_list_unconfirmed(result, why_not))), balances
    )


def objection(result: SearchResult, balances: Sequence[Balance]) -> str:
    """Reason not to name the effects that were found, as a sentence; empty where they are named."""
    context, found = result.context, result.found
    if not found.steps:
        return "it explains too little of the error to be added"
    whole = held_out_gain(context.whole, found.plain, found.after)
    before = context.with_test_score(found.steps[-2]) if len(found.steps) > 1 else found.plain
    last = held_out_gain(context.whole, before, found.after)
    if whole is None or last is None:
        return "too little data was held out to confirm it"
    if min(whole.low, last.low) <= 0:
        return "its gain on held-out data is not larger than its variation between stretches of the recording"
    if min(whole.gain, last.gain) < FURTHER_LAW_OF_ALL:
        return (
            f"on held-out data it explains {100 * min(whole.gain, last.gain):.1f} % of the error's power, "
            f"and {100 * FURTHER_LAW_OF_ALL:.0f} % are required"
        )
    if context.tuning.is_at_bound(found.after.fitted.deviations):
        return "with it, the fit moves a parameter of the model to the limit of its tolerance"
    rival = _best_rival(context, result)
    if rival is not None and _not_better(context, rival, found.after):
        return f"these data cannot distinguish it from {rival.newest.replace('_', ' ')}"
    claims = found.after.fitted.hypothesis.claims
    if whole.gain < NAMED_OF_CEILING and not all(_is_named_by_balance(claim, balances) for claim in claims):
        return "it explains less than half of the error's power, and the force balance does not confirm it"
    return ""


def _not_better(context: SearchContext, rival: FittedCandidate, after: FittedCandidate) -> bool:
    """Whether the 95 % interval of the gain over the rival reaches zero, or the gain cannot be computed."""
    gain_over_rival = held_out_gain(context.whole, rival, after)
    return gain_over_rival is None or gain_over_rival.low <= 0


def _best_rival(context: SearchContext, result: SearchResult) -> FittedCandidate | None:
    """The best rival of the last effect that is no refinement of it, scored on held-out samples; None = there is
    none."""
    steps = result.found.steps
    if len(result.found.rounds) < len(steps):
        return None
    best = steps[-1]
    others = [
        other
        for other in result.found.rounds[len(steps) - 1]
        if other.newest != best.newest and not only_refines(other, best)
    ]
    return context.with_test_score(others[0]) if others else None


def _is_named_by_balance(claim: Claim, balances: Sequence[Balance]) -> bool:
    """Whether the balance of the claim's axis names the effect, a law simulated as it, or a law that it rivals."""
    if claim.spread != "one" or claim.sites[0] >= len(balances):
        return False
    names = {
        name
        for weighed in balances[claim.sites[0]].named
        for name in (weighed.law.effect, PLAYED_AS.get(weighed.law.effect, ""), *weighed.alike)
    }
    return claim.effect.name in names


def _list_unconfirmed(result: SearchResult, why_not: str) -> tuple[Unconfirmed, ...]:
    """The best candidates of the round in which the search ended, the largest gain first."""
    rounds = [fitted_candidates for fitted_candidates in result.found.rounds if fitted_candidates]
    if not rounds:
        return ()
    number = max(min(len(result.found.steps), len(rounds)) - 1, 0)
    first: dict[str, FittedCandidate] = {}
    for candidate in rounds[number]:
        first.setdefault(candidate.newest, candidate)
    found = []
    for place, candidate in enumerate([*first.values()][:CANDIDATES_WITH_GAIN]):
        gain = held_out_gain(result.context.whole, result.found.plain, result.context.with_test_score(candidate))
        if gain is not None and gain.gain > 0:
            found.append(
                Unconfirmed(candidate.fitted.hypothesis, gain.gain, why_not if place == 0 else _why_behind(gain))
            )
    return tuple(sorted(found, key=lambda each: -each.gain))


def _why_behind(gain: HeldOutGain) -> str:
    """Reason, as a sentence, why a candidate other than the best is not named."""
    if gain.low <= 0:
        return "its gain on held-out data is not larger than its variation between stretches of the recording"
    return "another candidate has a smaller error on the data that were fitted"
