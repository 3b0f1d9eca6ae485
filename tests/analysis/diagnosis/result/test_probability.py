"""How likely fitted_candidates are, from how far apart they stand."""

from types import SimpleNamespace

import pytest

from analysis.diagnosis.limits import NO_CANDIDATE_LEAST, NO_CANDIDATE_MOST
from analysis.diagnosis.result.named_effects import (
    _average_over_rounds,
    compute_none_probability,
    compute_probabilities,
)


def test_of_no_candidates_none_has_a_probability():
    assert compute_probabilities((), 1.0) == ()


def test_what_stands_alone_is_likely_but_not_certain(make_candidate):
    assert compute_probabilities([make_candidate(1.0, "force_gain")], 1.0) == pytest.approx([1 - NO_CANDIDATE_LEAST])


def test_the_better_one_is_the_likelier_one(make_candidate):
    names = ("force_gain", "added_mass", "coulomb_friction")
    chances = compute_probabilities(
        [make_candidate(*each) for each in zip((1.0, 1.0005, 1.5), names, strict=True)], 1.0
    )
    assert chances[0] > chances[1] > chances[2]
    assert chances[2] < 1e-6
    assert sum(chances) == pytest.approx(1 - NO_CANDIDATE_LEAST)


def test_equals_share(make_candidate):
    one, other = compute_probabilities([make_candidate(2.0, "force_gain"), make_candidate(2.0, "added_mass")], 1.0)
    assert one == pytest.approx(other) == pytest.approx((1 - NO_CANDIDATE_LEAST) / 2)


def test_what_is_preferred_for_its_plainness_is_no_less_likely_than_what_errs_a_little_less(make_candidate):
    first, second = compute_probabilities(
        [make_candidate(1.0004, "force_gain"), make_candidate(1.0, "added_mass")], 1.0
    )
    assert first == pytest.approx(second)


def test_what_only_refines_the_named_law_takes_nothing_from_it(make_candidate):
    rubs, richer = make_candidate(1.0004, "coulomb_friction"), make_candidate(1.0, "stribeck_friction")
    assert compute_probabilities([rubs, richer], 1.0) == pytest.approx([1 - NO_CANDIDATE_LEAST, 0.0])


def test_the_more_an_explanation_leaves_the_less_likely_is_what_it_names(make_candidate):
    chances = [
        compute_probabilities([make_candidate(left, "force_gain")], left)[0] for left in (1.0, 1.05, 1.2, 2.0, 20.0)
    ]
    assert chances == sorted(chances, reverse=True)
    assert chances[1] > 0.9 and chances[-1] < 0.25
    assert NO_CANDIDATE_LEAST == compute_none_probability(0.9) < compute_none_probability(1e6) <= NO_CANDIDATE_MOST


def test_a_small_share_of_a_strong_mismatch_is_no_sign_of_another_effect():
    assert compute_none_probability(2.0, 0.01) < 0.1 < 0.5 < compute_none_probability(2.0, 0.5)
    assert compute_none_probability(2.0, 0.5) == compute_none_probability(2.0)
    assert compute_none_probability(1.02, 0.9) == compute_none_probability(1.02)


def test_two_forces_that_were_added_as_a_pair_have_equal_shares(make_candidate):
    pair, single = (make_candidate(1.0, "force_gain"),), (make_candidate(1.0, "added_mass"),)
    explanation = SimpleNamespace(rounds=(single, pair, tuple(pair), single[:0]))
    assert _average_over_rounds(explanation, (0.4, 0.02, 0.5)) == pytest.approx((0.4, 0.26, 0.26))
    assert _average_over_rounds(SimpleNamespace(rounds=()), ()) == ()
