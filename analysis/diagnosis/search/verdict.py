"""The verdict on a finished search: no mismatch, wrong parameters, named physics, or unexplained; and remarks on it.

Errors are rms errors over rms noise (`FitScore`). The limits are in `settings`, section "The verdict".
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from analysis.diagnosis.document import Verdict
from analysis.diagnosis.effect_words import noun_of
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import leaves_little, share_of_mismatch
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from analysis.diagnosis.settings import (
    CONFIRMED_SHARE,
    EXPLAINED_BY_CHANCE,
    HELD_OUT_ALONE_ERROR,
    HELD_OUT_ERROR,
    HELD_OUT_SURPRISE,
    HELD_OUT_TOO_SMALL,
    MOST_EFFECTS,
    NAMED_ERROR,
    NAMED_GAIN,
    NAMED_SHARE,
    NOISE_ALONE,
    WIDER_RETUNING_BOUND,
)
from equalizer.signals.signal import FloatArray

TEST_HALF_USED = (
    "The held-out data show a mismatch that the rest of the recording does not contain: the first half of each "
    "held-out stretch was used to find its cause, the second half to confirm it."
)
TEST_PARTS_USED = (
    "The held-out data show a mismatch that the rest of the recording does not contain, and only in places: every "
    "other one of many equal parts of each held-out stretch was used to find its cause, the parts between to confirm "
    "it. Both are from the same motion, so that this test is weaker than one of another recording."
)
MILDER_TEST_USED = (
    "The held-out data show a mismatch that the rest of the recording does not contain: all but the strongest part "
    "of these data was used to find its cause, the strongest part to confirm it."
)
NOT_SHOWN = "The held-out data show a mismatch that the rest of the recording does not contain."
ONLY_REFINES = (
    "The best explanation is a law that was excluded from the search. Laws that contain it as a special case explain "
    "the mismatch equally well, but their additional terms are not significant, so none of them is named."
)
MODEL_MOVED = (
    f"The model's own parameters were allowed to move by up to {WIDER_RETUNING_BOUND:g} standard deviations of their "
    "calibration: within a smaller range, no equally simple explanation was found. The model may have been fitted to "
    "a device that already had the missing physics."
)


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict of a search, and whether its effects may be named."""

    verdict: Verdict
    named: bool
    """Whether the effects of `Explanation.after` may be named."""


@dataclass(frozen=True, slots=True, eq=False)
class Unconfirmed:
    """An effect that was found and is not named."""

    hypothesis: Hypothesis
    gain: float
    """Share of the held-out error power that the effect removes."""
    why_not: str
    """Reason why it is not named, in words."""
    claim: int = -1
    """Index of the effect among the hypothesis's claims."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchResult:
    """Result of a search: the fits, the verdict, and candidates that are not named."""

    context: SearchContext
    """The search's shared state, with the final roles of the samples (fit, choose, test)."""
    found: Explanation
    judgement: Judgement
    remarks: tuple[str, ...] = ()
    """Sentences for the user."""
    errors: FloatArray | None = None
    """Standard errors of the final fit (`final_errors`), where the search needed them."""
    unconfirmed: tuple[Unconfirmed, ...] = ()
    """Effects that were found and are not named, the largest gain first."""


def judge(found: Explanation) -> Judgement:
    """The verdict by the errors on the samples to fit and to choose by. Held-out samples can only withdraw names
    (`_is_confirmed`), or turn "explained" into "partly_explained" or "unexplained"."""
    if not found.after.fitted.hypothesis.claims or not _is_confirmed(found):
        if found.before.score.worst_channel <= NOISE_ALONE:
            return Judgement("no_mismatch", False)
        return Judgement("parameters" if found.retuned.score.worst_channel <= NOISE_ALONE else "unexplained", False)
    if found.statistic is not None:
        return Judgement(
            "explained" if found.after.score.worst_channel <= EXPLAINED_BY_CHANCE else "partly_explained", True
        )
    if as_good_as_noise(found) and not np.nanmax(found.after.score.test, initial=0.0) > HELD_OUT_ERROR:
        return Judgement("explained", True)
    return Judgement("partly_explained", True) if worth_naming(found) else Judgement("unexplained", False)


