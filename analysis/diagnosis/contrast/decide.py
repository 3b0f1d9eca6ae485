"""Decides what is named after a comparison with clean recordings: a fault, a class of faults, or candidates only.

The fault with the smallest error is named if its gain passes the tests of `_why_not`. Rivals whose error is not
significantly larger (bootstrap over blocks) form its class; a class of too many faults, or an unnamed candidate with a
smaller error, prevents a name. Errors and gains are those of `compare`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from analysis.diagnosis.contrast.compare import FOLDS
from analysis.diagnosis.contrast.comparison import Comparison, JudgedFault
from analysis.diagnosis.data.correlated_residuals import bootstrap_draws
from analysis.diagnosis.effect_words import noun_of
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

BOUND = float(stdtrit(FOLDS - 1, 0.975))
"""Half-width of a 95 % confidence interval in standard errors: quantile of Student's t with FOLDS - 1 degrees of
freedom. A parameter within it of its value without a fault may have that value."""
SAME = {
    "transport_delay": ("logger_offset",),
    "logger_offset": ("transport_delay",),
    "force_offset": ("constant_force",),
}  # fmt: skip
"""Faults with the same effect on the signals: the two delays in a recording of one response, and an offset of the
command and a constant force in any recording."""

FINER = "it contains the named fault as a special case, and its error is not significantly smaller"
BEHIND = "another fault explains more of the difference between these recordings"
"""Reasons, in messages, why a rival of the named fault is not named."""


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """The named fault with its class and probability, or None, and the candidates that are not named."""

    named: JudgedFault | None
    alike: tuple[str, ...]
    """Effects that fit as well in its place (class)."""
    probability: float
    """Share of bootstrap draws in which no significant rival has a smaller error; refinements do not count."""
    others: tuple[tuple[JudgedFault, str], ...]
    """Candidates that are not named, each with the reason in words."""


def decide(found: Comparison, responses: int) -> Decision:
    """The fault or class that is named, and the candidates. responses: number of response channels."""
    reasons = [(law, _why_not(law, found.differ_but_for(law))) for law in found.faults]
    sure = [law for law, why in reasons if why == ""]
    others = tuple((law, why) for law, why in reasons if law.gain > 0 and why)
    if not sure:
        return Decision(None, (), 0.0, others)
    best = _choose_plainest(sure, found)
    rivals = [law for law in sure if law is not best]
    told_apart_from = [rival for rival in rivals if not _refines(rival, best)]
    inseparable = [rival for rival in told_apart_from if _is_inseparable(best, rival, found)]
    unsure = [law for law, why in reasons if why and law.gain >= LEAST_FAULT_GAIN and not _refines(law, best)]
    inseparable += [law for law in rivals if _refines(law, best) and _is_sure_to_leave_less(law, best)]
    alike = (
        *inseparable,
        *_unsure_but_as_good(unsure, best, found)[: max(LARGEST_FAULT_CLASS - 1 - len(inseparable), 0)],
    )
    ahead = [
        law for law in unsure if law.gain_low > 0 and _excess_error(law, best) < -_least_distinguished(best, found)
    ]
    same = SAME.get(best.fault.effect, ()) if responses == 1 or best.fault.effect == "force_offset" else ()
    names = tuple(name for name in dict.fromkeys((*(rival.fault.effect for rival in alike), *same))
                  if name != best.fault.effect)  # fmt: skip
    elsewhere = [rival.fault.axis for rival in alike if rival.fault.effect == best.fault.effect]
    why_not = ""
    if ahead:
        why_not = f"{noun_of(ahead[0].fault.effect)} explains more, but is not significant itself"
    elif best.share < FAULT_MAIN_PART:
        why_not = (
            f"it explains {100 * best.share:.0f} % of the difference between these recordings: the main cause is "
            "another"
        )
    elif len(names) >= LARGEST_FAULT_CLASS:
        why_not = "these data cannot distinguish it from " + ", ".join(names)
    elif elsewhere:
        why_not = f"these data do not show whether it is on {best.fault.axis} or on {', '.join(elsewhere)}"
    behind = tuple((rival, FINER if _refines(rival, best) else BEHIND) for rival in rivals)
    if why_not:
        return Decision(None, (), 0.0, ((best, why_not), *behind, *others))
    left = tuple(item for item in (*behind, *others) if item[0] not in alike)
    return Decision(best, names, _probability_of_best(best, told_apart_from), left)


def _unsure_but_as_good(unsure: Sequence[JudgedFault], best: JudgedFault, found: Comparison) -> list[JudgedFault]:
    """Candidates that fail a test of `_why_not` although their gain has a lower bound above 0, and whose error differs
    too little from that of the best, which passes all tests: either may be the cause."""
    return [
        law
        for law in unsure
        if law.fault.effect != best.fault.effect
        and law.gain_low > 0
        and abs(_excess_error(law, best)) <= _least_distinguished(best, found)
    ]


def _refines(other: JudgedFault, best: JudgedFault) -> bool:
    """Whether `other` contains `best` as a special case, so that it always fits better."""
    return best.fault.effect in other.fault.simpler and best.fault.axis == other.fault.axis


def _choose_plainest(sure: Sequence[JudgedFault], found: Comparison) -> JudgedFault:
    """The fault with the smallest error, or a special case of it that these data cannot distinguish from it."""
    best = min(sure, key=lambda each: float(each.errors.sum()))
    for law in sure:
        if _refines(best, law) and _is_inseparable(best, law, found):
            return law
    return best


def _why_not(weighed: JudgedFault, differ: bool) -> str:
    """Reason not to name a fault; empty if it passes all tests. differ: whether the clean and the faulty set differ by
    more than stretches of a single set do. If not, the fault must gain about equally in all blocks, which excludes slow
    changes during a recording."""
    if weighed.gain < LEAST_FAULT_GAIN or weighed.gain_low <= 0:
        return "its gain is not larger than its variation between stretches of the recordings"
    steady = weighed.gain_low >= FAULT_STEADY * weighed.gain and not weighed.fault.varies
    if not differ and not steady:
        return "stretches of one set differ as much as the sets do"
    if weighed.gain <= FAULT_BEYOND * weighed.usual:
        return (
            f"its gain between stretches of one set is {weighed.usual:.2g} already, and {weighed.gain:.2g} between "
            "the two sets"
        )
    main = next(iter(weighed.values))
    if abs(_distance_from_none(weighed, main)) <= BOUND * weighed.spread[main]:
        return "the confidence interval of its parameter includes the value without the fault"
    return ""


def _distance_from_none(weighed: JudgedFault, name: str) -> float:
    """Distance of a parameter from its value without a fault: 1 for a gain, else 0."""
    return weighed.values[name] - (1.0 if name == "gain" else 0.0)


def _is_inseparable(best: JudgedFault, other: JudgedFault, found: Comparison) -> bool:
    """Whether the error of `other` exceeds that of the best too little to distinguish them, or not significantly
    (bootstrap over blocks)."""
    behind = other.errors - best.errors
    drawn = bootstrap_draws(len(behind))
    return bool(
        behind.sum() <= _least_distinguished(best, found)
        or np.quantile(behind[drawn].sum(axis=1), BOOTSTRAP_LEVEL) <= 0
    )


def _is_sure_to_leave_less(finer: JudgedFault, best: JudgedFault) -> bool:
    """Whether a fault that contains the best as a special case has a significantly smaller error (bootstrap over
    blocks)."""
    ahead = best.errors - finer.errors
    return bool(np.quantile(ahead[bootstrap_draws(len(ahead))].sum(axis=1), BOOTSTRAP_LEVEL) > 0)


def _excess_error(other: JudgedFault, best: JudgedFault) -> float:
    """Sum of squares of another fault minus that of the best."""
    return float((other.errors - best.errors).sum())


def _least_distinguished(best: JudgedFault, found: Comparison) -> float:
    """Least difference between a rival's error and that of the best, as sums of squares, at which both are
    distinguished: a share of the reduction by the best, or of its remaining error, the smaller of both."""
    left = float(best.errors.sum())
    return min(FAULT_RIVAL_BEHIND * (float(found.plain.sum()) - left), FAULT_RIVAL_WORSE * left)


def _probability_of_best(best: JudgedFault, rivals: Sequence[JudgedFault]) -> float:
    """Share of bootstrap draws over blocks in which no rival has a smaller error than the best."""
    drawn = bootstrap_draws(len(best.errors))
    first = np.ones(BOOTSTRAP_DRAWS, dtype=np.bool_)
    for other in rivals:
        first &= (other.errors - best.errors)[drawn].sum(axis=1) >= 0
    return float(first.mean())
