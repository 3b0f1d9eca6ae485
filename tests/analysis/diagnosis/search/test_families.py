"""What can stand beside what."""

from dataclasses import replace

import pytest

from analysis.diagnosis.errors.hypothesis import Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation, retune_alone
from analysis.diagnosis.search.parsimony import FAMILIES, are_exclusive
from analysis.diagnosis.search.revise_selection import exchange_first_for_relatives
from analysis.diagnosis.search.time_budget import CountedBudget
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import PlacedEffect


def make_claim(name, *sites):
    return Claim(EFFECTS[name], "one", sites or (0,))


@pytest.mark.parametrize(
    ("one", "other"),
    [("coulomb_friction", "stribeck_friction"), ("amplifier_lag", "transport_delay"), ("backlash", "loose_joint")],
)
def test_one_thing_has_one_shape_at_a_place(one, other):
    assert are_exclusive(make_claim(one), make_claim(other)) and are_exclusive(make_claim(other), make_claim(one))


def test_an_effect_is_not_there_twice():
    for effect in CATALOGUE:
        assert are_exclusive(make_claim(effect.name), make_claim(effect.name))


def test_other_axes_are_other_things():
    assert not are_exclusive(make_claim("coulomb_friction", 0), make_claim("stribeck_friction", 1))
    assert are_exclusive(make_claim("coulomb_friction", 0, 1, 2), make_claim("stribeck_friction", 1))


def test_different_physics_stands_side_by_side():
    assert not are_exclusive(make_claim("coulomb_friction"), make_claim("sensor_lag"))


def test_families_are_made_of_effects_that_there_are_and_do_not_meet():
    names = [name for family in FAMILIES for name in family]
    assert set(names) <= set(EFFECTS)
    assert len(names) == len(set(names))


@pytest.fixture(scope="module")
def plain_friction(make_context):
    """Friction with two levels and a slow sensor, explained by plain friction and the sensor; its context."""
    levels = {"level_positive": 0.05, "level_negative": 0.12}
    lag = make_claim_hypothesis(make_claim("sensor_lag"), [{"bandwidth": 60.0}])
    context = make_context(
        (
            PlacedEffect(EFFECTS["asymmetric_friction"], (0,), levels),
            PlacedEffect(EFFECTS["sensor_lag"], (0,), {"bandwidth": 60.0}),
        )
    )

    def fit(start, hypothesis):
        whole = combine_hypotheses(start.hypothesis, hypothesis)
        return context.score_fit(
            refine(context, evaluate_fit(context.measure, context.tuning, start.deviations, whole))
        )

    base = context.score_fit(retune_alone(context))
    plain = fit(base.fitted, make_claim_hypothesis(make_claim("coulomb_friction"), [{"level": 0.08}]))
    richer = fit(base.fitted, make_claim_hypothesis(make_claim("asymmetric_friction"), [levels]))
    both = fit(plain.fitted, lag)
    ends = map(context.with_test_score, (base, base, both))
    return context, Explanation(*ends, ((plain, richer), (both,)), (plain, both))


@pytest.mark.parametrize("calls", [1, 2, 5])
def test_a_relative_that_was_fitted_before_the_second_effect_replaces_the_first_though_the_time_ends(
    plain_friction, calls
):
    context, explanation = plain_friction
    found = exchange_first_for_relatives(
        context, explanation, CATALOGUE, lambda said, share: None, CountedBudget(calls)
    )
    assert [claim.effect.name for claim in found.after.fitted.hypothesis.claims] == [
        "sensor_lag",
        "asymmetric_friction",
    ]
    assert found.after.score.mean_log_error < explanation.after.score.mean_log_error
    assert found.ended_early  # a better fit was not searched for
    # Without time to begin, or without fits from before, it stays.
    assert exchange_first_for_relatives(context, explanation, CATALOGUE, print, CountedBudget(0)) is explanation
    without_fits = replace(explanation, rounds=(explanation.rounds[0][:1], explanation.rounds[1]))
    assert exchange_first_for_relatives(context, without_fits, CATALOGUE, print, CountedBudget(1)) is without_fits
