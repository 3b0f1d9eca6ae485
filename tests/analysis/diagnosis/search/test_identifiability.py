"""An effect is named only where the recordings fix its number."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import INTERVAL_FACTOR, MOST_BETWEEN_SEGMENTS
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation, retune_alone
from analysis.diagnosis.search.identifiability import (
    _is_undetermined,
    compute_final_errors,
    compute_interval_errors,
    compute_null_distance,
    keep_identifiable,
)
from analysis.diagnosis.search.search import search_effects
from analysis.diagnosis.search.time_budget import grant_time
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect

FRICTION_N = 0.15


def make_hypothesis(name, **values):
    return make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])


def make_candidate(context, base, *claims):
    whole = claims[0] if len(claims) == 1 else combine_hypotheses(*claims)
    return context.score_fit(evaluate_fit(context.measure, context.tuning, base.fitted.deviations, whole))


def make_explanation(context, *rivals):
    """rivals: of the one round, the named one first; all as good as it."""
    base = context.score_fit(retune_alone(context))
    found = [make_candidate(context, base, rival) for rival in rivals]
    found = [replace(each, score=found[0].score) for each in found]
    return Explanation(
        context.with_test_score(base),
        context.with_test_score(base),
        context.with_test_score(found[0]),
        (tuple(found),),
        (found[0],),
    )


def effect_names(found):
    return [each.effect.name for each in found.after.fitted.hypothesis.claims]


@pytest.fixture(scope="module")
def friction_context(make_context):
    return make_context((PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": FRICTION_N}),))


FRICTION, OPEN = make_hypothesis("coulomb_friction", level=FRICTION_N), make_hypothesis("viscous_damping", damping=1e-3)


def test_a_number_that_is_fixed_is_named(friction_context):
    found = make_explanation(friction_context, FRICTION, OPEN)
    assert effect_names(keep_identifiable(friction_context, found, grant_time)) == effect_names(found)


@pytest.mark.slow
def test_in_place_of_one_that_is_open_stands_what_is_as_good_and_fixed(friction_context):
    assert effect_names(
        keep_identifiable(friction_context, make_explanation(friction_context, OPEN, FRICTION), grant_time)
    ) == ["coulomb_friction"]


def test_with_nothing_as_good_nothing_is_named_and_what_was_left_out_is_known(friction_context):
    left = keep_identifiable(friction_context, make_explanation(friction_context, OPEN), grant_time)
    assert left.after is left.retuned
    assert (left.steps, left.undetermined) == ((), ("viscous_damping",))


@pytest.mark.slow
@pytest.mark.parametrize("order", [(FRICTION, OPEN), (OPEN, FRICTION)])
def test_of_two_the_one_that_is_open_goes_whichever_came_first(friction_context, order):
    base = friction_context.score_fit(retune_alone(friction_context))
    first, both = make_candidate(friction_context, base, order[0]), make_candidate(friction_context, base, *order)
    ends = [friction_context.with_test_score(each) for each in (base, base, both)]
    left = keep_identifiable(friction_context, Explanation(*ends, ((first,), (both,)), (first, both)), grant_time)
    assert (effect_names(left), left.undetermined) == (["coulomb_friction"], ("viscous_damping",))
    assert [step.fitted.hypothesis.key for step in left.steps] == [left.rounds[0][0].fitted.hypothesis.key]


@pytest.mark.slow
def test_one_number_that_is_fixed_is_enough(friction_context):
    """Rubbing in one direction alone: the other's number is open, and the effect is there."""
    found = make_explanation(
        friction_context, make_hypothesis("asymmetric_friction", level_positive=FRICTION_N, level_negative=1e-9)
    )
    assert effect_names(keep_identifiable(friction_context, found, grant_time)) == effect_names(found)


def test_what_has_no_number_that_could_be_none_is_not_judged(friction_context):
    found = make_explanation(friction_context, make_hypothesis("force_saturation", limit=1e3))
    assert effect_names(keep_identifiable(friction_context, found, grant_time)) == effect_names(found)


@pytest.mark.slow
def test_it_is_said_that_numbers_were_left_open(friction_context, monkeypatch):
    monkeypatch.setattr("analysis.diagnosis.search.identifiability.INTERVAL_FACTOR", 1e6)
    seen = search_effects(friction_context, [EFFECTS["coulomb_friction"]], lambda what, share: None)
    assert (seen.judgement.verdict, seen.judgement.named) == ("unexplained", False)
    assert seen.remarks == (
        "An explanation by dry friction is not named: these recordings hardly determine its parameters.",
    )


def fit_claims(context, *claims):
    """As a search ends: each claim fitted beside those before it."""
    base = context.score_fit(retune_alone(context))
    steps, at = [], base
    for newest in claims:
        start = evaluate_fit(
            context.measure, context.tuning, at.fitted.deviations, combine_hypotheses(at.fitted.hypothesis, newest)
        )
        at = context.score_fit(refine(context, start))
        steps.append(at)
    ends = [context.with_test_score(each) for each in (base, base, at)]
    return Explanation(*ends, tuple((step,) for step in steps), tuple(steps))


