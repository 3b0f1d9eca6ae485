"""Score of a blind test: rates and medians over the outcomes of a bank of cases, with 95 % confidence intervals.

Detection and naming of single effects and of pairs, false alarms on devices without a missing effect, behaviour where
the true effect is outside the catalogue (open set), and error and interval coverage of the parameters. Cases count only
where the mismatch is detectable (`outcome.DETECTABLE_ERROR`), except in false alarms and run times, and where a figure
states otherwise. Intervals: `confidence_intervals`.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import NamedEffect
from analysis.evaluation.blind_test.calibration import Calibration, compute_calibration
from analysis.evaluation.blind_test.confidence_intervals import (
    IntervalEstimate,
    compute_share,
    compute_statistic,
    pool_share,
)
from analysis.evaluation.blind_test.follow_up import FollowUp, compute_follow_up_figures
from analysis.evaluation.blind_test.outcome import ConcealedEffect, Outcome
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME

FULL_TURN_RAD = 2 * math.pi
"""A full turn (rad); phases that differ by whole turns are equal."""


def find_nearest_true_value(name: str, estimate: float, values: Mapping[str, float]) -> float:
    """Find the true value of a parameter for comparison with its estimate: of equivalent values (a phase modulo a full
    turn, the position of either of two equal end stops), that nearest to the estimate. values: all true parameters of
    the effect. Raises KeyError where they lack `name`.
    """
    true_value = values[name]
    if name == "phase":
        return true_value + FULL_TURN_RAD * round((estimate - true_value) / FULL_TURN_RAD)
    if name == "position" and values.get("opposite") == 1.0:
        return math.copysign(true_value, estimate)
    return true_value


ADMITTING_VERDICTS = ("unexplained", "partly_explained")
"""Verdicts that state an unexplained mismatch: right where the true effect is outside the catalogue."""


def is_wrong_answer(outcome: Outcome) -> bool:
    """Whether an answer is wrong. A failed diagnosis and a wrong name always count, even where nothing was detectable.
    For a detectable effect of the catalogue, so do a missing name and a wrong axis; outside the catalogue, a verdict
    other than `ADMITTING_VERDICTS`. Where the true effect was excluded from the catalogue, any name is wrong."""
    if outcome.diagnosis is None or has_wrong_name(outcome):
        return True
    if outcome.kind in ("nothing", "without") or not outcome.detectable:
        return False
    if outcome.kind == "outside":
        return outcome.verdict not in ADMITTING_VERDICTS
    return not outcome.is_correct or is_on_other_axis(outcome)


def has_wrong_name(outcome: Outcome) -> bool:
    """Whether an effect is named that is not concealed in the case, or any effect where the true effect was excluded
    from the catalogue."""
    allowed_names = () if outcome.kind in ("nothing", "without") else outcome.names
    return not set(outcome.named_effect_names) <= set(allowed_names)


def is_on_other_axis(outcome: Outcome) -> bool:
    """Whether a concealed effect is named at another axis than its true one, on a device with several axes; effects
    without an axis are not compared."""
    if len(outcome.axes) < 2:
        return False
    true_axes = {effect.effect: effect.axis for effect in outcome.concealed}
    return any(
        true_axes.get(effect.effect) is not None and effect.axis is not None and effect.axis != true_axes[effect.effect]
        for effect in outcome.named
    )


BANKS = ("main", "dirty", "engine")
"""Banks of cases (`Outcome.bank`), in the order of the figures."""


@dataclass(frozen=True, slots=True)
class Score:
    """Figures of a bank with their intervals, the calibration of its stated probabilities, and its misses."""

    figures: tuple[IntervalEstimate, ...]
    calibration: Calibration
    misses: tuple[Outcome, ...]
    """Outcomes with a wrong answer (`is_wrong_answer`)."""


def compute_score(outcomes: Sequence[Outcome], follow_ups: Sequence[FollowUp] = ()) -> Score:
    """Compute the score of a bank's outcomes. follow_ups: ambiguous answers that were diagnosed again with a further
    recording."""
    figures = (
        *_compute_single_figures(outcomes), *_compute_null_figures(outcomes), *_compute_open_set_figures(outcomes),
        *_compute_pair_figures(outcomes), *compute_follow_up_figures(follow_ups), *_compute_estimate_figures(outcomes),
    )  # fmt: skip
    return Score(
        figures, compute_calibration(outcomes), tuple(outcome for outcome in outcomes if is_wrong_answer(outcome))
    )


def _select_kind(outcomes: Sequence[Outcome], kind: str, bank: str = "") -> list[Outcome]:
    """Select outcomes of cases of this kind; bank: of that bank only, unless empty."""
    return [outcome for outcome in outcomes if outcome.kind == kind and (not bank or outcome.bank == bank)]


def _select_detectable(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Select outcomes of cases whose mismatch is detectable, with failed diagnoses."""
    return [outcome for outcome in outcomes if outcome.detectable]


