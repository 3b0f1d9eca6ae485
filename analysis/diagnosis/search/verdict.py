"""The verdict on a finished search: no mismatch, wrong parameters, named physics, or unexplained; and remarks on it.

Errors are rms errors over rms noise (`FitScore`), or over chance variation where band powers are compared. The limits
are in `limits`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from analysis.diagnosis.document import Verdict
from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.limits import (
    CONFIRMED_SHARE,
    EXPLAINED_BY_CHANCE,
    HELD_OUT_ALONE_ERROR,
    HELD_OUT_ERROR,
    HELD_OUT_MISMATCH_ERROR,
    HELD_OUT_TOO_SMALL,
    MOST_EFFECTS,
    NAMED_ERROR,
    NAMED_GAIN,
    NAMED_SHARE,
    NOISE_ALONE,
    WIDER_RETUNING_BOUND,
)
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import compute_mismatch_share, has_small_error
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
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
TEST_ONLY = "The held-out data show a mismatch that the rest of the recording does not contain."
ONLY_REFINES = (
    "The best explanation is a law that was excluded from the search. Other laws, such as those that contain it as a "
    "special case, also reduce the mismatch, but none of them explains it better, so none is named."
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
class UnconfirmedEffect:
    """An effect that was found and is not named, because the held-out samples or another check do not confirm it."""

    hypothesis: Hypothesis
    gain: float
    """Share of the held-out error power that the effect removes, alone or with others of the hypothesis; 0 where it is
    not known or not positive."""
    why_not: str
    claim: int = -1
    """Index of the effect among the hypothesis's claims; -1 = the last."""


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
    """Standard errors of the final fit (`compute_final_errors`), where the search needed them."""
    unconfirmed: tuple[UnconfirmedEffect, ...] = ()


def judge(explanation: Explanation) -> Judgement:
    """Determine the verdict by the errors on the samples to fit and to choose by. Held-out samples can only withdraw
    names (`_is_confirmed`), or turn "explained" into "partly_explained"."""
    if not explanation.after.fitted.hypothesis.claims or not _is_confirmed(explanation):
        if explanation.before.score.worst_channel <= NOISE_ALONE:
            return Judgement("no_mismatch", False)
        return Judgement(
            "parameters" if explanation.retuned.score.worst_channel <= NOISE_ALONE else "unexplained", False
        )
    if explanation.statistic is not None:
        return Judgement(
            "explained" if explanation.after.score.worst_channel <= EXPLAINED_BY_CHANCE else "partly_explained", True
        )
    if is_near_noise(explanation) and not np.nanmax(explanation.after.score.test, initial=0.0) > HELD_OUT_ERROR:
        return Judgement("explained", True)
    return Judgement("partly_explained", True) if is_worth_naming(explanation) else Judgement("unexplained", False)


def list_remarks(explanation: Explanation) -> tuple[str, ...]:
    """List sentences for the user: that time ran out, that only an excluded law explains the mismatch, and which
    effects were found but are not named, because the recordings do not determine their parameters."""
    time_remark = (OUT_OF_TIME,) if explanation.ended_early else ()
    excluded_remark = (ONLY_REFINES,) if explanation.excluded_name else ()
    undetermined = (
        f"An explanation by {get_noun(name)} is not named: these recordings hardly determine its parameters."
        for name in dict.fromkeys(explanation.undetermined)
    )
    return (*time_remark, *excluded_remark, *undetermined)


def is_near_noise(explanation: Explanation) -> bool:
    """Whether the error on the samples to fit and to choose by is little more than noise (`has_small_error`)."""
    return has_small_error(explanation.retuned, explanation.after)


def is_worth_naming(explanation: Explanation) -> bool:
    """Whether the effects are named although a mismatch remains: the error is at most `NAMED_ERROR`, or they take
    `NAMED_SHARE` of the mismatch, or they lower the mean log error by `NAMED_GAIN`."""
    gain = explanation.retuned.score.mean_log_error - explanation.after.score.mean_log_error
    share = compute_mismatch_share(explanation.retuned, explanation.after)
    return explanation.after.score.worst_channel <= NAMED_ERROR or share >= NAMED_SHARE or gain >= NAMED_GAIN


