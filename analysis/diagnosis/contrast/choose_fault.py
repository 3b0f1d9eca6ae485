"""Choose which fault to name after a comparison with clean recordings: a fault, a class of faults, or none.

Of the faults that pass all tests of `_find_objection`, the one with the smallest error is the best, or a special case
of it that these data cannot distinguish from it. Its class contains the rivals whose error is not significantly larger
(bootstrap over blocks; a rival that contains the best as a special case only where it is significantly better), and
those that failed a test but fit about as well (`_find_inconclusive`), the latter only until the class with the best has
`LARGEST_FAULT_CLASS` members, and effects with the same signals (`ALIASES`). No fault is named where the class is too
large, a fault that failed a test has a clearly smaller error, the best explains too small a share of the difference, or
its axis is ambiguous. Errors and gains are those of `rank_faults`. Called by `compare_with_reference`."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from analysis.diagnosis.contrast.comparison import Comparison, JudgedFault
from analysis.diagnosis.contrast.rank_faults import FOLDS
from analysis.diagnosis.data.correlated_residuals import draw_bootstrap_blocks
from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.limits import (
    BOOTSTRAP_DRAWS,
    BOOTSTRAP_LEVEL,
    FAULT_GAIN_FACTOR,
    FAULT_INTERVAL_RATIO,
    FAULT_RIVAL_ERROR_MARGIN,
    FAULT_RIVAL_GAIN_MARGIN,
    LARGEST_FAULT_CLASS,
    LEAST_FAULT_GAIN,
    LEAST_FAULT_SHARE,
)

T_QUANTILE = float(stdtrit(FOLDS - 1, 0.975))
"""Half-width of a 95 % confidence interval in standard errors: quantile 0.975 of Student's t with FOLDS - 1 degrees of
freedom."""
ALIASES = {
    "transport_delay": ("logger_offset",),
    "logger_offset": ("transport_delay",),
    "force_offset": ("constant_force",),
}  # fmt: skip
"""Faults with the same effect on the signals: the two delays with a single response channel, and for a force offset a
constant force in any recording."""

NO_GAIN_REASON = "it contains the named fault as a special case, and its error is not significantly smaller"
RIVAL_REASON = "another fault explains as much of the difference between these recordings, or more"
"""Reasons, in messages, why a rival of the best fault is not named."""


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """The named fault with its class and probability, and the candidates that are not named."""

    named: JudgedFault | None
    """None where no fault is named."""
    equivalents: tuple[str, ...]
    """Names of the effects that fit about as well (class); empty where no fault is named."""
    probability: float
    """Share of bootstrap draws in which no rival that passed the tests has a smaller error, rivals that contain the
    named fault as a special case not counted; 0 where no fault is named."""
    unnamed: tuple[tuple[JudgedFault, str], ...]
    """Candidates that are not named, each with the reason in words; without members of the class."""


def choose_fault(comparison: Comparison, response_count: int) -> Decision:
    """Choose the fault or class to name, and list the other candidates. response_count: number of response channels."""
    tested = [(fault, _find_objection(fault, comparison.has_difference_without(fault))) for fault in comparison.faults]
    accepted_faults = [fault for fault, flaw in tested if flaw == ""]
    unnamed = tuple((fault, flaw) for fault, flaw in tested if fault.gain > 0 and flaw)
    if not accepted_faults:
        return Decision(None, (), 0.0, unnamed)
    best = _choose_simplest(accepted_faults, comparison)
    rivals = [fault for fault in accepted_faults if fault is not best]
    distinct_rivals = [rival for rival in rivals if not _subsumes(rival, best)]
    inseparable = [rival for rival in distinct_rivals if _is_inseparable(best, rival, comparison)]
    failed = [fault for fault, flaw in tested if flaw and fault.gain >= LEAST_FAULT_GAIN and not _subsumes(fault, best)]
    inseparable += [fault for fault in rivals if _subsumes(fault, best) and _is_significantly_better(fault, best)]
    members = (
        *inseparable,
        *_find_inconclusive(failed, best, comparison)[: max(LARGEST_FAULT_CLASS - 1 - len(inseparable), 0)],
    )
    better_faults = [
        fault for fault in failed if fault.gain_low > 0 and _sum_excess(fault, best) < -_find_margin(best, comparison)
    ]
    aliases = ALIASES.get(best.fault.effect, ()) if response_count == 1 or best.fault.effect == "force_offset" else ()
    equivalents = tuple(name for name in dict.fromkeys((*(rival.fault.effect for rival in members), *aliases))
                  if name != best.fault.effect)  # fmt: skip
    other_axes = [rival.fault.axis for rival in members if rival.fault.effect == best.fault.effect]
    reason = ""
    if better_faults:
        reason = f"{get_noun(better_faults[0].fault.effect)} explains more, but did not pass all tests itself"
    elif best.share < LEAST_FAULT_SHARE:
        reason = (f"it explains {100 * best.share:.0f} % of the difference between these recordings: "
                  "the main cause is another")  # fmt: skip
    elif len(equivalents) >= LARGEST_FAULT_CLASS:
        reason = "these data cannot distinguish it from " + ", ".join(equivalents)
    elif other_axes:
        reason = f"these data do not show whether it is on {best.fault.axis} or on {', '.join(other_axes)}"
    unnamed_rivals = tuple((rival, NO_GAIN_REASON if _subsumes(rival, best) else RIVAL_REASON) for rival in rivals)
    if reason:
        return Decision(None, (), 0.0, ((best, reason), *unnamed_rivals, *unnamed))
    unnamed_candidates = tuple(candidate for candidate in (*unnamed_rivals, *unnamed) if candidate[0] not in members)
    return Decision(best, equivalents, _estimate_probability_of_best(best, distinct_rivals), unnamed_candidates)


def _find_inconclusive(
    failed_faults: Sequence[JudgedFault], best: JudgedFault, comparison: Comparison
) -> list[JudgedFault]:
    """Find the candidates of other effects that failed a test of `_find_objection`, whose gain has a lower bound above
    0, and whose error differs too little from that of the best to exclude them."""
    return [
        judged_fault
        for judged_fault in failed_faults
        if judged_fault.fault.effect != best.fault.effect
        and judged_fault.gain_low > 0
        and abs(_sum_excess(judged_fault, best)) <= _find_margin(best, comparison)
    ]


def _subsumes(candidate: JudgedFault, best: JudgedFault) -> bool:
    """Whether `candidate` contains `best` as a special case at the same axis."""
    return best.fault.effect in candidate.fault.simpler and best.fault.axis == candidate.fault.axis


def _choose_simplest(accepted_faults: Sequence[JudgedFault], comparison: Comparison) -> JudgedFault:
    """Choose the fault with the smallest error, or the first special case of it that these data cannot distinguish from
    it."""
    best = min(accepted_faults, key=lambda judged_fault: float(judged_fault.block_squares.sum()))
    for candidate in accepted_faults:
        if _subsumes(best, candidate) and _is_inseparable(best, candidate, comparison):
            return candidate
    return best


def _find_objection(candidate: JudgedFault, sets_differ: bool) -> str:
    """Find the reason not to name a fault, as a clause; empty if it passes all tests. sets_differ: whether the clean
    and the faulty set differ by more than stretches of a single set do. If not, the gain must be steady: its lower
    bound at least `FAULT_INTERVAL_RATIO` of it, and the fault constant during a recording."""
    if candidate.gain < LEAST_FAULT_GAIN or candidate.gain_low <= 0:
        return "its gain is not larger than its variation between stretches of the recordings"
    is_steady = candidate.gain_low >= FAULT_INTERVAL_RATIO * candidate.gain and not candidate.fault.varies
    if not sets_differ and not is_steady:
        return "stretches of one set differ as much as the sets do"
    if candidate.gain <= FAULT_GAIN_FACTOR * candidate.control_gain:
        return (
            f"its gain between stretches of one set is {candidate.control_gain:.2g} already, and "
            f"{candidate.gain:.2g} between the two sets"
        )
    # A bandwidth is infinite without the fault, but has the relative error of its time constant, and is compared with
    # 0 too; a limit, rate or position is fixed by the variant, without an error, and passes.
    main_parameter, value = next(iter(candidate.values.items()))
    distance_from_no_fault = abs(value - (1.0 if main_parameter == "gain" else 0.0))
    if distance_from_no_fault <= T_QUANTILE * candidate.standard_errors[main_parameter]:
        return "the confidence interval of its parameter includes the value without the fault"
    return ""


def _is_inseparable(best: JudgedFault, rival: JudgedFault, comparison: Comparison) -> bool:
    """Whether the error of `rival` exceeds that of the best by at most `_find_margin`, or not significantly
    (bootstrap over blocks)."""
    excess_errors = rival.block_squares - best.block_squares
    draws = draw_bootstrap_blocks(len(excess_errors))
    return bool(
        excess_errors.sum() <= _find_margin(best, comparison)
        or np.quantile(excess_errors[draws].sum(axis=1), BOOTSTRAP_LEVEL) <= 0
    )


def _is_significantly_better(generalisation: JudgedFault, best: JudgedFault) -> bool:
    """Whether a fault that contains the best as a special case has a significantly smaller error (bootstrap over
    blocks)."""
    error_reduction = best.block_squares - generalisation.block_squares
    return bool(
        np.quantile(error_reduction[draw_bootstrap_blocks(len(error_reduction))].sum(axis=1), BOOTSTRAP_LEVEL) > 0
    )


def _sum_excess(rival: JudgedFault, best: JudgedFault) -> float:
    """Compute the sum of squared errors with `rival` undone, less that with the best undone."""
    return float((rival.block_squares - best.block_squares).sum())


def _find_margin(best: JudgedFault, comparison: Comparison) -> float:
    """Find the difference between the error sums of a rival and the best above which they are distinguished: the
    smaller of `FAULT_RIVAL_GAIN_MARGIN` of the reduction by the best and `FAULT_RIVAL_ERROR_MARGIN` of its remaining
    error."""
    remaining_error = float(best.block_squares.sum())
    return min(
        FAULT_RIVAL_GAIN_MARGIN * (float(comparison.block_squares.sum()) - remaining_error),
        FAULT_RIVAL_ERROR_MARGIN * remaining_error,
    )


def _estimate_probability_of_best(best: JudgedFault, rivals: Sequence[JudgedFault]) -> float:
    """Estimate the probability that the best is the cause: share of bootstrap draws over blocks in which no rival has a
    smaller error. 1 without rivals."""
    draws = draw_bootstrap_blocks(len(best.block_squares))
    is_best = np.ones(BOOTSTRAP_DRAWS, dtype=np.bool_)
    for rival in rivals:
        is_best &= (rival.block_squares - best.block_squares)[draws].sum(axis=1) >= 0
    return float(is_best.mean())
