"""The order of a search: what was found before further effects is looked for again, and stays a candidate."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

import analysis.diagnosis.search.search as search
from analysis.diagnosis.search.search import _choose_early_or_full
from analysis.diagnosis.search.verdict import Judgement


@dataclass(frozen=True)
class Result:
    unconfirmed: tuple[str, ...]
    judgement: Judgement
    found: SimpleNamespace


def make_result(unconfirmed: tuple[str, ...], ended_early: bool = False) -> Result:
    return Result(unconfirmed, Judgement("unexplained", False), SimpleNamespace(ended_early=ended_early))


@pytest.mark.parametrize(
    "full, candidates",
    [
        (make_result(()), ("early law",)),  # the time ended before laws were tested again: the full search has none
        (make_result(("late law",), ended_early=True), ("early law", "late law")),
        (make_result(("late law",)), ("late law",)),  # the full search tested the laws again
    ],
)
def test_an_unconfirmed_law_is_not_lost(full, candidates):
    assert _choose_early_or_full(make_result(("early law",)), full).unconfirmed == candidates


@pytest.mark.parametrize(
    ("third", "steps"),
    [((), ["exchange ab", "third bc", "prune bc"]), (("d",), ["exchange ab", "third bc", "exchange bcd", "prune ecd"])],
    ids=["two", "three"],
)
def test_the_first_effect_is_looked_for_again_before_a_third_effect_is_added_and_after_it(monkeypatch, third, steps):
    """A third effect may correct a wrong first one in part, and bars the right one if both are of one family."""
    asked = []

    def exchange(context, explanation, *_):
        asked.append("exchange " + "".join(explanation.steps))
        new = ("b", "c") if len(explanation.steps) == 2 else ("e", "c", "d")
        return SimpleNamespace(steps=new)

    def add(context, catalogue, explanation, *_):
        asked.append("third " + "".join(explanation.steps))
        return SimpleNamespace(steps=(*explanation.steps, *third))

    def prune(context, explanation, time_left):
        asked.append("prune " + "".join(explanation.steps))
        raise StopIteration

    monkeypatch.setattr(search, "exchange_first_effects", exchange)
    monkeypatch.setattr(search, "add_effects", add)
    monkeypatch.setattr(search, "_prune_guarded", prune)
    pair = SimpleNamespace(steps=("a", "b"))
    with pytest.raises(StopIteration):
        search._search_third_effect(None, pair, (), print, lambda: True, lambda result: result)
    assert asked == steps
