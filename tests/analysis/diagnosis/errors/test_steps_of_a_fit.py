"""Steps of a fit go on where one number of the model would leave what a mechanical model can have."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import build_jacobian, evaluate_fit, fit
from analysis.diagnosis.errors.tuning import make_tuning
from equalizer.plant.mechanical_model import Tolerance


class LinearMeasure:
    """A measure whose errors are straight lines in mass, damping and stiffness, zero at `best`."""

    def __init__(self, measure, best):
        self.records, self.best = measure.records, best
        random = np.random.default_rng(4)
        own = random.normal(size=(3, sum(len(record.command) for record in measure.records)))
        # Much alike, as accelerations and speeds in a narrow band are: a shorter step is none that leads elsewhere.
        self.courses = own + own.sum(axis=0)

    def residuals(self, model, effects):
        numbers = np.array([each[0, 0] for each in (model.mass, model.damping, model.stiffness)])
        left, found, begin = (numbers / self.best - 1) @ self.courses, [], 0
        for record in self.records:
            count, channels = record.measured.shape
            found.append(np.repeat(left[begin : begin + count, None], channels, axis=1))
            begin += count
        return tuple(found)


def fit_parameters(context, start, best):
    """Mass, damping and stiffness that a fit finds."""
    mass, damping, stiffness = (np.array([[each]]) for each in start)
    plant = replace(context.tuning.model, mass=mass, damping=damping, stiffness=stiffness)
    plant = replace(plant, tolerance=Tolerance(*(10 * abs(each) for each in best)))
    tuning, measure = make_tuning(plant, ("fx",)), LinearMeasure(context.measure, np.array(best))
    zero = np.zeros(3)
    known = build_jacobian(measure, tuning, zero, NO_EFFECTS)
    found = tuning.tune(fit(measure, tuning, evaluate_fit(measure, tuning, zero, NO_EFFECTS), known, 6).deviations)
    return [float(each[0, 0]) for each in (found.mass, found.damping, found.stiffness)]


@pytest.fixture(scope="module")
def context(make_context):
    return make_context()


def test_numbers_within_reach_are_found(context):
    assert fit_parameters(context, (0.1, 1.0, 100.0), (0.2, 3.0, 150.0)) == pytest.approx((0.2, 3.0, 150.0), rel=1e-3)


def test_a_mass_that_is_best_below_zero_does_not_hold_the_other_numbers_back(context):
    mass, damping, stiffness = fit_parameters(context, (1e-3, 1.0, 100.0), (-1.0, 3.0, 150.0))
    assert mass > 0
    assert damping > 2.0 and stiffness > 120.0


def test_a_model_that_grows_by_itself_may_still_be_fitted(context):
    assert fit_parameters(context, (0.1, 1.0, -50.0), (0.2, 3.0, -20.0)) == pytest.approx((0.2, 3.0, -20.0), rel=1e-3)


def test_no_step_leads_from_a_model_that_decays_to_one_that_grows(context):
    *_, stiffness = fit_parameters(context, (0.1, 1.0, 50.0), (0.1, 1.0, -50.0))
    assert stiffness > -1e-2
