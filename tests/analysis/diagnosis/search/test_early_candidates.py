"""Laws that a search could not confirm before it looked for further effects stay candidates of the answer."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

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
