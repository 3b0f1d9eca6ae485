"""Decides which fault is named after a comparison with clean recordings: a fault, a class of faults, or none.

The fault with the smallest error is named if its gain passes the tests of `_find_objection`. Rivals whose error is not
significantly larger (bootstrap over blocks) form its class; a class of too many faults, or an unnamed candidate with a
smaller error, prevents a name. Errors and gains are those of `rank_faults`. Called by `compare_with_reference`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from analysis.diagnosis.contrast.comparison import Comparison, JudgedFault
from analysis.diagnosis.contrast.rank_faults import FOLDS
from analysis.diagnosis.data.correlated_residuals import draw_bootstrap_blocks
from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.settings import (
    BOOTSTRAP_DRAWS,
    BOOTSTRAP_LEVEL,
    FAULT_BEYOND,
    FAULT_MAIN_PART,
    FAULT_RIVAL_BEHIND,
    FAULT_RIVAL_WORSE,
    FAULT_STEADY,
    LARGEST_FAULT_CLASS,
    LEAST_FAULT_GAIN,
)

T_QUANTILE = float(stdtrit(FOLDS - 1, 0.975))
"""Half-width of a 95 % confidence interval in standard errors: quantile 0.975 of Student's t with FOLDS - 1 degrees of
freedom. A fault is not named where its parameter may have the value without a fault."""
ALIASES = {
    "transport_delay": ("logger_offset",),
    "logger_offset": ("transport_delay",),
    "force_offset": ("constant_force",),
}  # fmt: skip
"""Faults with the same effect on the signals: the two delays in a recording of one response, and an offset of the
command and a constant force in any recording."""

REFINEMENT_REASON = "it contains the named fault as a special case, and its error is not significantly smaller"
RIVAL_REASON = "another fault explains more of the difference between these recordings"
"""Reasons, in messages, why a rival of the named fault is not named."""


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """The named fault with its class and probability, or None, and the candidates that are not named."""

    named: JudgedFault | None
    equivalents: tuple[str, ...]
    """Effects that fit about as well in its place (class); empty where none is named."""
    probability: float
    """Share of bootstrap draws in which no accepted rival has a smaller error, refinements not counted; 0 without a
    name."""
    unnamed: tuple[tuple[JudgedFault, str], ...]
    """Candidates that are not named, each with the reason in words."""


def choose_fault(comparison: Comparison, response_count: int) -> Decision:
    """Choose the fault or class to name, and list the other candidates. response_count: number of response channels."""
    tested = [(fault, _find_objection(fault, comparison.sets_differ_without(fault))) for fault in comparison.faults]
    accepted = [fault for fault, note in tested if note == ""]
    unnamed = tuple((fault, note) for fault, note in tested if fault.gain > 0 and note)
    if not accepted:
        return Decision(None, (), 0.0, unnamed)
    best = _choose_simplest(accepted, comparison)
    rivals = [fault for fault in accepted if fault is not best]
    distinct = [rival for rival in rivals if not _is_finer(rival, best)]
    inseparable = [rival for rival in distinct if _is_inseparable(best, rival, comparison)]
    failed = [fault for fault, note in tested if note and fault.gain >= LEAST_FAULT_GAIN and not _is_finer(fault, best)]
    inseparable += [fault for fault in rivals if _is_finer(fault, best) and _is_significantly_better(fault, best)]
    peers = (
        *inseparable,
        *_find_inconclusive(failed, best, comparison)[: max(LARGEST_FAULT_CLASS - 1 - len(inseparable), 0)],
    )
    better = [
        fault for fault in failed if fault.gain_low > 0 and _get_gap(fault, best) < -_get_least_gap(best, comparison)
    ]
    aliases = ALIASES.get(best.fault.effect, ()) if response_count == 1 or best.fault.effect == "force_offset" else ()
    equivalents = tuple(name for name in dict.fromkeys((*(rival.fault.effect for rival in peers), *aliases))
                  if name != best.fault.effect)  # fmt: skip
    other_axes = [rival.fault.axis for rival in peers if rival.fault.effect == best.fault.effect]
    reason = ""
    if better:
        reason = f"{get_noun(better[0].fault.effect)} explains more, but is not significant itself"
    elif best.share < FAULT_MAIN_PART:
        reason = (
            f"it explains {100 * best.share:.0f} % of the difference between these recordings: the main cause is "
            "another"
        )
    elif len(equivalents) >= LARGEST_FAULT_CLASS:
        reason = "these data cannot distinguish it from " + ", ".join(equivalents)
    elif other_axes:
        reason = f"these data do not show whether it is on {best.fault.axis} or on {', '.join(other_axes)}"
    rejected = tuple((rival, REFINEMENT_REASON if _is_finer(rival, best) else RIVAL_REASON) for rival in rivals)
    if reason:
        return Decision(None, (), 0.0, ((best, reason), *rejected, *unnamed))
    remaining = tuple(candidate for candidate in (*rejected, *unnamed) if candidate[0] not in peers)
    return Decision(best, equivalents, _estimate_probability_of_best(best, distinct), remaining)


def _find_inconclusive(failed: Sequence[JudgedFault], best: JudgedFault, comparison: Comparison) -> list[JudgedFault]:
    """Candidates that fail a test of `_find_objection` although their gain has a lower bound above 0, and whose error
    differs too little from that of the best, which passes all tests: either may be the cause."""
    return [
        judged_fault
        for judged_fault in failed
        if judged_fault.fault.effect != best.fault.effect
        and judged_fault.gain_low > 0
        and abs(_get_gap(judged_fault, best)) <= _get_least_gap(best, comparison)
    ]


def _is_finer(candidate: JudgedFault, best: JudgedFault) -> bool:
    """Whether `candidate` contains `best` as a special case at the same axis, so that it always fits better."""
    return best.fault.effect in candidate.fault.simpler and best.fault.axis == candidate.fault.axis


def _choose_simplest(significant: Sequence[JudgedFault], comparison: Comparison) -> JudgedFault:
    """The fault with the smallest error, or a special case of it that these data cannot distinguish from it."""
    best = min(significant, key=lambda judged_fault: float(judged_fault.errors.sum()))
    for candidate in significant:
        if _is_finer(best, candidate) and _is_inseparable(best, candidate, comparison):
            return candidate
    return best


def _find_objection(fault: JudgedFault, sets_differ: bool) -> str:
    """Reason not to name a fault; empty if it passes all tests. sets_differ: whether the clean and the faulty set
    differ by more than stretches of a single set do. If not, the fault must gain about equally in all blocks, which
    excludes slow changes during a recording."""
    if fault.gain < LEAST_FAULT_GAIN or fault.gain_low <= 0:
        return "its gain is not larger than its variation between stretches of the recordings"
    is_steady = fault.gain_low >= FAULT_STEADY * fault.gain and not fault.fault.varies
    if not sets_differ and not is_steady:
        return "stretches of one set differ as much as the sets do"
    if fault.gain <= FAULT_BEYOND * fault.control_gain:
        return (
            f"its gain between stretches of one set is {fault.control_gain:.2g} already, and {fault.gain:.2g} between "
            "the two sets"
        )
    main_parameter = next(iter(fault.values))
    if abs(_compute_distance_from_no_fault(fault, main_parameter)) <= T_QUANTILE * fault.spread[main_parameter]:
        return "the confidence interval of its parameter includes the value without the fault"
    return ""


def _compute_distance_from_no_fault(fault: JudgedFault, name: str) -> float:
    """Distance of a parameter from its value without a fault: 1 for a gain, else 0."""
    return fault.values[name] - (1.0 if name == "gain" else 0.0)


def _is_inseparable(best: JudgedFault, rival: JudgedFault, comparison: Comparison) -> bool:
    """Whether the error of `rival` exceeds that of the best too little to distinguish them, or not significantly
    (bootstrap over blocks)."""
    excess_errors = rival.errors - best.errors
    draws = draw_bootstrap_blocks(len(excess_errors))
    return bool(
        excess_errors.sum() <= _get_least_gap(best, comparison)
        or np.quantile(excess_errors[draws].sum(axis=1), BOOTSTRAP_LEVEL) <= 0
    )


def _is_significantly_better(refinement: JudgedFault, best: JudgedFault) -> bool:
    """Whether a fault that contains the best as a special case has a significantly smaller error (bootstrap over
    blocks)."""
    error_reduction = best.errors - refinement.errors
    return bool(
        np.quantile(error_reduction[draw_bootstrap_blocks(len(error_reduction))].sum(axis=1), BOOTSTRAP_LEVEL) > 0
    )


def _get_gap(rival: JudgedFault, best: JudgedFault) -> float:
    """Sum of squared errors with `rival` undone, minus that with the best undone."""
    return float((rival.errors - best.errors).sum())


def _get_least_gap(best: JudgedFault, comparison: Comparison) -> float:
    """Least difference between a rival's error and that of the best, as sums of squares, at which both are
    distinguished: a share of the reduction by the best, or of its remaining error, the smaller of both."""
    remaining_error = float(best.errors.sum())
    return min(
        FAULT_RIVAL_BEHIND * (float(comparison.errors.sum()) - remaining_error), FAULT_RIVAL_WORSE * remaining_error
    )


def _estimate_probability_of_best(best: JudgedFault, rivals: Sequence[JudgedFault]) -> float:
    """Share of bootstrap draws over blocks in which no rival has a smaller error than the best."""
    draws = draw_bootstrap_blocks(len(best.errors))
    is_best = np.ones(BOOTSTRAP_DRAWS, dtype=np.bool_)
    for rival in rivals:
        is_best &= (rival.errors - best.errors)[draws].sum(axis=1) >= 0
    return float(is_best.mean())
