"""An effect that forward selection took for what two others do together is exchanged for one of them."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import EXPLAINED_ERROR
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation, explain, is_worth_searching, retune_alone
from analysis.diagnosis.search.parsimony import has_small_error, is_worthwhile
from analysis.diagnosis.search.revise_selection import (
    drop_unconfirmed_effects,
    drop_unnecessary_effects,
    exchange_first_effects,
    exchange_first_for_relatives,
)
from analysis.diagnosis.search.search import prune
from analysis.diagnosis.search.time_budget import CountedBudget, grant_time
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect

LIMIT_N, LAG_HZ = 1.3, 60.0


def ignore_progress(said, share):
    pass


def with_error(candidate, error):
    """The candidate with the same error, times the noise, in all channels."""
    same = np.full(len(candidate.score.fit), error)
    return replace(candidate, score=replace(candidate.score, fit=same, choose=same))


def claim(name, **values):
    return make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])


def effect_names(found):
    return sorted(each.effect.name for each in found.after.fitted.hypothesis.claims)


@pytest.fixture(scope="module")
def saturated_lag(make_context):
    return make_context(
        (
            PlacedEffect(EFFECTS["force_saturation"], (0,), {"limit": LIMIT_N}),
            PlacedEffect(EFFECTS["sensor_lag"], (0,), {"bandwidth": LAG_HZ}),
        )
    )


def explain_by(context, *claims):
    """An explanation that forward selection left, each step refitted."""
    base = context.score_fit(retune_alone(context))
    steps, fitted = [], base.fitted
    for each in claims:
        whole = combine_hypotheses(fitted.hypothesis, each) if fitted.hypothesis.claims else each
        fitted = refine(context, evaluate_fit(context.measure, context.tuning, fitted.deviations, whole))
        steps.append(context.score_fit(fitted))
    ends = (context.with_test_score(item) for item in (base, base, steps[-1]))
    return Explanation(*ends, tuple((step,) for step in steps), tuple(steps))


@pytest.fixture(scope="module")
def compromise(saturated_lag):
    return explain_by(saturated_lag, claim("amplifier_lag", time_constant=3e-3), claim("sensor_lag", bandwidth=80.0))


CATALOGUE = [EFFECTS[name] for name in ("amplifier_lag", "sensor_lag", "force_saturation", "viscous_damping")]


@pytest.mark.slow
def test_the_first_effect_is_looked_for_again_beside_the_second(saturated_lag, compromise):
    assert compromise.after.score.worst_channel > EXPLAINED_ERROR
    found = exchange_first_effects(saturated_lag, compromise, CATALOGUE, ignore_progress, grant_time)
    assert effect_names(found) == ["force_saturation", "sensor_lag"]
    assert found.after.score.worst_channel < EXPLAINED_ERROR
    assert len(found.rounds) == len(found.steps) == 2


def test_without_time_or_a_better_effect_nothing_is_exchanged(saturated_lag, compromise):
    assert exchange_first_effects(saturated_lag, compromise, CATALOGUE, ignore_progress, lambda: False) is compromise
    assert exchange_first_effects(saturated_lag, compromise, CATALOGUE[:2], ignore_progress, grant_time) is compromise


@pytest.mark.parametrize("asked", [1, 2, 3, 5, 8])
def test_an_exchange_whose_time_ends_changes_nothing(saturated_lag, compromise, asked):
    found = exchange_first_effects(saturated_lag, compromise, CATALOGUE, ignore_progress, CountedBudget(asked))
    assert found is compromise


@pytest.mark.slow
def test_a_discarded_effect_is_no_rival_of_the_one_that_stays(saturated_lag, compromise):
    lag = explain_by(saturated_lag, claim("amplifier_lag", time_constant=3e-3)).steps
    rivals = replace(compromise, rounds=((*compromise.rounds[0], *lag), *compromise.rounds[1:]))
    found = exchange_first_effects(saturated_lag, rivals, CATALOGUE, ignore_progress, grant_time)
    assert [each.newest for each in found.rounds[0]] == [found.steps[0].newest]


@pytest.mark.slow
def test_an_effect_that_is_not_to_be_named_takes_no_place(saturated_lag, compromise):
    barred = replace(saturated_lag, excluded=frozenset({"force_saturation"}))
    assert exchange_first_effects(barred, compromise, CATALOGUE, ignore_progress, grant_time) is compromise


@pytest.fixture(scope="module")
def friction_lag(make_context):
    rubs = PlacedEffect(EFFECTS["asymmetric_friction"], (0,), {"level_positive": 0.05, "level_negative": 0.12})
    return make_context((rubs, PlacedEffect(EFFECTS["sensor_lag"], (0,), {"bandwidth": LAG_HZ})), axes=2)


@pytest.mark.slow
def test_a_plain_law_is_exchanged_for_its_refinement_beside_the_second(friction_lag, monkeypatch):
    import analysis.diagnosis.search.revise_selection as revised

    tried, fits, find = [], [], revised.find_first_fits

    def find_and_note(context, catalogue, base, evidence, step, sites):
        tried.append({effect.name for effect in catalogue})
        fits.extend(found := find(context, catalogue, base, evidence, step, sites))
        return found

    monkeypatch.setattr(revised, "find_first_fits", find_and_note)
    plain = explain_by(friction_lag, claim("coulomb_friction", level=0.08), claim("sensor_lag", bandwidth=LAG_HZ))
    assert plain.after.score.worst_channel > EXPLAINED_ERROR
    everything = list(EFFECTS.values())
    found = exchange_first_for_relatives(friction_lag, plain, everything, ignore_progress, grant_time)
    assert effect_names(found) == ["asymmetric_friction", "sensor_lag"]
    assert found.after.score.worst_channel < EXPLAINED_ERROR
    rubs = {"coulomb_friction", *(e.name for e in everything if "coulomb_friction" in e.simpler)}
    assert tried == [rubs]
    # Only at the place of the law that they replace.
    assert {law.hypothesis.claims[-1].sites for law in fits} == {(0,)}


@pytest.mark.slow
def test_a_refinement_that_adds_little_takes_no_place(make_context):
    rubs = PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.08})
    context = make_context((rubs, PlacedEffect(EFFECTS["force_saturation"], (0,), {"limit": LIMIT_N})))
    # The second effect is not the right one: what it leaves, a refinement of the first takes up in part.
    found = explain_by(context, claim("coulomb_friction", level=0.08), claim("sensor_lag", bandwidth=LAG_HZ))
    assert found.after.score.worst_channel > EXPLAINED_ERROR
    assert exchange_first_for_relatives(context, found, list(EFFECTS.values()), ignore_progress, grant_time) is found


@pytest.mark.slow
def test_another_law_of_the_family_takes_the_place_of_one_that_it_does_not_refine(friction_lag):
    at_rest = claim("stribeck_friction", coulomb=0.07, static=0.09, speed=0.01)
    sticking = explain_by(friction_lag, at_rest, claim("sensor_lag", bandwidth=LAG_HZ))
    found = exchange_first_for_relatives(friction_lag, sticking, list(EFFECTS.values()), ignore_progress, grant_time)
    assert effect_names(found) == ["asymmetric_friction", "sensor_lag"]
    assert found.after.score.worst_channel < EXPLAINED_ERROR


@pytest.mark.slow
def test_a_law_without_refinements_stays(friction_lag):
    plain = explain_by(friction_lag, claim("coulomb_friction", level=0.08), claim("sensor_lag", bandwidth=LAG_HZ))
    none = [EFFECTS[name] for name in ("viscous_damping", "sensor_lag")]
    assert exchange_first_for_relatives(friction_lag, plain, none, ignore_progress, grant_time) is plain


@pytest.mark.slow
def test_of_three_the_one_that_stood_in_is_dropped(saturated_lag):
    three = explain_by(
        saturated_lag,
        claim("amplifier_lag", time_constant=3e-4),
        claim("force_saturation", limit=LIMIT_N),
        claim("sensor_lag", bandwidth=LAG_HZ),
    )
    left = prune(saturated_lag, three, grant_time)
    assert effect_names(left) == ["force_saturation", "sensor_lag"]
    assert len(left.rounds) == len(left.steps) == 2


@pytest.mark.slow
def test_rivals_are_kept_only_where_they_were_compared(saturated_lag):
    first = claim("amplifier_lag", time_constant=3e-4)
    three = explain_by(
        saturated_lag, first, claim("force_saturation", limit=LIMIT_N), claim("sensor_lag", bandwidth=LAG_HZ)
    )
    beside = explain_by(saturated_lag, claim("viscous_damping", damping=0.5)).steps
    left = prune(saturated_lag, replace(three, rounds=((*three.rounds[0], *beside), *three.rounds[1:])), grant_time)
    assert len(left.rounds[0]) == 1


@pytest.mark.slow
@pytest.mark.parametrize("place", [0, 1, 2])
def test_of_three_goes_the_one_without_which_two_fit_as_well_as_laws_of_real_devices_do(saturated_lag, place):
    claims = [claim("force_saturation", limit=LIMIT_N), claim("sensor_lag", bandwidth=LAG_HZ)]
    claims.insert(place, claim("viscous_damping", damping=0.01))
    left = drop_unnecessary_effects(saturated_lag, explain_by(saturated_lag, *claims), grant_time)
    assert effect_names(left) == ["force_saturation", "sensor_lag"]


def three_effects(make_context, k3):
    physics = {
        "force_saturation": {"limit": LIMIT_N},
        "sensor_lag": {"bandwidth": LAG_HZ},
        "hardening_stiffness": {"k3": k3},
    }
    context = make_context(tuple(PlacedEffect(EFFECTS[name], (0,), values) for name, values in physics.items()))
    return context, explain_by(context, *(claim(name, **values) for name, values in physics.items()))


@pytest.mark.slow
def test_three_stay_where_any_two_leave_more_than_laws_of_real_devices_do(make_context):
    context, found = three_effects(make_context, 1e5)
    assert not has_small_error(found.retuned, found.steps[1])
    assert effect_names(drop_unnecessary_effects(context, found, grant_time)) == effect_names(found)


@pytest.mark.slow
def test_a_third_goes_though_it_shows_where_two_leave_as_little_as_laws_of_real_devices_do(make_context):
    context, found = three_effects(make_context, 5e4)
    two = found.steps[1]
    assert two.score.worst_channel > EXPLAINED_ERROR
    assert is_worthwhile(two, found.steps[2])
    assert effect_names(drop_unnecessary_effects(context, found, grant_time)) == ["force_saturation", "sensor_lag"]
    # So it is not looked for, but in samples that were opened: few among many.
    assert not is_worth_searching(context, found, two)
    assert is_worth_searching(replace(context, has_opened_samples=True), found, two)
    # Nor is one of the two exchanged.
    pair = replace(found, after=context.with_test_score(two), steps=found.steps[:2], rounds=found.rounds[:2])
    assert exchange_first_effects(context, pair, list(EFFECTS.values()), ignore_progress, grant_time) is pair


def test_a_second_effect_is_looked_for_where_more_than_noise_is_left(saturated_lag):
    found = explain_by(saturated_lag, claim("force_saturation", limit=LIMIT_N))
    assert not is_worth_searching(saturated_lag, found, with_error(found.steps[0], 1.02))
    assert is_worth_searching(saturated_lag, found, with_error(found.steps[0], 1.08))


def test_of_a_small_remainder_an_effect_must_take_half(saturated_lag):
    (step,) = explain_by(saturated_lag, claim("force_saturation", limit=LIMIT_N)).steps
    assert not is_worthwhile(with_error(step, 1.10), with_error(step, 1.07))
    assert is_worthwhile(with_error(step, 1.10), with_error(step, 1.02))
    # Of a large one, a smaller share is enough.
    assert is_worthwhile(with_error(step, 3.0), with_error(step, 2.0))


def test_a_small_second_effect_goes_unless_held_out_samples_confirm_it(saturated_lag):
    found = explain_by(saturated_lag, claim("force_saturation", limit=LIMIT_N), claim("sensor_lag", bandwidth=LAG_HZ))
    first, second = found.steps
    small = replace(found, steps=(with_error(first, 1.10), second))
    assert effect_names(drop_unconfirmed_effects(saturated_lag, small)) == ["force_saturation", "sensor_lag"]
    worse = replace(small.after, score=replace(small.after.score, test=np.full(2, 1e3)))
    assert effect_names(drop_unconfirmed_effects(saturated_lag, replace(small, after=worse))) == ["force_saturation"]
    # One that was found in a large remainder stays: other rules judge it.
    large = replace(found, steps=(with_error(first, 3.0), second), after=worse)
    assert drop_unconfirmed_effects(saturated_lag, large) is large


@pytest.mark.slow
def test_no_fourth_effect_is_looked_for_beside_three_that_are_taken_over(saturated_lag):
    found = explain_by(
        saturated_lag,
        claim("coulomb_friction", level=0.01),
        claim("hardening_stiffness", k3=10.0),
        claim("sensor_lag", bandwidth=900.0),
    )
    again = explain(replace(saturated_lag, has_opened_samples=True), [], ignore_progress, previous_steps=found.rounds)
    assert again.after.score.worst_channel > EXPLAINED_ERROR
    assert [step.newest for step in again.steps] == [step.newest for step in found.steps]


@pytest.mark.slow
def test_the_last_goes_where_it_only_led_the_others_out_of_a_local_minimum(saturated_lag):
    right = explain_by(saturated_lag, claim("force_saturation", limit=LIMIT_N), claim("sensor_lag", bandwidth=LAG_HZ))
    worse = right.steps[1].fitted
    moved = replace(worse.hypothesis, point=worse.hypothesis.point + 0.2)
    stuck = saturated_lag.score_fit(evaluate_fit(saturated_lag.measure, saturated_lag.tuning, worse.deviations, moved))
    helped = explain_by(
        saturated_lag,
        claim("force_saturation", limit=LIMIT_N),
        claim("sensor_lag", bandwidth=LAG_HZ),
        claim("force_gain", gain=1.01),
    )
    found = replace(helped, steps=(helped.steps[0], stuck, helped.steps[2]))
    assert is_worthwhile(stuck, helped.steps[2])
    left = drop_unnecessary_effects(saturated_lag, found, grant_time)
    assert effect_names(left) == ["force_saturation", "sensor_lag"]
    assert left.after.score.worst_channel < EXPLAINED_ERROR
    assert [each.newest for each in left.rounds[-1]] == ["sensor_lag"]


@pytest.mark.slow
def test_a_refinement_beside_a_wrong_second_must_gain_as_much_as_in_any_step(make_context):
    rubs = PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.08})
    hardens = PlacedEffect(EFFECTS["hardening_stiffness"], (0,), {"k3": 3e6})
    context = make_context((rubs, PlacedEffect(EFFECTS["sensor_lag"], (0,), {"bandwidth": LAG_HZ}), hardens))
    # Refinements take up a fifth of what the third effect leaves.
    found = explain_by(context, claim("coulomb_friction", level=0.08), claim("sensor_lag", bandwidth=LAG_HZ))
    assert exchange_first_for_relatives(context, found, list(EFFECTS.values()), ignore_progress, grant_time) is found