@pytest.mark.slow
def test_the_profile_distinguishes_a_present_number_from_zero_and_an_absent_one_not(friction_context):
    both = fit_claims(friction_context, FRICTION, OPEN)
    assert compute_null_distance(friction_context, both, 0) > 1
    assert compute_null_distance(friction_context, both, 1) < 1


@pytest.mark.slow
def test_a_step_that_was_scored_on_all_samples_has_the_same_profile(friction_context):
    """A law that held-out samples chose is such a step; its residuals have other shapes than those of the search."""
    both = fit_claims(friction_context, FRICTION, OPEN)
    scored = replace(both, steps=(*both.steps[:-1], both.after))
    shapes = [[left.shape for left in each.steps[-1].fitted.residuals] for each in (both, scored)]
    assert shapes[0] != shapes[1]
    assert compute_null_distance(friction_context, scored, 1) == pytest.approx(
        compute_null_distance(friction_context, both, 1)
    )


@pytest.mark.slow
def test_an_interval_that_contains_zero_is_corrected_by_the_profile_likelihood(friction_context, monkeypatch):
    found = fit_claims(friction_context, FRICTION)
    place, level = (
        len(friction_context.tuning.names),
        found.after.fitted.hypothesis.list_placed_effects()[0].values["level"],
    )
    plain = compute_final_errors(friction_context, found)
    wide = plain.copy()
    wide[place] = np.log1p(2 / (1.96 * INTERVAL_FACTOR))
    monkeypatch.setattr("analysis.diagnosis.search.identifiability.compute_standard_errors", lambda *given: wide)
    named = keep_identifiable(friction_context, found, grant_time)
    assert effect_names(named) == ["coulomb_friction"]
    assert 1.96 * INTERVAL_FACTOR * level * np.expm1(named.errors[1][place]) < level


@pytest.mark.slow
def test_numbers_whose_intervals_all_hold_none_are_not_named(friction_context, monkeypatch):
    found = fit_claims(
        friction_context, make_hypothesis("asymmetric_friction", level_positive=FRICTION_N, level_negative=FRICTION_N)
    )
    wide = compute_final_errors(friction_context, found).copy()
    wide[len(friction_context.tuning.names) :] = np.log1p(2 / (1.96 * INTERVAL_FACTOR))
    monkeypatch.setattr("analysis.diagnosis.search.identifiability.compute_standard_errors", lambda *given: wide)
    assert keep_identifiable(friction_context, found, grant_time).undetermined == ("asymmetric_friction",)


@pytest.mark.slow
def test_stated_intervals_hold_the_noise_and_a_bounded_part_of_what_varies_between_segments(friction_context):
    found = fit_claims(friction_context, FRICTION)
    noise = compute_final_errors(friction_context, found)
    stated = compute_interval_errors(friction_context, found, noise)
    assert (stated >= noise).all()
    assert (stated <= np.hypot(1.0, MOST_BETWEEN_SEGMENTS) * noise * (1 + 1e-9)).all()
    assert stated[-1] > noise[-1] > 0


@pytest.mark.slow
def test_one_segment_tells_nothing_between_segments(friction_context):
    def joined(measure):
        records = (replace(each, recording=replace(each.recording, segments=())) for each in measure.records)
        return measure.with_records(tuple(records))

    alone = replace(
        friction_context, measure=joined(friction_context.measure), full_measure=joined(friction_context.full_measure)
    )
    found = fit_claims(friction_context, FRICTION)
    noise = compute_final_errors(alone, found)
    assert compute_interval_errors(alone, found, noise) == pytest.approx(INTERVAL_FACTOR * noise)


def test_a_jump_that_no_sample_shows_does_not_leave_a_dead_band_open(make_context):
    dead = make_context((PlacedEffect(EFFECTS["force_deadband"], (0,), {"width": 0.02, "jump": 0.0}),))
    base = dead.score_fit(retune_alone(dead))
    start = evaluate_fit(
        dead.measure, dead.tuning, base.fitted.deviations, make_hypothesis("force_deadband", width=0.02, jump=1e-3)
    )
    step = dead.score_fit(start)
    found = Explanation(*(dead.with_test_score(each) for each in (base, base, step)), ((step,),), (step,))
    left = keep_identifiable(dead, found, grant_time)
    assert effect_names(left) == ["force_deadband"]
    placed = left.after.fitted.hypothesis.list_placed_effects()[0]
    assert placed.values["jump"] == 0.0
    assert placed.values["width"] == pytest.approx(0.02, rel=0.1)


@pytest.mark.parametrize(("name", "values"), [("coulomb_friction", {"level": 0.2}), ("force_gain", {"gain": 0.9})])
def test_a_number_of_unknown_error_is_not_determined_within_any_limits(name, values):
    hypothesis = make_hypothesis(name, **values)
    parameter = hypothesis.parameters[0]
    limited = replace(parameter, parameter=replace(parameter.parameter, upper=1.01 * hypothesis.point[0]))
    for each in (parameter, limited):
        assert _is_undetermined(each, hypothesis.point[0], np.inf)
