"""Of what a search found, only what is needed stays."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.limits import LAST_EFFECT_SHARE
from analysis.diagnosis.search.explain import Explanation, retune_alone
from analysis.diagnosis.search.search import prune, search_effects
from analysis.diagnosis.search.starting_hypotheses import list_candidates
from analysis.diagnosis.search.time_budget import grant_time
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import PlacedEffect

FRICTION_N = 0.15


def place_effect(name, **values):
    return PlacedEffect(EFFECTS[name], (0,), values)


def make_hypothesis(name, **values):
    return make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])


def make_explanation(context, *claims):
    """An explanation as a search leaves it that added these in this order."""
    base, steps, whole = context.score_fit(retune_alone(context)), [], None
    for each in claims:
        whole = each if whole is None else combine_hypotheses(whole, each)
        steps.append(context.score_fit(evaluate_fit(context.measure, context.tuning, base.fitted.deviations, whole)))
    ends = (context.with_test_score(item) for item in (base, base, steps[-1]))
    return Explanation(*ends, tuple((step,) for step in steps), tuple(steps))


def effect_names(found):
    return [each.effect.name for each in found.after.fitted.hypothesis.claims]


@pytest.fixture(scope="module")
def friction_context(make_context):
    return make_context((place_effect("coulomb_friction", level=FRICTION_N),))


@pytest.fixture(scope="module")
def friction_and_force_context(make_context):
    return make_context((place_effect("coulomb_friction", level=FRICTION_N), place_effect("constant_force", force=0.2)))


@pytest.mark.slow
def test_a_stopgap_goes_once_the_true_law_has_its_numbers(friction_context):
    found = make_explanation(
        friction_context,
        make_hypothesis("constant_force", force=1e-6),
        make_hypothesis("coulomb_friction", level=FRICTION_N),
    )
    assert effect_names(found) == ["constant_force", "coulomb_friction"]
    left = prune(friction_context, found, grant_time)
    assert effect_names(left) == ["coulomb_friction"]
    assert len(left.rounds) == len(left.steps) == 1
    # What it was compared with stays to be told.
    assert [each.fitted.hypothesis.claims[-1].effect.name for each in left.rounds[0]] == [
        "coulomb_friction",
        "constant_force",
    ]


@pytest.mark.slow
def test_two_that_are_needed_stay(friction_and_force_context):
    found = make_explanation(
        friction_and_force_context,
        make_hypothesis("constant_force", force=0.2),
        make_hypothesis("coulomb_friction", level=FRICTION_N),
    )
    left = prune(friction_and_force_context, found, grant_time)
    assert [each.fitted.hypothesis.key for each in left.steps] == [each.fitted.hypothesis.key for each in found.steps]
    assert left.steps[-1].fitted.cost <= found.steps[-1].fitted.cost


@pytest.fixture
def forbid_fit(monkeypatch):
    def refused(*_):
        raise AssertionError("fitted again")

    monkeypatch.setattr("analysis.diagnosis.search.revise_selection.refine", refused)


def test_two_that_are_needed_are_compared_while_there_is_time(friction_and_force_context, forbid_fit):
    found = make_explanation(
        friction_and_force_context,
        make_hypothesis("constant_force", force=0.2),
        make_hypothesis("coulomb_friction", level=FRICTION_N),
    )
    with pytest.raises(AssertionError, match="fitted again"):
        prune(friction_and_force_context, found, grant_time)


@pytest.mark.slow
def test_out_of_time_nothing_is_fitted_again(friction_and_force_context, forbid_fit):
    found = make_explanation(
        friction_and_force_context,
        make_hypothesis("constant_force", force=0.2),
        make_hypothesis("coulomb_friction", level=FRICTION_N),
    )
    assert effect_names(prune(friction_and_force_context, found, lambda: False)) == [
        "constant_force",
        "coulomb_friction",
    ]


@pytest.mark.slow
def test_out_of_time_no_profile_is_fitted_and_what_may_be_none_is_not_named(friction_context, forbid_fit):
    """A constant force of 0.1 N that is not there, and whose interval holds zero by less than twice."""
    found = make_explanation(
        friction_context,
        make_hypothesis("constant_force", force=0.1),
        make_hypothesis("coulomb_friction", level=FRICTION_N),
    )
    left = prune(friction_context, found, lambda: False)
    assert (effect_names(left), left.undetermined) == ([], ("constant_force",))


@pytest.fixture(scope="module")
def friction_and_weak_force_context(make_context):
    return make_context(
        (place_effect("coulomb_friction", level=FRICTION_N), place_effect("constant_force", force=0.01))
    )


@pytest.mark.parametrize(("second", "kept"), [(2.0, 1), (1.02, 2)])
def test_a_little_more_is_not_named_where_more_than_noise_is_left_with_it(
    friction_and_weak_force_context, make_candidate, second, kept
):
    """A share of one in twenty, once with a remainder beside and once down to the noise."""
    whole = make_explanation(
        friction_and_weak_force_context,
        make_hypothesis("coulomb_friction", level=FRICTION_N),
        make_hypothesis("constant_force", force=0.01),
    )
    levels = (200.0, second * 200 ** (LAST_EFFECT_SHARE / 2), second)
    base, first, last = (make_candidate(level).score for level in levels)
    steps = (replace(whole.steps[0], score=first), replace(whole.steps[1], score=last))
    found = replace(
        whole,
        retuned=replace(whole.retuned, score=base),
        after=replace(whole.after, score=last),
        steps=steps,
        rounds=((steps[0],), (steps[1],)),
    )
    assert len(prune(friction_and_weak_force_context, found, lambda: False).steps) == kept


@pytest.mark.slow
def test_a_delay_of_more_than_a_tick_is_found_where_re_tuning_hid_it(make_context, diagnosed):
    """From below a whole number of ticks no small step leads above it."""
    late = 1.16 / diagnosed.RATE_HZ
    context = make_context((place_effect("transport_delay", delay=late),))
    base = retune_alone(context)
    starts = [
        candidate.list_placed_effects()[-1].values["delay"]
        for candidate in list_candidates(
            [EFFECTS["transport_delay"]], gather_evidence(context.measure, context.tuning, base)[0]
        )
    ]
    assert any(start < 1 / diagnosed.RATE_HZ for start in starts)
    assert any(start > 1 / diagnosed.RATE_HZ for start in starts)
    found = search_effects(context, CATALOGUE, lambda what, share: None).found
    assert effect_names(found) == ["transport_delay"]
    assert found.after.fitted.hypothesis.list_placed_effects()[-1].values["delay"] == pytest.approx(late, rel=0.01)
    assert np.nanmax(found.after.score.test) < 1.1
