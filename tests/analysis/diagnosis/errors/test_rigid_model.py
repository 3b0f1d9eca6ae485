"""A rigid model fitted to forces, where no model was given."""

from dataclasses import replace

import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.forces.rigid_model import can_be_rigid, fit_rigid_model, should_use_rigid_model
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.recording import Recording
from tests.analysis.diagnosis.errors.drifting_plant import DRAG, LEVEL, MASS, random_course, record_plant


def test_a_rigid_model_is_fitted_to_the_forces_under_a_controller() -> None:
    clean = record_plant(0.08 * random_course(12.0, 3), controlled=True, level=0.0)
    assert should_use_rigid_model([clean])
    fitted = fit_rigid_model([clean], "fitted")
    assert fitted.mass[0, 0] == pytest.approx(MASS, rel=0.01)
    assert fitted.damping[0, 0] == pytest.approx(DRAG, rel=0.03)
    assert fitted.stiffness[0, 0] == 0.0


@pytest.mark.slow
def test_friction_is_named_beside_a_model_that_was_fitted_first(controlled_recording: Recording) -> None:
    others = tuple(each.name for each in CATALOGUE if each.name not in ("coulomb_friction", "transport_delay"))
    fitted = fit_rigid_model([controlled_recording], "fitted")
    assert fitted.damping[0, 0] > 1.5 * DRAG
    findings = diagnose(
        [controlled_recording], fitted, DiagnosisSettings(without=others), map, lambda said, share: None
    )
    assert [effect.effect for effect in findings.diagnosis.effects] == ["coulomb_friction"]
    assert findings.named[0].values["level"] == pytest.approx(LEVEL, rel=0.05)


def test_no_rigid_model_is_asked_of_accelerations_alone(controlled_recording: Recording) -> None:
    felt = replace(
        controlled_recording, response=replace(controlled_recording.response, quantity="acceleration", unit="m/s^2")
    )
    assert not can_be_rigid([felt])
    with pytest.raises(MechanicalModelError, match="neither positions nor velocities"):
        fit_rigid_model([felt], "fitted")
