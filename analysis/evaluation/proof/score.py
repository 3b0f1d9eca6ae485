"""What a bank's outcomes amount to, one figure with its interval each."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import NamedEffect
from analysis.evaluation.proof.calibration import Calibration, calibration
from analysis.evaluation.proof.follow_up import FollowUp, follow_up_figures
from analysis.evaluation.proof.outcome import Concealed, Outcome
from analysis.evaluation.proof.share import Figure, pooled, share, statistic
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME

TURN = 2 * math.pi


def as_said(name: str, said: float, values: Mapping[str, float]) -> float:
    """The true value of a number in the way the diagnosis says it. values: all true ones of the effect.

    Where an effect acts the same with another value, that one is taken which lies nearest to what was said.
    """
    true = values[name]
    if name == "phase":
        return true + TURN * round((said - true) / TURN)
    if name == "position" and values.get("opposite") == 1.0:
        return math.copysign(true, said)
    return true


NOT_EXPLAINED = ("unexplained", "partly_explained")


def is_miss(outcome: Outcome) -> bool:
    """A wrong name is one even where nothing could be seen; where the true effect is not to be named, any name is."""
    if outcome.said is None or has_wrong_name(outcome):
        return True
    if outcome.kind in ("nothing", "without") or not outcome.detectable:
        return False
    if outcome.kind == "outside":
        return outcome.verdict not in NOT_EXPLAINED
    return not outcome.right or on_another_axis(outcome)


def has_wrong_name(outcome: Outcome) -> bool:
    """An effect is named that is not there, or that was not to be considered."""
    there = () if outcome.kind in ("nothing", "without") else outcome.names
    return not set(outcome.named_names) <= set(there)


def on_another_axis(outcome: Outcome) -> bool:
    """A right name, but at an axis where nothing is concealed; of devices with several."""
    if len(outcome.axes) < 2:
        return False
    true = {each.effect: each.axis for each in outcome.concealed}
    return any(
        true.get(said.effect) is not None and said.axis is not None and said.axis != true[said.effect]
        for said in outcome.named
    )


BANKS = ("main", "dirty", "engine")


@dataclass(frozen=True, slots=True)
class Score:
    figures: tuple[Figure, ...]
    calibration: Calibration
    misses: tuple[Outcome, ...]
    """Everything that is not as it should be; what cannot be detected is none."""


def score(outcomes: Sequence[Outcome], followed: Sequence[FollowUp] = ()) -> Score:
    figures = (
        *_singles(outcomes), *_nothing(outcomes), *_open_set(outcomes), *_pairs(outcomes),
        *follow_up_figures(followed), *_numbers(outcomes),
    )  # fmt: skip
    return Score(figures, calibration(outcomes), tuple(outcome for outcome in outcomes if is_miss(outcome)))


def _of(outcomes: Sequence[Outcome], kind: str, bank: str = "") -> list[Outcome]:
    return [outcome for outcome in outcomes if outcome.kind == kind and (not bank or outcome.bank == bank)]


def _detectable(outcomes: Sequence[Outcome]) -> list[Outcome]:
    return [outcome for outcome in outcomes if outcome.detectable]


def _singles(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    words = {"main": "", "dirty": ", dirty bank", "engine": ", second engine"}
    for bank in BANKS:
        seen = _detectable(_of(outcomes, "single", bank))
        yield share(f"named right{words[bank]}", seen, lambda each: each.right)
    whole = _detectable(_of(outcomes, "single"))
    yield share("named first, all banks", whole, lambda each: each.named_names[:1] == each.names)
    yield share("in the returned set", whole, lambda each: each.names[0] in each.returned)
    named = [each for each in whole if each.named]
    yield statistic("names in the returned set, mean", [float(len(each.returned)) for each in named], np.mean)
    alone = [each for each in whole if len(each.returned) == 1]
    yield share("right where one name is returned", alone, lambda each: each.right)
    yield share("place", named, lambda each: each.named[0].place == each.concealed[0].place)
    sided = [each for each in named if each.right and each.concealed[0].axis is not None and len(each.axes) > 1]
    yield share("axis, of two or three", sided, lambda each: not on_another_axis(each))
    singles = _of(outcomes, "single")
    seen = [single for single in singles if single.seen_by_oracle]
    yield share("single effects that count as detectable", singles, lambda each: each.detectable)
    yield share("named right, of those that an oracle sees", seen, lambda each: each.right)
    hidden = [outcome for outcome in outcomes if outcome.kind != "nothing" and not outcome.detectable]
    yield share("not detectable, yet a wrong name", hidden, has_wrong_name)


def _nothing(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    yield share("nothing missing, yet named", _of(outcomes, "nothing"), lambda each: bool(each.named))
    clean = _of(outcomes, "nothing")
    yield share("nothing missing, and said so", clean, lambda each: each.verdict in ("no_mismatch", "parameters"))


def _open_set(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    outside = _detectable(_of(outcomes, "outside"))
    yield share("outside the catalogue, not explained", outside, lambda each: each.verdict in NOT_EXPLAINED)
    yield share("outside the catalogue, no name at all", outside, lambda each: not each.named)
    without = _detectable(_of(outcomes, "without"))
    yield share("without the true effect, any name", without, lambda each: bool(each.named))
    yield share("without the true effect, yet explained", without, lambda each: each.verdict == "explained")


def _pairs(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    pairs = _detectable(_of(outcomes, "pair"))
    yield share("pairs, both and no other", pairs, lambda each: each.right)
    yield share("pairs, at least one", pairs, lambda each: bool(set(each.names) & set(each.named_names)))


def _numbers(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    right = [each for each in _detectable(_of(outcomes, "single")) if each.right]
    errors = [main_error(each.concealed[0], each.named[0]) for each in right]
    yield statistic("main parameter's error, median", [e for e in errors if e is not None], np.median)
    covered = [list(within(each.concealed[0], each.named[0]).values()) for each in right]
    yield pooled("true value in the 95 % interval", covered)
    mains = [
        each for each in right if EFFECTS_BY_NAME[each.names[0]].main.name in within(each.concealed[0], each.named[0])
    ]
    yield share("the same, main parameters", mains, lambda each: main_within(each.concealed[0], each.named[0]))
    after = [each.left("after") for each in right]
    yield statistic("held-out error over noise, worst channel, median", after, np.median)
    yield statistic("seconds per diagnosis, median", [outcome.seconds for outcome in outcomes], np.median)


def main_error(true: Concealed, said: NamedEffect) -> float | None:
    """Relative; None where the label holds no such number."""
    name = EFFECTS_BY_NAME[true.effect].main.name
    if not true.values.get(name):
        return None
    estimate = said.parameters[name].value
    value = as_said(name, estimate, true.values)
    return abs(estimate - value) / abs(value)


def within(true: Concealed, said: NamedEffect) -> dict[str, bool]:
    """Whether the interval holds the true value, of every parameter that has both."""
    found = {}
    for name, estimate in said.parameters.items():
        if estimate.ci95 is not None and name in true.values:
            value = as_said(name, estimate.value, true.values)
            found[name] = estimate.ci95[0] <= value <= estimate.ci95[1]
    return found


def main_within(true: Concealed, said: NamedEffect) -> bool:
    return within(true, said)[EFFECTS_BY_NAME[true.effect].main.name]
