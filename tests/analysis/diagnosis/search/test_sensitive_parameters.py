"""A force at an axis feels what changes that axis's motion, and the rest need not be simulated with it."""

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import build_jacobian
from analysis.diagnosis.search.search_context import compute_sensitivity, find_sensitive_parameters
from equalizer.effects.catalogue import EFFECTS


@pytest.fixture(scope="module")
def context(make_context):
    return make_context(axes=2)


@pytest.fixture(scope="module")
def zero_deviations(context):
    return np.zeros(len(context.tuning.names))


def friction_hypothesis(*sites):
    return make_claim_hypothesis(Claim(EFFECTS["coulomb_friction"], "one", sites), [{"level": 0.1}])


def sensitive_names(context, zero_deviations, hypothesis):
    plain = build_jacobian(context.measure, context.tuning, zero_deviations, NO_EFFECTS)
    return {
        context.tuning.names[n] for n in find_sensitive_parameters(context.measure, context.tuning, plain, hypothesis)
    }


def test_a_force_at_x_feels_the_numbers_of_x_and_not_those_of_y(context, zero_deviations):
    felt = sensitive_names(context, zero_deviations, friction_hypothesis(0))
    assert {"mass fx", "damping fx", "stiffness fx"} <= felt
    assert not {"mass fy", "damping fy", "stiffness fy"} & felt


def test_nothing_is_left_out_where_no_axis_is_known(context, zero_deviations):
    assert sensitive_names(context, zero_deviations, NO_EFFECTS) == set(context.tuning.names)


def test_columns_beside_friction_are_those_of_all_numbers_moved_beside_it(context, zero_deviations):
    whole = build_jacobian(context.measure, context.tuning, zero_deviations, friction_hypothesis(0))
    saved = compute_sensitivity(context, zero_deviations, friction_hypothesis(0), with_forces=True)
    apart = np.linalg.norm(whole.columns - saved.columns, axis=1)
    assert (apart <= 0.1 * np.linalg.norm(whole.columns, axis=1)).all()
    assert saved.gram == pytest.approx(saved.columns @ saved.columns.T)
    without = compute_sensitivity(context, zero_deviations, friction_hypothesis(0))
    told = context.tuning.names.index("mass fx")
    assert np.linalg.norm(whole.columns[told] - without.columns[told]) > np.linalg.norm(apart)


def test_columns_that_were_known_stay_as_they_were(context, zero_deviations):
    plain = build_jacobian(context.measure, context.tuning, zero_deviations, NO_EFFECTS)
    before = plain.columns.copy()
    build_jacobian(
        context.measure, context.tuning, zero_deviations, friction_hypothesis(0), known_columns=(plain.columns, [0])
    )
    assert np.array_equal(plain.columns, before)
