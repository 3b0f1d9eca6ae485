"""What can stand beside what."""

import pytest

from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.search.parsimony import FAMILIES, are_exclusive
from equalizer.effects.catalogue import CATALOGUE, EFFECTS


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
