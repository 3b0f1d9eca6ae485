"""A model whose parameters are off by more than its calibration says is moved further, where nothing else explains."""

from dataclasses import replace

import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.limits import RETUNING_BOUND, WIDER_RETUNING_BOUND
from analysis.diagnosis.search.search import repeat_with_wider_bound, search_effects
from analysis.diagnosis.search.time_budget import OUT_OF_TIME, CountedBudget
from analysis.diagnosis.search.verdict import MODEL_MOVED
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import PlacedEffect
from tests.diagnosed import FRICTION_N, RUBBING, device, recorded

TRIED = ("coulomb_friction", "added_mass", "force_deadband")


def ignore_progress(said, share):
    pass


SETTINGS = DiagnosisSettings(without=tuple(e.name for e in CATALOGUE if e.name not in TRIED), discovery=False)


def model_off_by(deviations):
    """The device's model with a stiffness that is off by so many standard deviations of its calibration."""
    model = device(1)
    assert model.tolerance is not None
    return replace(model, stiffness=model.stiffness + deviations * model.tolerance.stiffness_n_per_m)


def diagnose_with(model, effects=RUBBING):
    return diagnose([recorded(1, effects)], model, SETTINGS, map, lambda said, share: None)


@pytest.fixture(scope="module")
def far_diagnosis():
    return diagnose_with(model_off_by(9.0))


@pytest.mark.slow
def test_friction_is_found_beside_a_stiffness_far_from_its_calibration(far_diagnosis):
    assert far_diagnosis.diagnosis.verdict == "explained"
    (named,) = far_diagnosis.diagnosis.effects
    assert named.effect == "coulomb_friction"
    assert named.parameters["level"].value == pytest.approx(FRICTION_N, rel=0.05)
    deviations = dict(zip(far_diagnosis.tuning.names, far_diagnosis.explanation.after.fitted.deviations, strict=True))
    assert deviations["stiffness fx"] == pytest.approx(-9.0, abs=0.5)


@pytest.mark.slow
def test_what_was_moved_is_said(far_diagnosis):
    assert MODEL_MOVED in far_diagnosis.remarks
    assert far_diagnosis.tuning.bound == WIDER_RETUNING_BOUND


@pytest.mark.slow
def test_beyond_the_wider_bound_nothing_is_explained():
    found = diagnose_with(model_off_by(1.2 * WIDER_RETUNING_BOUND))
    assert found.diagnosis.verdict != "explained"
    assert MODEL_MOVED not in found.remarks
    assert found.tuning.bound == RETUNING_BOUND


def test_of_parameters_alone_nothing_is_named():
    model = device(1)
    assert model.tolerance is not None
    off = replace(model, damping=model.damping + 9.0 * model.tolerance.damping_n_s_per_m)
    found = diagnose_with(off, ())
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("parameters", ())
    assert MODEL_MOVED in found.remarks


@pytest.mark.slow
def test_without_time_or_effects_to_try_the_model_does_not_move_further(make_context):
    context = make_context(RUBBING, model_off_by(9.0))
    first = search_effects(context, [], ignore_progress)
    assert first.judgement.verdict == "unexplained"
    friction = [EFFECTS["coulomb_friction"]]
    assert repeat_with_wider_bound(context, first, [], ignore_progress) is first
    assert repeat_with_wider_bound(context, first, friction, ignore_progress, lambda: False) is first
    beside = replace(first, context=replace(context, certain=(NO_EFFECTS,)))
    assert repeat_with_wider_bound(beside.context, beside, friction, ignore_progress) is beside
    assert repeat_with_wider_bound(context, first, friction, ignore_progress).judgement.verdict == "explained"
    # Where time ends on the way, the page says so.
    begun = repeat_with_wider_bound(context, first, friction, ignore_progress, CountedBudget(2))
    assert begun.found is first.found
    assert begun.remarks == (*first.remarks, OUT_OF_TIME)


@pytest.mark.slow
def test_an_effect_that_a_model_could_take_up_is_named_first():
    tolerance = device(1).tolerance
    assert tolerance is not None
    heavier = PlacedEffect(EFFECTS["added_mass"], (0,), {"mass": 8.0 * tolerance.mass_kg})
    found = diagnose_with(device(1), (heavier,))
    assert [named.effect for named in found.diagnosis.effects] == ["added_mass"]
    assert found.tuning.bound == RETUNING_BOUND
