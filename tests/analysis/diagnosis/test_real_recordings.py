"""Public recordings of real devices, where they lie beside the checkout: nothing of them is in the project."""

from pathlib import Path

import pytest

from analysis.diagnosis.data.measured_motion import convert_to_force_driven
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.forces.rigid_model import fit_rigid_model
from study.workflows.recording.import_recording import read_foreign

FRICTION = {"coulomb_friction", "asymmetric_friction", "stribeck_friction"}


def find_folder(shared: Path, name: str) -> Path:
    if not (found := shared / "recordings" / name).is_dir():
        pytest.skip(f"the recordings of {name} are not beside this checkout")
    return found


@pytest.mark.slow
def test_a_positioning_axis_rubs_one_way_more_than_the_other(shared: Path) -> None:
    recording = read_foreign((find_folder(shared, "emps"),), "emps").recording
    model = fit_rigid_model([recording], "fitted")
    findings = diagnose([recording], model, DiagnosisSettings(), map, lambda said, share: None)
    first = findings.diagnosis.effects[0]
    assert findings.diagnosis.error == "predicted force"
    assert findings.diagnosis.verdict == "partly_explained"
    assert first.effect in FRICTION
    assert findings.improved.mass[0, 0] == pytest.approx(95.1, rel=0.01)
    test = findings.diagnosis.fit.test
    assert test.after <= 0.28 * test.retuned


def test_a_positioning_axis_is_compared_by_forces(shared: Path) -> None:
    recording = read_foreign((find_folder(shared, "emps"),), "emps").recording
    model = fit_rigid_model([recording], "fitted")
    assert model.mass[0, 0] == pytest.approx(95.1, rel=0.02)
    chosen = make_measure([recording], model)
    assert chosen.measure.name == "predicted force"
    fitted, tested = chosen.measure.records
    assert fitted.fit.any() and fitted.choose.any() and not fitted.test.any()
    assert tested.test.any() and not (tested.fit | tested.choose).any()


def test_a_rack_that_was_driven_by_its_speed_is_compared_by_forces(shared: Path) -> None:
    recording = convert_to_force_driven(read_foreign((find_folder(shared, "rack_drive"),), "rack_drive").recording)
    model = fit_rigid_model([recording], "fitted")
    assert model.mass[0, 0] == pytest.approx(24.7, rel=0.15)
    assert make_measure([recording], model).measure.name == "predicted force"


def test_steps_of_a_haptic_lever_are_compared_part_by_part(shared: Path) -> None:
    recording = read_foreign((find_folder(shared, "haptic_paddle"),), "haptic_paddle_steps").recording
    chosen = make_measure([recording], fit_rigid_model([recording], "fitted"))
    assert chosen.measure.name == "predicted force"
    assert len(chosen.measure.records) == 9
