"""Parameters that a fitted model holds already are not named; without repeats no verdict is `explained`."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.widened_tolerance import widen_tolerance

SEED = 4


@pytest.fixture(scope="module")
def diagnose_changed_reading(axis_module):
    """Of a linear axis whose reading is changed, with the model that was fitted to it."""
    from analysis.diagnosis.diagnose import diagnose
    from analysis.diagnosis.diagnosis_settings import DiagnosisSettings

    def of(changed, **physics):
        given = axis_module.record_axis(axis_module.Physics(**physics), SEED, seconds=10.0, rate_hz=200.0, noise=1e-4)
        response = replace(given.response, samples=changed(given.response.samples))
        recording = replace(given, response=response)
        model = widen_tolerance(fit_mechanical_model([recording], name="fitted").model)
        found = diagnose([recording], model, DiagnosisSettings(fitted=True), map, lambda said, share: None)
        return found.diagnosis

    return of


@pytest.mark.slow
def test_an_offset_of_the_reading_is_a_number_and_no_effect(diagnose_changed_reading):
    diagnosis = diagnose_changed_reading(lambda read: read + 0.02)
    assert not diagnosis.effects
    assert diagnosis.verdict in ("no_mismatch", "parameters", "unexplained")


@pytest.mark.slow
def test_a_late_reading_is_a_class_and_not_explained_without_repeats(diagnose_changed_reading):
    diagnosis = diagnose_changed_reading(lambda read: np.vstack([read[:3] * 0, read[:-3]]))
    assert diagnosis.verdict != "explained"
    for effect in diagnosis.effects:
        assert {"transport_delay", "logger_offset"} <= set(effect.class_)


@pytest.mark.parametrize("cubic", [pytest.param(2e5, marks=pytest.mark.slow), -1200.0])
def test_a_spring_that_hardens_or_softens_is_named_and_not_explained_without_repeats(diagnose_changed_reading, cubic):
    diagnosis = diagnose_changed_reading(lambda read: read, cubic=cubic)
    assert diagnosis.verdict == "partly_explained"
    assert [effect.effect for effect in diagnosis.effects] == ["hardening_stiffness"]
    assert diagnosis.effects[0].parameters["k3"].value == pytest.approx(cubic, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("seconds", "names"), [(10.0, ["coulomb_friction"]), (1.4, [])], ids=["long", "too short"])
def test_a_recording_that_is_too_short_to_name_physics_gets_candidates(axis_module, seconds, names):
    from analysis.diagnosis.diagnose import TOO_SHORT_TO_NAME, diagnose
    from analysis.diagnosis.diagnosis_settings import DiagnosisSettings

    recording = axis_module.record_axis(
        axis_module.Physics(coulomb=0.6), SEED, seconds=seconds, rate_hz=1000.0, noise=1e-7
    )
    model = widen_tolerance(fit_mechanical_model([recording], name="fitted").model)
    found = diagnose([recording], model, DiagnosisSettings(fitted=True), map, lambda said, share: None).diagnosis
    assert [effect.effect for effect in found.effects] == names
    if not names:
        assert found.verdict == "unexplained"
        assert (found.candidates[0].effect, found.candidates[0].why_not) == ("coulomb_friction", TOO_SHORT_TO_NAME)


@pytest.mark.slow
def test_a_short_recording_gets_no_name_by_the_search_either(axis_module):
    """Its readings are clipped, which a search by simulation would name."""
    from analysis.diagnosis.diagnose import diagnose
    from analysis.diagnosis.diagnosis_settings import DiagnosisSettings

    whole = axis_module.record_axis(axis_module.Physics(), SEED, seconds=1.4, rate_hz=1000.0, noise=1e-7)
    top = 0.5 * np.abs(whole.response.samples).max()
    clipped = replace(whole, response=replace(whole.response, samples=np.clip(whole.response.samples, -top, top)))
    model = widen_tolerance(fit_mechanical_model([clipped], name="fitted").model)
    found = diagnose([clipped], model, DiagnosisSettings(fitted=True), map, lambda said, share: None).diagnosis
    assert (found.effects, found.verdict) == ((), "unexplained")