def _is_confirmed(explanation: Explanation) -> bool:
    """Whether the explanation lowers the mean logarithm over channels of the re-tuned model's held-out errors by at
    least `CONFIRMED_SHARE` of it; also true where it is at most `HELD_OUT_TOO_SMALL`, or where nothing was held out."""
    retuned_log_error, remaining_log_error = (
        float(np.mean(np.log(candidate.score.test))) for candidate in (explanation.retuned, explanation.after)
    )
    if not np.isfinite(retuned_log_error):
        return True
    return (
        retuned_log_error <= HELD_OUT_TOO_SMALL
        or retuned_log_error - remaining_log_error >= CONFIRMED_SHARE * retuned_log_error
    )


def has_confirmed_addition(base: FittedCandidate, extended: FittedCandidate) -> bool:
    """Whether the held-out samples confirm what `extended` adds to `base`: the logarithm of the worst channel's
    error falls by at least the share `CONFIRMED_SHARE`. False where the error without the addition is at most
    `HELD_OUT_ALONE_ERROR`, or where nothing was held out."""
    base_error = float(np.max(base.score.test))
    if not np.isfinite(base_error) or base_error <= HELD_OUT_ALONE_ERROR:
        return False
    extended_error = float(np.max(extended.score.test))
    return float(np.log(base_error) - np.log(extended_error)) >= CONFIRMED_SHARE * float(np.log(base_error))


def compute_step_shares(base: FittedCandidate, steps: Sequence[FittedCandidate]) -> tuple[float, ...]:
    """Compute the share of the mismatch of the re-tuned model `base` that each step removed, beyond the steps before; 0
    for a step that increased the mismatch."""
    cumulative = [0.0, *(compute_mismatch_share(base, step) for step in steps)]
    return tuple(max(upper - lower, 0.0) for lower, upper in pairwise(cumulative))


def is_wider_bound_needed(result: SearchResult) -> bool:
    """Whether to search with a wider bound: a mismatch remains or `MOST_EFFECTS` effects were needed, and a parameter
    of the model is at its bound. False with certain effects, reference recordings, or where band powers were
    compared."""
    context, explanation = result.context, result.found
    verdict, fits = result.judgement.verdict, (explanation.retuned, *explanation.steps, explanation.after)
    has_mismatch = verdict in ("unexplained", "partly_explained")
    has_mismatch = has_mismatch or (verdict == "explained" and len(explanation.steps) == MOST_EFFECTS)
    is_excluded = explanation.statistic is not None or context.references is not None or context.certain
    return (
        has_mismatch
        and not is_excluded
        and any(context.tuning.is_at_bound(candidate.fitted.deviations) for candidate in fits)
    )


def is_simpler(wider_result: SearchResult, result: SearchResult) -> bool:
    """Whether the search with a wider bound explains the recordings, by effects or by parameters alone (with a held-out
    error up to `HELD_OUT_MISMATCH_ERROR`), and the first search does not or needs more effects; False where the model
    then is physically impossible (`Tuning.is_physical`) or at the wider bound."""
    explanation, tuning = wider_result.found, wider_result.context.tuning
    if result.judgement.verdict == "explained" and len(explanation.steps) >= len(result.found.steps):
        return False
    by_effects = wider_result.judgement.verdict == "explained"
    by_parameters = wider_result.judgement.verdict == "parameters"
    by_parameters = (
        by_parameters and not np.nanmax(explanation.retuned.score.test, initial=0.0) > HELD_OUT_MISMATCH_ERROR
    )
    if not by_effects and not by_parameters:
        return False
    deviations = (explanation.after if by_effects else explanation.retuned).fitted.deviations
    return tuning.is_physical(deviations) and not tuning.is_at_bound(deviations)
