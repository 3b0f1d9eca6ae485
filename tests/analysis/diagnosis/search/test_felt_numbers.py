"""A force at an axis feels what changes that axis's motion, and the rest need not be simulated with it."""

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, claimed
from analysis.diagnosis.errors.output_error import sensitivity
from analysis.diagnosis.search.rivalry import felt_numbers, sensitivity_at
from equalizer.effects.catalogue import EFFECTS


@pytest.fixture(scope="module")
def arena(arena_of):
    return arena_of(axes=2)


@pytest.fixture(scope="module")
def at(arena):
    return np.zeros(len(arena.tuning.names))


def rubbing(*sites):
    return claimed(Claim(EFFECTS["coulomb_friction"], "one", sites), [{"level": 0.1}])


def names_felt(arena, at, hypothesis):
    plain = sensitivity(arena.measure, arena.tuning, at, NOTHING)
    return {arena.tuning.names[n] for n in felt_numbers(arena.measure, arena.tuning, plain, hypothesis)}


def test_a_force_at_x_feels_the_numbers_of_x_and_not_those_of_y(arena, at):
    felt = names_felt(arena, at, rubbing(0))
    assert {"mass fx", "damping fx", "stiffness fx"} <= felt
    assert not {"mass fy", "damping fy", "stiffness fy"} & felt


def test_nothing_is_left_out_where_no_axis_is_known(arena, at):
    assert names_felt(arena, at, NOTHING) == set(arena.tuning.names)


def test_columns_beside_friction_are_those_of_all_numbers_moved_beside_it(arena, at):
    whole = sensitivity(arena.measure, arena.tuning, at, rubbing(0))
    saved = sensitivity_at(arena, at, rubbing(0), with_forces=True)
    apart = np.linalg.norm(whole.columns - saved.columns, axis=1)
    assert (apart <= 0.1 * np.linalg.norm(whole.columns, axis=1)).all()
    assert saved.squares == pytest.approx(saved.columns @ saved.columns.T)
    without = sensitivity_at(arena, at, rubbing(0))
    told = arena.tuning.names.index("mass fx")
    assert np.linalg.norm(whole.columns[told] - without.columns[told]) > np.linalg.norm(apart)


def test_columns_that_were_known_stay_as_they_were(arena, at):
    plain = sensitivity(arena.measure, arena.tuning, at, NOTHING)
    before = plain.columns.copy()
    sensitivity(arena.measure, arena.tuning, at, rubbing(0), beside=(plain.columns, [0]))
    assert np.array_equal(plain.columns, before)