def search_remarks(found: Explanation) -> tuple[str, ...]:
    """Sentences for the user: that time ran out, and which effects were found but are not named."""
    early = (OUT_OF_TIME,) if found.ended_early else ()
    barred = (ONLY_REFINES,) if found.barred else ()
    undetermined = (
        f"An explanation by {noun_of(name)} is not named: these recordings hardly determine its parameters."
        for name in dict.fromkeys(found.undetermined)
    )
    return (*early, *barred, *undetermined)


def as_good_as_noise(found: Explanation) -> bool:
    """Whether the error on the samples to fit and to choose by is little more than noise (`leaves_little`)."""
    return leaves_little(found.retuned, found.after)


def worth_naming(found: Explanation) -> bool:
    """Whether the effects are named although a mismatch remains: the error is at most `NAMED_ERROR`, or they take
    `NAMED_SHARE` of the mismatch, or they lower the mean log error by `NAMED_GAIN`."""
    taken = found.retuned.score.mean_log_error - found.after.score.mean_log_error
    share = share_of_mismatch(found.retuned, found.after)
    return found.after.score.worst_channel <= NAMED_ERROR or share >= NAMED_SHARE or taken >= NAMED_GAIN


def _is_confirmed(found: Explanation) -> bool:
    """Whether the explanation lowers the mean logarithm of the held-out errors by at least `CONFIRMED_SHARE` of it;
    also true where that is at most `HELD_OUT_TOO_SMALL`, or where nothing was held out."""
    whole, left = (float(np.mean(np.log(candidate.score.test))) for candidate in (found.retuned, found.after))
    if not np.isfinite(whole):
        return True
    return whole <= HELD_OUT_TOO_SMALL or whole - left >= CONFIRMED_SHARE * whole


def confirms_addition(without: FittedCandidate, with_it: FittedCandidate) -> bool:
    """Whether the held-out samples confirm what `with_it` adds to `without`: the logarithm of the worst channel's
    error, above `HELD_OUT_ALONE_ERROR` without the addition, falls by at least `CONFIRMED_SHARE`."""
    worst = float(np.max(without.score.test))
    if not np.isfinite(worst) or worst <= HELD_OUT_ALONE_ERROR:
        return False
    left = float(np.max(with_it.score.test))
    return float(np.log(worst) - np.log(left)) >= CONFIRMED_SHARE * float(np.log(worst))


def shares_taken(without: FittedCandidate, steps: Sequence[FittedCandidate]) -> tuple[float, ...]:
    """Share of the mismatch of the re-tuned model that each step removed; their sum is at most 1."""
    left = [0.0, *(share_of_mismatch(without, step) for step in steps)]
    return tuple(max(after - before, 0.0) for before, after in pairwise(left))


def may_move_further(result: SearchResult) -> bool:
    """Whether to search with a wider bound: a mismatch remains or three effects were needed, and a parameter of the
    model is at its bound. Never with certain effects, reference recordings, or band powers."""
    context, found = result.context, result.found
    verdict, ends = result.judgement.verdict, (found.retuned, *found.steps, found.after)
    left = verdict in ("unexplained", "partly_explained")
    left = left or (verdict == "explained" and len(found.steps) == MOST_EFFECTS)
    fixed = found.statistic is not None or context.references is not None or context.certain
    return left and not fixed and any(context.tuning.is_at_bound(end.fitted.deviations) for end in ends)


def is_plainer(again: SearchResult, result: SearchResult) -> bool:
    """Whether a search with a wider bound explains the recordings, by effects or by parameters alone, and the first
    does not or needs more effects; with a physically possible model (`Tuning.is_possible`) inside the wider bound."""
    found, tuning = again.found, again.context.tuning
    if result.judgement.verdict == "explained" and len(found.steps) >= len(result.found.steps):
        return False
    explains = again.judgement.verdict == "explained"
    alone = again.judgement.verdict == "parameters"
    alone = alone and not np.nanmax(found.retuned.score.test, initial=0.0) > HELD_OUT_SURPRISE
    if not explains and not alone:
        return False
    deviations = (found.after if explains else found.retuned).fitted.deviations
    return tuning.is_possible(deviations) and not tuning.is_at_bound(deviations)
