"""Score of a blind test: from the outcomes of a bank of cases, rates and medians with their 95 % intervals.

Detection and naming of single effects and of pairs, false alarms on devices without a missing effect, behaviour where
the true effect is outside the catalogue (open set), and error and interval coverage of the parameters. Cases count only
where the mismatch is detectable (`outcome.DETECTABLE`), except where a figure says otherwise. Intervals:
`confidence_intervals`.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import NamedEffect
from analysis.evaluation.blind_test.calibration import Calibration, calibration
from analysis.evaluation.blind_test.confidence_intervals import Figure, pool_share, share, statistic
from analysis.evaluation.blind_test.follow_up import FollowUp, follow_up_figures
from analysis.evaluation.blind_test.outcome import Concealed, Outcome
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME

TURN = 2 * math.pi
"""A full turn (rad): phases that differ by whole turns are equal."""


def nearest_true_value(name: str, estimate: float, values: Mapping[str, float]) -> float:
    """True value of a parameter, for comparison with its estimate: of equivalent values (a phase modulo a full turn,
    the position of either of two equal end stops), that nearest to the estimate. values: all true parameters of the
    effect.
    """
    true = values[name]
    if name == "phase":
        return true + TURN * round((estimate - true) / TURN)
    if name == "position" and values.get("opposite") == 1.0:
        return math.copysign(true, estimate)
    return true


NOT_EXPLAINED = ("unexplained", "partly_explained")
"""Verdicts that admit a mismatch without an explanation: right where the true effect is outside the catalogue."""


def is_miss(outcome: Outcome) -> bool:
    """Whether an answer is wrong. A failed diagnosis and a wrong name always count, even where nothing was detectable.
    For a detectable effect, so do a missing name, a wrong axis and, outside the catalogue, a verdict that claims to
    explain it. Where the true effect was excluded from the catalogue, any name is wrong."""
    if outcome.diagnosis is None or has_wrong_name(outcome):
        return True
    if outcome.kind in ("nothing", "without") or not outcome.detectable:
        return False
    if outcome.kind == "outside":
        return outcome.verdict not in NOT_EXPLAINED
    return not outcome.right or is_on_other_axis(outcome)


def has_wrong_name(outcome: Outcome) -> bool:
    """Whether an effect is named that is not concealed in the case, or any effect where the true effect was excluded
    from the catalogue."""
    there = () if outcome.kind in ("nothing", "without") else outcome.names
    return not set(outcome.named_names) <= set(there)


def is_on_other_axis(outcome: Outcome) -> bool:
    """Whether a concealed effect is named at another axis than its own, on a device with several axes."""
    if len(outcome.axes) < 2:
        return False
    true = {each.effect: each.axis for each in outcome.concealed}
    return any(
        true.get(each.effect) is not None and each.axis is not None and each.axis != true[each.effect]
        for each in outcome.named
    )


BANKS = ("main", "dirty", "engine")
"""Banks of cases; see `outcome.Outcome.bank`."""


@dataclass(frozen=True, slots=True)
class Score:
    """Figures of a bank with their intervals, the calibration of its stated probabilities, and its misses."""

    figures: tuple[Figure, ...]
    calibration: Calibration
    misses: tuple[Outcome, ...]
    """Outcomes with a wrong answer (`is_miss`); a missing name for an undetectable effect is not wrong."""


def score(outcomes: Sequence[Outcome], followed: Sequence[FollowUp] = ()) -> Score:
    """Score of a bank's outcomes. followed: ambiguous answers that were diagnosed again with a further recording."""
    figures = (
        *_single_figures(outcomes), *_null_figures(outcomes), *_open_set_figures(outcomes), *_pair_figures(outcomes),
        *follow_up_figures(followed), *_number_figures(outcomes),
    )  # fmt: skip
    return Score(figures, calibration(outcomes), tuple(outcome for outcome in outcomes if is_miss(outcome)))


def _select_kind(outcomes: Sequence[Outcome], kind: str, bank: str = "") -> list[Outcome]:
    """Outcomes of cases of this kind; bank: of that bank only, unless empty."""
    return [outcome for outcome in outcomes if outcome.kind == kind and (not bank or outcome.bank == bank)]


def _select_detectable(outcomes: Sequence[Outcome]) -> list[Outcome]:
    return [outcome for outcome in outcomes if outcome.detectable]