def _compute_single_figures(outcomes: Sequence[Outcome]) -> Iterator[IntervalEstimate]:
    """Compute rates on cases with a single concealed effect: its name, place and axis, and the returned set of
    names; at last the rate of wrong names on undetectable cases of every kind but "nothing"."""
    bank_suffixes = {"main": "", "dirty": ", dirty bank", "engine": ", second engine"}
    for bank in BANKS:
        detectable = _select_detectable(_select_kind(outcomes, "single", bank))
        yield compute_share(f"named right{bank_suffixes[bank]}", detectable, lambda case: case.is_correct)
    detectable_singles = _select_detectable(_select_kind(outcomes, "single"))
    yield compute_share(
        "named first, all banks", detectable_singles, lambda case: case.named_effect_names[:1] == case.names
    )
    yield compute_share("in the returned set", detectable_singles, lambda case: case.names[0] in case.returned)
    named_cases = [case for case in detectable_singles if case.named]
    yield compute_statistic(
        "names in the returned set, mean", [float(len(case.returned)) for case in named_cases], np.mean
    )
    unambiguous = [case for case in detectable_singles if len(case.returned) == 1]
    yield compute_share("right where one name is returned", unambiguous, lambda case: case.is_correct)
    yield compute_share("place", named_cases, lambda case: case.named[0].place == case.concealed[0].place)
    right_on_axes = [
        case for case in named_cases if case.is_correct and case.concealed[0].axis is not None and len(case.axes) > 1
    ]
    yield compute_share("axis, of two or three", right_on_axes, lambda case: not is_on_other_axis(case))
    singles = _select_kind(outcomes, "single")
    observer_detected = [single for single in singles if single.is_seen_by_ideal_observer]
    yield compute_share("single effects that count as detectable", singles, lambda case: case.detectable)
    yield compute_share("named right, of those that an oracle sees", observer_detected, lambda case: case.is_correct)
    undetectable = [outcome for outcome in outcomes if outcome.kind != "nothing" and not outcome.detectable]
    yield compute_share("not detectable, yet a wrong name", undetectable, has_wrong_name)


def _compute_null_figures(outcomes: Sequence[Outcome]) -> Iterator[IntervalEstimate]:
    """Compute the false-alarm rates on cases without a concealed effect."""
    yield compute_share("nothing missing, yet named", _select_kind(outcomes, "nothing"), lambda case: bool(case.named))
    nothing_missing = _select_kind(outcomes, "nothing")
    yield compute_share(
        "nothing missing, and said so", nothing_missing, lambda case: case.verdict in ("no_mismatch", "parameters")
    )


def _compute_open_set_figures(outcomes: Sequence[Outcome]) -> Iterator[IntervalEstimate]:
    """Compute rates on cases whose true effect is outside the catalogue, or was excluded from it."""
    outside = _select_detectable(_select_kind(outcomes, "outside"))
    yield compute_share(
        "outside the catalogue, not explained", outside, lambda case: case.verdict in ADMITTING_VERDICTS
    )
    yield compute_share("outside the catalogue, no name at all", outside, lambda case: not case.named)
    excluded = _select_detectable(_select_kind(outcomes, "without"))
    yield compute_share("without the true effect, any name", excluded, lambda case: bool(case.named))
    yield compute_share("without the true effect, yet explained", excluded, lambda case: case.verdict == "explained")


def _compute_pair_figures(outcomes: Sequence[Outcome]) -> Iterator[IntervalEstimate]:
    """Compute rates on cases with two concealed effects."""
    pairs = _select_detectable(_select_kind(outcomes, "pair"))
    yield compute_share("pairs, both and no other", pairs, lambda case: case.is_correct)
    yield compute_share("pairs, at least one", pairs, lambda case: bool(set(case.names) & set(case.named_effect_names)))


def _compute_estimate_figures(outcomes: Sequence[Outcome]) -> Iterator[IntervalEstimate]:
    """Compute parameter errors and interval coverage of single effects named right, their held-out error after the
    diagnosis, and the run time of all cases."""
    right_cases = [case for case in _select_detectable(_select_kind(outcomes, "single")) if case.is_correct]
    errors = [compute_main_error(case.concealed[0], case.named[0]) for case in right_cases]
    yield compute_statistic(
        "main parameter's error, median", [error for error in errors if error is not None], np.median
    )
    coverage_by_case = [
        list(compute_interval_coverage(case.concealed[0], case.named[0]).values()) for case in right_cases
    ]
    yield pool_share("true value in the 95 % interval", coverage_by_case)
    cases_with_main_interval = [
        case
        for case in right_cases
        if EFFECTS_BY_NAME[case.names[0]].main.name in compute_interval_coverage(case.concealed[0], case.named[0])
    ]
    yield compute_share(
        "the same, main parameters",
        cases_with_main_interval,
        lambda case: is_main_covered(case.concealed[0], case.named[0]),
    )
    final_errors = [case.compute_worst_error("after") for case in right_cases]
    yield compute_statistic("held-out error over noise, worst channel, median", final_errors, np.median)
    yield compute_statistic("seconds per diagnosis, median", [outcome.seconds for outcome in outcomes], np.median)


def compute_main_error(concealed: ConcealedEffect, named_effect: NamedEffect) -> float | None:
    """Compute the relative error of the estimate of an effect's main parameter; None where its true value is unknown or
    0. Raises KeyError where the named effect has no such parameter."""
    name = EFFECTS_BY_NAME[concealed.effect].main.name
    if not concealed.values.get(name):
        return None
    estimate = named_effect.parameters[name].value
    true_value = find_nearest_true_value(name, estimate, concealed.values)
    return abs(estimate - true_value) / abs(true_value)


def compute_interval_coverage(concealed: ConcealedEffect, named_effect: NamedEffect) -> dict[str, bool]:
    """Determine for each parameter whether its 95 % interval, ends included, contains the true value; only parameters
    that have both."""
    coverage = {}
    for name, estimate in named_effect.parameters.items():
        if estimate.ci95 is not None and name in concealed.values:
            true_value = find_nearest_true_value(name, estimate.value, concealed.values)
            coverage[name] = estimate.ci95[0] <= true_value <= estimate.ci95[1]
    return coverage


def is_main_covered(concealed: ConcealedEffect, named_effect: NamedEffect) -> bool:
    """Whether the 95 % interval of the effect's main parameter contains the true value. Raises KeyError where the
    interval or the true value is missing."""
    return compute_interval_coverage(concealed, named_effect)[EFFECTS_BY_NAME[concealed.effect].main.name]
