"""Samples that were not measured, and models that run away, end no diagnosis."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.data.recorded_conditions import is_unstable_within
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import build_jacobian, evaluate_fit, fit
from analysis.diagnosis.errors.tuning import make_tuning
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.linear_simulation import compute_growth_rate
from equalizer.plant.mechanical_model import Tolerance

TRIED = ("coulomb_friction", "sensor_clipping", "hardening_stiffness")
GAP = slice(3500, 3650)


@pytest.fixture(scope="module")
def device_module(module_at):
    return module_at(Path(__file__).parents[3] / "diagnosed.py")


@pytest.fixture(scope="module")
def gapped_recording(device_module):
    one = device_module.recorded(1)
    response, position = one.response.samples.copy(), one.position.samples.copy()
    response[GAP] = position[GAP] = np.nan
    return replace(
        one, response=replace(one.response, samples=response), position=replace(one.position, samples=position)
    )


def test_every_estimator_sees_whole_courses_of_a_recording_with_a_gap(device_module, gapped_recording, make_context):
    from analysis.diagnosis.errors.choose_measure import make_measure

    model = device_module.device(1)
    measure = make_measure([gapped_recording], model).measure
    evidence = measure.evidence(model, (), measure.residuals(model, ()))[0]
    for each in (evidence.response, evidence.predicted, evidence.position, evidence.predicted_position):
        assert each is not None and np.isfinite(each).all()
    np.testing.assert_array_equal(evidence.response[GAP], evidence.predicted[GAP])
    assert (evidence.used[GAP] == 0).all() and evidence.used[:3000].any()
    for effect in CATALOGUE:
        effect.starts(evidence, 0)


@pytest.mark.slow
def test_friction_is_named_in_spite_of_a_gap(device_module, gapped_recording):
    others = tuple(effect.name for effect in CATALOGUE if effect.name not in TRIED)
    found = diagnose(
        [gapped_recording], device_module.device(1), DiagnosisSettings(without=others), map, lambda said, share: None
    )
    assert [(effect.effect, effect.axis) for effect in found.diagnosis.effects] == [("coulomb_friction", "x")]
    assert found.diagnosis.effects[0].parameters["level"].value == pytest.approx(device_module.FRICTION_N, rel=0.03)


def test_growth_is_distinguished_from_motion_that_dies_out(device_module):
    model = device_module.device(1)
    assert compute_growth_rate(model) == pytest.approx(-8.0)
    assert not is_unstable_within(model, 1000.0)
    pushed = replace(model, damping=-model.damping)
    assert is_unstable_within(pushed, 1.0) and not is_unstable_within(pushed, 0.1)


def test_a_fit_with_wide_tolerances_stays_with_models_that_hold_themselves(device_module):
    from analysis.diagnosis.errors.choose_measure import make_measure

    recording = device_module.recorded(1, effects=())
    given = replace(
        device_module.device(1),
        damping=np.array([[0.4]]),
        stiffness=np.array([[60.0]]),
        tolerance=Tolerance(0.1, 4.0, 400.0),
    )
    measure = make_measure([recording], given).measure
    tuning = make_tuning(given, ("fx",))
    start = evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), NO_EFFECTS)
    found = start
    for _ in range(4):
        found = fit(measure, tuning, found, build_jacobian(measure, tuning, found.deviations, NO_EFFECTS), 4)
    assert found.cost < start.cost / 10
    assert not is_unstable_within(tuning.tune(found.deviations), 12.0)
    # Where a number is moved to see what it does, it may run away: that way is not looked.
    at = np.array([0.0, -0.02 - given.damping[0, 0] / 4.0, 0.0])
    assert np.isfinite(build_jacobian(measure, tuning, at, NO_EFFECTS).columns).all()