def _single_figures(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    """Figures on cases with a single concealed effect: its name, place and axis, and the returned set of names."""
    words = {"main": "", "dirty": ", dirty bank", "engine": ", second engine"}
    for bank in BANKS:
        seen = _select_detectable(_select_kind(outcomes, "single", bank))
        yield share(f"named right{words[bank]}", seen, lambda each: each.right)
    whole = _select_detectable(_select_kind(outcomes, "single"))
    yield share("named first, all banks", whole, lambda each: each.named_names[:1] == each.names)
    yield share("in the returned set", whole, lambda each: each.names[0] in each.returned)
    named = [each for each in whole if each.named]
    yield statistic("names in the returned set, mean", [float(len(each.returned)) for each in named], np.mean)
    alone = [each for each in whole if len(each.returned) == 1]
    yield share("right where one name is returned", alone, lambda each: each.right)
    yield share("place", named, lambda each: each.named[0].place == each.concealed[0].place)
    sided = [each for each in named if each.right and each.concealed[0].axis is not None and len(each.axes) > 1]
    yield share("axis, of two or three", sided, lambda each: not is_on_other_axis(each))
    singles = _select_kind(outcomes, "single")
    seen = [single for single in singles if single.seen_by_ideal_observer]
    yield share("single effects that count as detectable", singles, lambda each: each.detectable)
    yield share("named right, of those that an oracle sees", seen, lambda each: each.right)
    hidden = [outcome for outcome in outcomes if outcome.kind != "nothing" and not outcome.detectable]
    yield share("not detectable, yet a wrong name", hidden, has_wrong_name)


def _null_figures(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    """False alarms on cases without a concealed effect."""
    yield share("nothing missing, yet named", _select_kind(outcomes, "nothing"), lambda each: bool(each.named))
    clean = _select_kind(outcomes, "nothing")
    yield share("nothing missing, and said so", clean, lambda each: each.verdict in ("no_mismatch", "parameters"))


def _open_set_figures(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    """Figures on cases whose true effect is outside the catalogue, or was excluded from it."""
    outside = _select_detectable(_select_kind(outcomes, "outside"))
    yield share("outside the catalogue, not explained", outside, lambda each: each.verdict in NOT_EXPLAINED)
    yield share("outside the catalogue, no name at all", outside, lambda each: not each.named)
    without = _select_detectable(_select_kind(outcomes, "without"))
    yield share("without the true effect, any name", without, lambda each: bool(each.named))
    yield share("without the true effect, yet explained", without, lambda each: each.verdict == "explained")


def _pair_figures(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    """Figures on cases with two concealed effects."""
    pairs = _select_detectable(_select_kind(outcomes, "pair"))
    yield share("pairs, both and no other", pairs, lambda each: each.right)
    yield share("pairs, at least one", pairs, lambda each: bool(set(each.names) & set(each.named_names)))


def _number_figures(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    """Parameter errors and interval coverage of single effects named right, the remaining error, and run times."""
    right = [each for each in _select_detectable(_select_kind(outcomes, "single")) if each.right]
    errors = [main_error(each.concealed[0], each.named[0]) for each in right]
    yield statistic("main parameter's error, median", [e for e in errors if e is not None], np.median)
    covered = [list(interval_coverage(each.concealed[0], each.named[0]).values()) for each in right]
    yield pool_share("true value in the 95 % interval", covered)
    mains = [
        each
        for each in right
        if EFFECTS_BY_NAME[each.names[0]].main.name in interval_coverage(each.concealed[0], each.named[0])
    ]
    yield share("the same, main parameters", mains, lambda each: is_main_covered(each.concealed[0], each.named[0]))
    after = [each.left("after") for each in right]
    yield statistic("held-out error over noise, worst channel, median", after, np.median)
    yield statistic("seconds per diagnosis, median", [outcome.seconds for outcome in outcomes], np.median)


def main_error(true: Concealed, named: NamedEffect) -> float | None:
    """Relative error of the estimate of an effect's main parameter; None where its true value is unknown or 0."""
    name = EFFECTS_BY_NAME[true.effect].main.name
    if not true.values.get(name):
        return None
    estimate = named.parameters[name].value
    value = nearest_true_value(name, estimate, true.values)
    return abs(estimate - value) / abs(value)


def interval_coverage(true: Concealed, named: NamedEffect) -> dict[str, bool]:
    """By parameter, whether its 95 % interval contains the true value; only parameters that have both."""
    found = {}
    for name, estimate in named.parameters.items():
        if estimate.ci95 is not None and name in true.values:
            value = nearest_true_value(name, estimate.value, true.values)
            found[name] = estimate.ci95[0] <= value <= estimate.ci95[1]
    return found


def is_main_covered(true: Concealed, named: NamedEffect) -> bool:
    """Whether the 95 % interval of the effect's main parameter contains the true value. Raises KeyError where the
    interval or the true value is missing."""
    return interval_coverage(true, named)[EFFECTS_BY_NAME[true.effect].main.name]
