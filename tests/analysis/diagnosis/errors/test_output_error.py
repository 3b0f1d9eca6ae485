"""Fits find parameters that were invented, and stay where the data say nothing."""

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import (
    build_jacobian,
    evaluate_fit,
    fit,
    solve_bounded_step,
    stack_fit_residuals,
)
from analysis.diagnosis.limits import RETUNING_BOUND
from analysis.diagnosis.search.compare_candidates import refine
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect

FRICTION_N, LAG_S = 0.2, 1.5e-3


def make_hypothesis(name, values):
    return make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])


def fit_hypothesis(context, hypothesis):
    zero = np.zeros(len(context.tuning.names))
    start = evaluate_fit(context.measure, context.tuning, zero, hypothesis)
    known = build_jacobian(context.measure, context.tuning, zero, NO_EFFECTS)
    return refine(context, fit(context.measure, context.tuning, start, known, 4))


@pytest.fixture(scope="module")
def friction_context(make_context):
    return make_context((PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": FRICTION_N}),))


def make_deviations(tuning, **deviations):
    at = np.zeros(len(tuning.names))
    for name, value in deviations.items():
        at[tuning.names.index(name.replace("_", " "))] = value
    return at


def test_the_model_s_own_numbers_are_found(make_context):
    truth = make_context()
    wrong = make_deviations(truth.tuning, mass_fx=-2.0, damping_fx=1.5, stiffness_fx=-1.0)
    context = make_context(given=truth.tuning.tune(wrong))
    found = fit_hypothesis(context, NO_EFFECTS)
    assert found.deviations == pytest.approx(-wrong, abs=0.15)
    assert context.score_fit(found).score.worst_channel < 1.03


def test_a_number_that_fits_as_it_is_stays(make_context):
    found = fit_hypothesis(make_context(), NO_EFFECTS)
    assert np.abs(found.deviations).max() < 0.2


@pytest.mark.parametrize("start", [0.05, 0.6])
def test_friction_is_found_from_far_away(friction_context, start):
    found = fit_hypothesis(friction_context, make_hypothesis("coulomb_friction", {"level": start}))
    assert found.hypothesis.list_placed_effects()[0].values["level"] == pytest.approx(FRICTION_N, rel=2e-3)
    assert friction_context.score_fit(found).score.worst_channel < 1.03


@pytest.mark.slow
def test_two_effects_are_found_at_once(make_context):
    truth = (
        PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": FRICTION_N}),
        PlacedEffect(EFFECTS["amplifier_lag"], (0,), {"time_constant": LAG_S}),
    )
    both = combine_hypotheses(
        make_hypothesis("coulomb_friction", {"level": 0.1}), make_hypothesis("amplifier_lag", {"time_constant": 1e-3})
    )
    rubs, lags = fit_hypothesis(make_context(truth), both).hypothesis.list_placed_effects()
    assert rubs.values["level"] == pytest.approx(FRICTION_N, rel=5e-3)
    assert lags.values["time_constant"] == pytest.approx(LAG_S, rel=5e-3)


def test_a_wrong_law_does_not_come_down_to_the_noise(friction_context):
    found = fit_hypothesis(friction_context, make_hypothesis("hardening_stiffness", {"k3": 1e4}))
    assert friction_context.score_fit(found).score.worst_channel > 3


def test_a_fit_is_never_worse_than_its_start(friction_context):
    zero = np.zeros(len(friction_context.tuning.names))
    known = build_jacobian(friction_context.measure, friction_context.tuning, zero, NO_EFFECTS)
    for level in (1e-3, 0.2, 3.0):
        start = evaluate_fit(
            friction_context.measure,
            friction_context.tuning,
            zero,
            make_hypothesis("coulomb_friction", {"level": level}),
        )
        assert fit(friction_context.measure, friction_context.tuning, start, known, 3).cost <= start.cost


@pytest.mark.slow
def test_the_same_start_gives_the_same_fit(friction_context):
    one, other = (
        fit_hypothesis(friction_context, make_hypothesis("coulomb_friction", {"level": 0.1})) for _ in range(2)
    )
    assert one.cost == other.cost and np.array_equal(one.deviations, other.deviations)


def test_numbers_stay_within_what_calibration_and_physics_allow(make_context):
    truth = make_context()
    far = make_deviations(truth.tuning, mass_fx=-9.0)
    found = fit_hypothesis(make_context(given=truth.tuning.tune(far)), NO_EFFECTS)
    assert found.deviations[0] == pytest.approx(RETUNING_BOUND)
    assert np.abs(found.deviations).max() <= RETUNING_BOUND


def test_sealed_samples_are_not_fitted_to(friction_context):
    left = evaluate_fit(friction_context.measure, friction_context.tuning, np.zeros(3), NO_EFFECTS).residuals
    (record,) = friction_context.measure.records
    assert len(stack_fit_residuals(friction_context.measure, left)) == record.fit.sum() * record.measured.shape[1]
    assert not record.test.any()


def test_a_sensitivity_predicts_the_effect_of_a_small_change(make_context):
    context = make_context()
    zero = np.zeros(len(context.tuning.names))
    known = build_jacobian(context.measure, context.tuning, zero, NO_EFFECTS)
    step = make_deviations(context.tuning, damping_fx=0.05)
    base, there = (
        stack_fit_residuals(context.measure, context.measure.residuals(context.tuning.tune(at), ()))
        for at in (zero, step)
    )
    assert base - there == pytest.approx(step @ known.columns, abs=0.02 * np.abs(base - there).max())
    assert known.gram == pytest.approx(known.columns @ known.columns.T)


def test_a_step_within_bounds_is_the_best_one():
    random = np.random.default_rng(5)
    for _ in range(30):
        rows = random.normal(size=(12, 4))
        products, rhs = rows.T @ rows, rows.T @ random.normal(size=12)
        low, high = -random.uniform(0, 0.3, 4), random.uniform(0, 0.3, 4)
        step = solve_bounded_step(products, rhs, low, high)
        assert ((step >= low - 1e-12) & (step <= high + 1e-12)).all()
        free = np.linalg.solve(products, rhs)
        if ((free >= low) & (free <= high)).all():
            assert step == pytest.approx(free)

        def cost(at, products=products, rhs=rhs):
            return at @ products @ at - 2 * rhs @ at

        nothing = cost(np.zeros(4))
        assert cost(step) <= nothing + 1e-12


class DivergingMeasure:
    """A measure whose simulation diverges as soon as a parameter of the model moves."""

    def __init__(self, measure, size):
        self.records, self.measure, self.size = measure.records, measure, size

    def residuals(self, model, effects):
        return tuple(np.full_like(left, self.size) for left in self.measure.residuals(model, effects))


@pytest.mark.parametrize("size", [1e200, np.inf])
def test_a_simulation_that_ran_away_is_the_worst_of_fits(friction_context, size):
    zero = np.zeros(len(friction_context.tuning.names))
    known = build_jacobian(friction_context.measure, friction_context.tuning, zero, NO_EFFECTS)
    measure = DivergingMeasure(friction_context.measure, size)
    start = evaluate_fit(measure, friction_context.tuning, zero, make_hypothesis("coulomb_friction", {"level": 0.1}))
    assert start.cost == np.inf
    assert fit(measure, friction_context.tuning, start, known, 2) is start
    assert not build_jacobian(measure, friction_context.tuning, zero, NO_EFFECTS).columns.any()
