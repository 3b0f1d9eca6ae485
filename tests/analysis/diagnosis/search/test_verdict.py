"""The table of verdicts, over invented errors."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.search import search
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import compute_mismatch_share
from analysis.diagnosis.search.search_context import FINER_PARTS, HALVES
from analysis.diagnosis.search.verdict import (
    Judgement,
    SearchResult,
    compute_step_shares,
    has_confirmed_addition,
    judge,
)

RUBS = "coulomb_friction"


def make_explanation(before, retuned, after=None):
    return Explanation(before, retuned, retuned if after is None else after, (), ())


def test_a_model_that_fits_as_given_has_no_mismatch(make_candidate):
    judged = judge(make_explanation(make_candidate(1.02), make_candidate(1.01)))
    assert (judged.verdict, judged.named) == ("no_mismatch", False)


def test_a_model_that_fits_once_re_tuned_lacked_parameters_alone(make_candidate):
    judged = judge(make_explanation(make_candidate(9.0), make_candidate(1.02)))
    assert (judged.verdict, judged.named) == ("parameters", False)


@pytest.mark.parametrize(
    ("left", "verdict"),
    [
        (1.02, "explained"),
        (1.11, "explained"),
        (1.25, "partly_explained"),
        (2.9, "partly_explained"),
        (5.0, "unexplained"),
    ],
)
def test_what_is_said_of_an_effect_hangs_on_what_it_leaves(make_candidate, left, verdict):
    judged = judge(make_explanation(make_candidate(30.0), make_candidate(10.0), make_candidate(left, RUBS)))
    assert (judged.verdict, judged.named) == (verdict, verdict != "unexplained")


def test_an_effect_that_takes_the_bulk_of_a_great_mismatch_is_named_beside_a_remainder(make_candidate):
    judged = judge(make_explanation(make_candidate(900.0), make_candidate(900.0), make_candidate(90.0, RUBS)))
    assert (judged.verdict, judged.named) == ("partly_explained", True)


def test_the_worst_channel_counts(make_candidate):
    before, retuned = make_candidate((30.0, 30.0)), make_candidate((10.0, 10.0))
    assert judge(make_explanation(before, retuned, make_candidate((1.0, 1.1), RUBS))).verdict == "explained"
    assert judge(make_explanation(before, retuned, make_candidate((1.0, 1.5), RUBS))).verdict == "partly_explained"


def test_a_law_that_is_not_quite_exact_explains_a_great_mismatch(make_candidate):
    assert (
        judge(make_explanation(make_candidate(60.0), make_candidate(60.0), make_candidate(1.25, RUBS))).verdict
        == "explained"
    )
    assert (
        judge(make_explanation(make_candidate(60.0), make_candidate(60.0), make_candidate(1.35, RUBS))).verdict
        == "partly_explained"
    )


@pytest.mark.parametrize(("sealed", "verdict"), [(1.4, "explained"), (1.7, "partly_explained")])
def test_what_was_never_looked_at_must_be_explained_too(make_candidate, sealed, verdict):
    judged = judge(
        make_explanation(make_candidate(30.0), make_candidate(10.0), make_candidate(1.02, RUBS, test=sealed))
    )
    assert (judged.verdict, judged.named) == (verdict, True)


def test_where_nothing_was_found_a_mismatch_stays_unexplained(make_candidate):
    assert judge(make_explanation(make_candidate(30.0), make_candidate(10.0))).verdict == "unexplained"


def test_sealed_samples_take_a_name_away_that_they_do_not_confirm(make_candidate):
    retuned, after = make_candidate(10.0), make_candidate(1.02, RUBS, test=9.5)
    assert judge(make_explanation(make_candidate(30.0), retuned, after)).verdict == "unexplained"


def test_sealed_samples_that_hardly_show_the_mismatch_take_nothing_away(make_candidate):
    retuned, after = make_candidate(10.0, test=1.02), make_candidate(1.02, RUBS, test=1.03)
    assert judge(make_explanation(make_candidate(30.0), retuned, after)).verdict == "explained"


def test_where_nothing_was_sealed_nothing_is_taken_away(make_candidate):
    retuned, after = make_candidate(10.0, test=np.nan), make_candidate(1.02, RUBS, test=np.nan)
    assert judge(make_explanation(make_candidate(30.0), retuned, after)).verdict == "explained"


def test_sealed_samples_never_give_a_name(make_candidate):
    judged = judge(make_explanation(make_candidate(30.0), make_candidate(10.0), make_candidate(9.9, RUBS, test=1.0)))
    assert judged.verdict == "unexplained"


def test_the_share_is_that_of_the_logarithm_and_stays_between_nothing_and_all(make_candidate):
    assert compute_mismatch_share(make_candidate(100.0), make_candidate(10.0)) == pytest.approx(0.5, abs=0.01)
    assert compute_mismatch_share(make_candidate(10.0), make_candidate(20.0)) == 0.0
    assert compute_mismatch_share(make_candidate(10.0), make_candidate(0.9)) == 1.0
    assert compute_mismatch_share(make_candidate(1.0), make_candidate(0.9)) == 0.0


def test_what_two_effects_take_adds_up_to_what_both_take(make_candidate):
    bare, steps = make_candidate(30.0), (make_candidate(10.0, RUBS), make_candidate(1.05, RUBS, "sensor_lag"))
    shares = compute_step_shares(bare, steps)
    assert 0 < shares[0] < shares[1]
    assert sum(shares) == pytest.approx(compute_mismatch_share(bare, steps[1]))


@pytest.mark.parametrize(
    ("without", "with_it", "confirmed"),
    [
        ([1.0, 5.0], [1.0, 1.1], True),
        ([1.0, 5.0], [1.0, 4.0], False),
        ([1.0, 1.0, 1.0, 1.0, 1.0, 1.3], [1.0, 1.0, 1.0, 1.0, 1.0, 2.0], False),
        ([1.0, 1.2], [1.0, 1.0], False),
        ([1.0, np.inf], [1.0, 1.0], False),
        ([1.0, np.nan], [1.0, 1.0], False),
    ],
    ids=["taken", "hardly taken", "worse in one of six", "nothing to take", "ran away", "nothing held out"],
)
def test_an_effect_is_added_to_a_name_where_the_worst_held_out_channel_says_so(
    make_candidate, without, with_it, confirmed
):
    left = [make_candidate(1.0, RUBS, test=test) for test in (without, with_it)]
    assert has_confirmed_addition(*left) is confirmed


ALTERNATE_PARTS = FINER_PARTS[-1]


@pytest.mark.parametrize("is_named", [True, False])
@pytest.mark.parametrize(
    ("without", "with_it", "parts", "confirmed"),
    [
        ([1.3, 7.8], [1.0, 1.1], ALTERNATE_PARTS, True),
        ([1.3, 7.8], [1.0, 1.14], ALTERNATE_PARTS, True),
        ([1.0, 1.6], [1.0, 1.14], ALTERNATE_PARTS, False),
        ([1.3, 1000.0], [1.0, 1.31], ALTERNATE_PARTS, False),
        ([1.0, 1.6], [1.0, 1.14], HALVES, True),
    ],
    ids=["noise left", "nearly all taken", "a part taken", "taken from much", "halves"],
)
def test_between_fitted_parts_an_effect_must_leave_noise_or_take_nearly_all_that_is_missing(
    make_candidate, monkeypatch, without, with_it, parts, confirmed, is_named
):
    alone, both = make_candidate(1.0, RUBS, test=without), make_candidate(1.0, RUBS, "end_stop", test=with_it)
    context = SimpleNamespace(measure=None, tuning=None, score_fit=lambda fit: fit, with_test_score=lambda fit: alone)
    monkeypatch.setattr(search, "evaluate_fit", lambda *given: None)
    monkeypatch.setattr(search, "refine", lambda *given: None)
    earlier = SearchResult(
        context, SimpleNamespace(after=alone, retuned=alone), Judgement("partly_explained", is_named)
    )
    found = SimpleNamespace(after=both, retuned=alone)
    repeated = SearchResult(context, found, Judgement("explained", True))
    assert search._adds_confirmed(earlier, repeated, parts) is confirmed
