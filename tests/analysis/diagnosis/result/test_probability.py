"""How likely fitted_candidates are, from how far apart they stand."""

import pytest

from analysis.diagnosis.result.named_effects import probabilities, probability_of_none
from analysis.diagnosis.settings import ELSEWHERE_LEAST, ELSEWHERE_MOST


def test_of_no_candidates_none_has_a_probability():
    assert probabilities((), 1.0) == ()


def test_what_stands_alone_is_likely_but_not_certain(standing_at):
    assert probabilities([standing_at(1.0, "force_gain")], 1.0) == pytest.approx([1 - ELSEWHERE_LEAST])


def test_the_better_one_is_the_likelier_one(standing_at):
    names = ("force_gain", "added_mass", "coulomb_friction")
    chances = probabilities([standing_at(*each) for each in zip((1.0, 1.0005, 1.5), names, strict=True)], 1.0)
    assert chances[0] > chances[1] > chances[2]
    assert chances[2] < 1e-6
    assert sum(chances) == pytest.approx(1 - ELSEWHERE_LEAST)


def test_equals_share(standing_at):
    one, other = probabilities([standing_at(2.0, "force_gain"), standing_at(2.0, "added_mass")], 1.0)
    assert one == pytest.approx(other) == pytest.approx((1 - ELSEWHERE_LEAST) / 2)


def test_what_is_preferred_for_its_plainness_is_no_less_likely_than_what_errs_a_little_less(standing_at):
    first, second = probabilities([standing_at(1.0004, "force_gain"), standing_at(1.0, "added_mass")], 1.0)
    assert first == pytest.approx(second)


def test_what_only_refines_the_named_law_takes_nothing_from_it(standing_at):
    rubs, richer = standing_at(1.0004, "coulomb_friction"), standing_at(1.0, "stribeck_friction")
    assert probabilities([rubs, richer], 1.0) == pytest.approx([1 - ELSEWHERE_LEAST, 0.0])


def test_the_more_an_explanation_leaves_the_less_likely_is_what_it_names(standing_at):
    chances = [probabilities([standing_at(left, "force_gain")], left)[0] for left in (1.0, 1.05, 1.2, 2.0, 20.0)]
    assert chances == sorted(chances, reverse=True)
    assert chances[1] > 0.9 and chances[-1] < 0.25
    assert ELSEWHERE_LEAST == probability_of_none(0.9) < probability_of_none(1e6) <= ELSEWHERE_MOST
