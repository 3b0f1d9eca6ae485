"""Claims with parameters: what a fit steps along is what is simulated."""

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import (
    NO_EFFECTS,
    Claim,
    combine_hypotheses,
    generate_near_equivalents,
    make_claim_hypothesis,
    remove_claim,
)
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.limits import STARTS_PER_CLAIM
from analysis.diagnosis.search.starting_hypotheses import list_candidates
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import PlacedEffect


def values_within_bounds(effect):
    """Inside its bounds, and not where it is nothing."""
    return {p.name: float(np.clip(1.3 if p.scale == "log" else 0.7, p.lower, p.upper)) for p in effect.parameters}


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_what_is_claimed_is_what_is_placed(effect):
    values = values_within_bounds(effect)
    (placed,) = make_claim_hypothesis(Claim(effect, "one", (1,)), [values]).list_placed_effects()
    assert (placed.effect, placed.sites) == (effect, (1,))
    assert dict(placed.values) == pytest.approx(values)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_a_step_never_leaves_what_is_allowed(effect):
    whole = make_claim_hypothesis(Claim(effect, "one", (0,)), [values_within_bounds(effect)])
    for far in (-1e9, 1e9):
        (placed,) = whole.list_placed_effects(np.full(len(whole.point), far))
        for p in effect.parameters:
            assert p.lower <= placed.values[p.name] <= p.upper


def test_every_axis_has_numbers_of_its_own_where_each_is_claimed():
    drag = EFFECTS["viscous_damping"]
    each = make_claim_hypothesis(
        Claim(drag, "each", (0, 1)), [{p.name: v for p in drag.parameters} for v in (0.5, 0.25)]
    )
    assert [item.sites for item in each.list_placed_effects()] == [(0,), (1,)]
    assert len(each.parameters) == 2 * sum(not p.fixed for p in drag.parameters)


def test_claims_are_put_together_and_taken_away_again():
    parts = [
        make_claim_hypothesis(Claim(EFFECTS[name], "one", (k,)), [values_within_bounds(EFFECTS[name])])
        for k, name in enumerate(("coulomb_friction", "extra_mode", "sensor_lag"))
    ]
    whole = combine_hypotheses(combine_hypotheses(parts[0], parts[1]), parts[2])
    assert [key[0] for key in whole.key] == ["coulomb_friction", "extra_mode", "sensor_lag"]
    less = remove_claim(whole, 1)
    expected = combine_hypotheses(parts[0], parts[2])
    assert less.key == expected.key and np.array_equal(less.point, expected.point)
    assert less.list_placed_effects() == expected.list_placed_effects()
    assert [each.effect.name for each in whole.list_effects_of(1)] == ["extra_mode"]


def test_nothing_is_the_beginning_of_all_claims():
    part = make_claim_hypothesis(
        Claim(EFFECTS["sensor_lag"], "one", (0,)), [values_within_bounds(EFFECTS["sensor_lag"])]
    )
    assert combine_hypotheses(NO_EFFECTS, part).list_placed_effects() == part.list_placed_effects()
    assert NO_EFFECTS.list_placed_effects() == ()


def gather_context_evidence(context):
    base = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    return gather_evidence(context.measure, context.tuning, base)[0]


def test_friction_in_the_data_suggests_friction_near_its_level(make_context):
    rubs = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.2}),)
    found = list_candidates([EFFECTS["coulomb_friction"]], gather_context_evidence(make_context(rubs)))
    assert 1 <= len(found) <= STARTS_PER_CLAIM
    assert found[0].list_placed_effects()[0].values["level"] == pytest.approx(0.2, rel=0.3)


def test_every_effect_is_suggested_at_every_axis_or_not_at_all(make_context):
    rubs = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.2}),)
    # Some, for the time that looking for starting values takes.
    some = CATALOGUE[::4]
    found = list_candidates(some, gather_context_evidence(make_context(rubs, axes=2)))
    order = [effect.name for effect in some]
    named = [item.claims[0].effect.name for item in found]
    assert named == sorted(named, key=order.index)
    for each in found:
        (claim,) = each.claims
        assert set(claim.sites) <= {0, 1}
        assert claim.spread == "one" or claim.sites == (0, 1)
        for number, at in zip(each.parameters, each.point, strict=True):
            low, high = number.bounds
            assert low - 1e-9 <= at <= high + 1e-9


def test_numbers_that_do_almost_the_same_are_tried_in_place_of_an_effects_own():
    parts = [
        make_claim_hypothesis(Claim(EFFECTS["sensor_lag"], "one", (0,)), [{"bandwidth": 60.0}]),
        make_claim_hypothesis(Claim(EFFECTS["force_deadband"], "one", (1,)), [{"width": 0.02, "jump": 0.25}]),
        make_claim_hypothesis(Claim(EFFECTS["constant_force"], "one", (0,)), [{"force": 0.1}]),
    ]
    (other,) = generate_near_equivalents(combine_hypotheses(combine_hypotheses(parts[0], parts[1]), parts[2]))
    lag, band, force = other.list_placed_effects()
    assert band.values == pytest.approx({"width": 0.015, "jump": 0.0})
    assert (lag.values["bandwidth"], force.values["force"]) == pytest.approx((60.0, 0.1))


def test_plain_numbers_have_nothing_else_to_try():
    plain = make_claim_hypothesis(Claim(EFFECTS["force_deadband"], "one", (0,)), [{"width": 0.02, "jump": 0.0}])
    assert not list(generate_near_equivalents(plain))
