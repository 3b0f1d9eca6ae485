"""A force at an axis feels what changes that axis's motion, and the rest need not be simulated with it."""

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import sensitivity
from analysis.diagnosis.search.search_context import sensitive_parameters, sensitivity_at
from equalizer.effects.catalogue import EFFECTS


@pytest.fixture(scope="module")
def context(arena_of):
    return arena_of(axes=2)


@pytest.fixture(scope="module")
def at(context):
    return np.zeros(len(context.tuning.names))


def rubbing(*sites):
    return hypothesis_of_claim(Claim(EFFECTS["coulomb_friction"], "one", sites), [{"level": 0.1}])


def names_felt(context, at, hypothesis):
    plain = sensitivity(context.measure, context.tuning, at, NOTHING)
    return {context.tuning.names[n] for n in sensitive_parameters(context.measure, context.tuning, plain, hypothesis)}


def test_a_force_at_x_feels_the_numbers_of_x_and_not_those_of_y(context, at):
    felt = names_felt(context, at, rubbing(0))
    assert {"mass fx", "damping fx", "stiffness fx"} <= felt
    assert not {"mass fy", "damping fy", "stiffness fy"} & felt


def test_nothing_is_left_out_where_no_axis_is_known(context, at):
    assert names_felt(context, at, NOTHING) == set(context.tuning.names)


def test_columns_beside_friction_are_those_of_all_numbers_moved_beside_it(context, at):
    whole = sensitivity(context.measure, context.tuning, at, rubbing(0))
    saved = sensitivity_at(context, at, rubbing(0), with_forces=True)
    apart = np.linalg.norm(whole.columns - saved.columns, axis=1)
    assert (apart <= 0.1 * np.linalg.norm(whole.columns, axis=1)).all()
    assert saved.squares == pytest.approx(saved.columns @ saved.columns.T)
    without = sensitivity_at(context, at, rubbing(0))
    told = context.tuning.names.index("mass fx")
    assert np.linalg.norm(whole.columns[told] - without.columns[told]) > np.linalg.norm(apart)


def test_columns_that_were_known_stay_as_they_were(context, at):
    plain = sensitivity(context.measure, context.tuning, at, NOTHING)
    before = plain.columns.copy()
    sensitivity(context.measure, context.tuning, at, rubbing(0), beside=(plain.columns, [0]))
    assert np.array_equal(plain.columns, before)
