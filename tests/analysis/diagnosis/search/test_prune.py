"""Of what a search found, only what is needed stays."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, combine, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.search.explain import Explanation, retune_alone
from analysis.diagnosis.search.search import prune, search_effects
from analysis.diagnosis.search.starting_hypotheses import candidates
from analysis.diagnosis.search.time_budget import always
from analysis.diagnosis.settings import LAST_EFFECT_SHARE
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import PlacedEffect

FRICTION_N = 0.15


def placed(name, **values):
    return PlacedEffect(EFFECTS[name], (0,), values)


def claim(name, **values):
    return hypothesis_of_claim(Claim(EFFECTS[name], "one", (0,)), [values])


def one_after_the_other(context, *claims):
    """An explanation as a search leaves it that added these in this order."""
    base, steps, whole = context.candidate(retune_alone(context)), [], None
    for each in claims:
        whole = each if whole is None else combine(whole, each)
        steps.append(context.candidate(evaluate_fit(context.measure, context.tuning, base.fitted.deviations, whole)))
    ends = (context.with_test_score(item) for item in (base, base, steps[-1]))
    return Explanation(*ends, tuple((step,) for step in steps), tuple(steps))


def names(found):
    return [each.effect.name for each in found.after.fitted.hypothesis.claims]


@pytest.fixture(scope="module")
def rubbing(arena_of):
    return arena_of((placed("coulomb_friction", level=FRICTION_N),))


@pytest.fixture(scope="module")
def rubbing_and_pushed(arena_of):
    return arena_of((placed("coulomb_friction", level=FRICTION_N), placed("constant_force", force=0.2)))


def test_a_stopgap_goes_once_the_true_law_has_its_numbers(rubbing):
    found = one_after_the_other(
        rubbing, claim("constant_force", force=1e-6), claim("coulomb_friction", level=FRICTION_N)
    )
    assert names(found) == ["constant_force", "coulomb_friction"]
    left = prune(rubbing, found, always)
    assert names(left) == ["coulomb_friction"]
    assert len(left.rounds) == len(left.steps) == 1
    # What it was compared with stays to be told.
    assert [each.fitted.hypothesis.claims[-1].effect.name for each in left.rounds[0]] == [
        "coulomb_friction",
        "constant_force",
    ]


def test_two_that_are_needed_stay(rubbing_and_pushed):
    found = one_after_the_other(
        rubbing_and_pushed, claim("constant_force", force=0.2), claim("coulomb_friction", level=FRICTION_N)
    )
    left = prune(rubbing_and_pushed, found, always)
    assert [each.fitted.hypothesis.key for each in left.steps] == [each.fitted.hypothesis.key for each in found.steps]
    assert left.steps[-1].fitted.cost <= found.steps[-1].fitted.cost


@pytest.fixture
def no_fit(monkeypatch):
    def refused(*_):
        raise AssertionError("fitted again")

    monkeypatch.setattr("analysis.diagnosis.search.revise_selection.refine", refused)


def test_two_that_are_needed_are_compared_while_there_is_time(rubbing_and_pushed, no_fit):
    found = one_after_the_other(
        rubbing_and_pushed, claim("constant_force", force=0.2), claim("coulomb_friction", level=FRICTION_N)
    )
    with pytest.raises(AssertionError, match="fitted again"):
        prune(rubbing_and_pushed, found, always)


def test_out_of_time_nothing_is_fitted_again(rubbing_and_pushed, no_fit):
    found = one_after_the_other(
        rubbing_and_pushed, claim("constant_force", force=0.2), claim("coulomb_friction", level=FRICTION_N)
    )
    assert names(prune(rubbing_and_pushed, found, lambda: False)) == ["constant_force", "coulomb_friction"]


def test_out_of_time_no_profile_is_fitted_and_what_may_be_none_is_not_named(rubbing, no_fit):
    """A constant force of 0.1 N that is not there, and whose interval holds zero by less than twice."""
    found = one_after_the_other(
        rubbing, claim("constant_force", force=0.1), claim("coulomb_friction", level=FRICTION_N)
    )
    left = prune(rubbing, found, lambda: False)
    assert (names(left), left.undetermined) == ([], ("constant_force",))


@pytest.fixture(scope="module")
def rubbing_and_pushed_a_little(arena_of):
    return arena_of((placed("coulomb_friction", level=FRICTION_N), placed("constant_force", force=0.01)))


@pytest.mark.parametrize(("second", "kept"), [(2.0, 1), (1.02, 2)])
def test_a_little_more_is_not_named_where_more_than_noise_is_left_with_it(
    rubbing_and_pushed_a_little, standing_at, second, kept
):
    """A share of one in twenty, once with a remainder beside and once down to the noise."""
    whole = one_after_the_other(
        rubbing_and_pushed_a_little,
        claim("coulomb_friction", level=FRICTION_N),
        claim("constant_force", force=0.01),
    )
    levels = (200.0, second * 200 ** (LAST_EFFECT_SHARE / 2), second)
    base, first, last = (standing_at(level).score for level in levels)
    steps = (replace(whole.steps[0], score=first), replace(whole.steps[1], score=last))
    found = replace(
        whole,
        retuned=replace(whole.retuned, score=base),
        after=replace(whole.after, score=last),
        steps=steps,
        rounds=((steps[0],), (steps[1],)),
    )
    assert len(prune(rubbing_and_pushed_a_little, found, lambda: False).steps) == kept


def test_a_delay_of_more_than_a_tick_is_found_where_re_tuning_hid_it(arena_of, diagnosed):
    """From below a whole number of ticks no small step leads above it."""
    late = 1.16 / diagnosed.RATE_HZ
    context = arena_of((placed("transport_delay", delay=late),))
    base = retune_alone(context)
    starts = [
        candidate.list_placed_effects()[-1].values["delay"]
        for candidate in candidates(
            [EFFECTS["transport_delay"]], gather_evidence(context.measure, context.tuning, base)[0]
        )
    ]
    assert any(start < 1 / diagnosed.RATE_HZ for start in starts)
    assert any(start > 1 / diagnosed.RATE_HZ for start in starts)
    found = search_effects(context, CATALOGUE, lambda what, share: None).found
    assert names(found) == ["transport_delay"]
    assert found.after.fitted.hypothesis.list_placed_effects()[-1].values["delay"] == pytest.approx(late, rel=0.01)
    assert np.nanmax(found.after.score.test) < 1.1
