"""How likely contenders are, from how far apart they stand."""

import pytest

from analysis.diagnosis.probability import ELSEWHERE, probabilities


def test_what_stands_alone_is_likely_but_not_certain(standing_at):
    assert probabilities([standing_at(1.0)]) == pytest.approx([1 - ELSEWHERE])


def test_the_better_one_is_the_likelier_one(standing_at):
    chances = probabilities([standing_at(1.0), standing_at(1.0005), standing_at(1.5)])
    assert chances[0] > chances[1] > chances[2]
    assert chances[2] < 1e-6
    assert sum(chances) == pytest.approx(1 - ELSEWHERE)


def test_equals_share(standing_at):
    one, other = probabilities([standing_at(2.0), standing_at(2.0)])
    assert one == pytest.approx(other) == pytest.approx((1 - ELSEWHERE) / 2)


def test_what_is_chosen_by_plainness_is_not_likelier_for_standing_first(standing_at):
    first, second = probabilities([standing_at(1.001), standing_at(1.0)])
    assert first < second
