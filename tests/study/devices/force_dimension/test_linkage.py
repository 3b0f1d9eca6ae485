"""The linkage as the vendor's library tells it, over a stub whose linkage is known and solved by brute force."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.linkage.grid import compute_difference_error, estimate_arm_azimuths, list_difference_positions
from study.devices.clock import VirtualClock
from study.devices.opening import open_device, open_linkage
from study.devices.simulated.simulated_linkage import fit_linkage
from study.errors import DeviceError, ExitCode, StudyError, WrongUseError
from study.store.formats.calibration_file import read_calibration
from study.workflows.recording.calibrate_linkage import CalibrationPlan, calibrate_linkage

ARM_M, FOREARM_M, RIM_M, DEPTH_M = 1.02 * 0.098, 0.171, 0.058, 0.158
HANDLE_KG, TURNING_KG_M2 = 0.21, 0.0013
"""As in dhd_linkage.h."""


@pytest.fixture
def calibrated(stub, tmp_path):
    def calibrate(**switches):
        for name, value in switches.items():
            stub.set(name, value)
        return calibrate_linkage(CalibrationPlan(tmp_path / "cal.h5", "omega3"), lambda share: None)

    return calibrate


def test_nothing_moves_and_no_force_is_taken(stub, calibrated):
    stub.set("stiffness", 50.0)
    written = calibrated()
    assert (written.calibration.filled == 0).sum() == 185
    # At the end, as whenever a device is let go, a single zero is sent: never a force, and none is taken.
    assert (stub.get("enables"), stub.get("peak_n"), stub.get("last_write")) == (0, 0, 0)
    assert stub.safe and not stub.get("opened")


@pytest.mark.slow
def test_the_readings_are_of_the_linkage_behind_the_library(calibrated, tmp_path):
    written = calibrated()
    calibration = read_calibration(tmp_path / "cal.h5")
    np.testing.assert_array_equal(calibration.inertia_kg, written.calibration.inertia_kg)
    assert (calibration.device, calibration.details) == ("omega.3", "serial 4242, firmware 2.41, SDK 3.17.5.0")
    np.testing.assert_allclose(calibration.line_deg, [90.0, -150.0, -30.0], atol=0.2)
    assert calibration.asymmetry.max() < 1e-3 and written.warnings == () and written.unknown_count == 0
    assert calibration.difference < 0.01
    rates = np.linalg.inv(calibration.jacobian)
    inertia = HANDLE_KG * np.eye(3) + TURNING_KG_M2 * np.einsum("nki,nkj->nij", rates, rates)
    np.testing.assert_allclose(calibration.inertia_kg, inertia, atol=1e-6)
    # Level arms weigh most: beside the handle's own weight some 10 % of it.
    held = calibration.gravity_n - np.array([0.0, 0.0, 9.81 * HANDLE_KG])
    assert 0.05 < np.abs(held).max() < 0.6


def test_the_jacobian_is_the_derivative_of_positions_by_joint_angles(stub):
    """Oracle: central differences of the library's own positions, by its encoder counts."""
    with open_linkage("omega3") as linkage:
        for place in np.array([[0.0, 0, 0], [0.03, -0.02, 0.04], [-0.04, 0.05, 0.0]]):
            angles = np.array([linkage.compute_angles_at(each) for each in list_difference_positions(place)])
            assert (
                compute_difference_error(
                    linkage.compute_reading_at(place).jacobian, list_difference_positions(place), angles
                )
                < 0.01
            )


@pytest.mark.slow
def test_lengths_and_masses_are_recovered(calibrated):
    fitted = fit_linkage(calibrated().calibration)
    found, masses = fitted.parameters.linkage, fitted.parameters.masses
    told = (found.upper_arm_m, found.forearm_m, found.radius_m, found.depth_m)
    np.testing.assert_allclose(told, (ARM_M, FOREARM_M, RIM_M, DEPTH_M), rtol=1e-3)
    assert masses.handle_kg + masses.forearm_kg == pytest.approx(HANDLE_KG, rel=1e-3)
    turning = masses.upper_arm_kg_m2 + 2 / 3 * masses.forearm_kg * found.upper_arm_m**2 + masses.drive_kg_m2
    assert turning == pytest.approx(TURNING_KG_M2, rel=1e-3)
    assert fitted.jacobian_misfit < 1e-3 and fitted.inertia_misfit < 1e-3


@pytest.mark.slow
def test_a_device_that_stands_turned_has_its_lines_turned(calibrated):
    calibration = calibrated(linkage_turned_deg=15.0).calibration
    np.testing.assert_allclose(calibration.line_deg, [105.0, -135.0, -15.0], atol=0.2)
    assert calibration.asymmetry.max() < 1e-3


@pytest.mark.slow
def test_an_arm_unlike_the_others_is_named_and_no_simulation_pretends_to_have_it(calibrated):
    written = calibrated(odd_arm=0.3)
    assert len(written.warnings) == 3 and "The line at -150 degrees is a line of symmetry" in written.warnings[-1]
    assert sorted(np.round(written.calibration.asymmetry, 2))[0] == 0.0
    assert fit_linkage(written.calibration).inertia_misfit > 0.02


@pytest.mark.slow
def test_what_is_out_of_reach_is_filled_in_by_mirror_lines(calibrated, tmp_path):
    whole = calibrated().calibration
    (tmp_path / "cal.h5").unlink()
    part = calibrated(reach_z_m=0.03)
    found = part.calibration
    assert found.filled.sum() == 20 and part.unknown_count == 0
    for number in np.flatnonzero(found.filled):
        same = int(np.argmin(np.linalg.norm(whole.position_m - found.position_m[number], axis=1)))
        np.testing.assert_allclose(found.inertia_kg[number], whole.inertia_kg[same], rtol=0.01, atol=1e-3)
        np.testing.assert_allclose(found.jacobian[number], whole.jacobian[same], rtol=0.01, atol=1e-4)


FAULTS = {
    ("bad_jacobian", 1): "differs from finite differences of its own positions by 170%",
    ("bad_jacobian", 2): "the Jacobian is singular",
    ("bad_jacobian", 3): "the Jacobian contains a value that is not a number",
    ("bad_inertia", 1): "the inertia is not symmetric",
    ("bad_inertia", 2): "the inertia is not positive definite",
    ("bad_inertia", 3): "the inertia contains a value that is not a number",
    ("frame_off_m", 0.01): "another position for the handle than its joint angles",
    ("calibrated", 0): "does not know where its handle is",
    ("unplugged", 1): "No device of the vendor answers",
}


@pytest.mark.parametrize(("switch", "said"), FAULTS.items())
def test_what_cannot_be_is_refused_with_a_remedy_and_nothing_is_written(stub, calibrated, tmp_path, switch, said):
    with pytest.raises(DeviceError, match=said) as refused:
        calibrated(**{switch[0]: switch[1]})
    assert refused.value.exit_code is ExitCode.DEVICE and "NAME" not in refused.value.do_now
    assert "nothing was written" in refused.value.saved
    assert not (tmp_path / "cal.h5").exists()
    assert not stub.get("peak_n") and not stub.get("enables")


def test_a_library_without_these_functions_still_drives_the_device(stub, rigs, monkeypatch, calibrated):
    monkeypatch.setattr("study.devices.force_dimension.library.LINKAGE_SIGNATURES", {})
    with pytest.raises(DeviceError, match="has no dhdDeltaPositionToEncoder"):
        calibrated()
    handle = stub.opened()
    assert np.isfinite(handle.read_position_m()).all()
    handle.disconnect()


def test_grid_and_name_are_checked_before_a_device_is_opened(stub, tmp_path):
    out = tmp_path / "cal.h5"
    for plan in (CalibrationPlan(out, "omega3", radius_m=0.5), CalibrationPlan(out, "omega3", depth_m=float("nan"))):
        with pytest.raises(WrongUseError, match="no such grid"):
            calibrate_linkage(plan, lambda share: None)
    out.write_bytes(b"before")
    with pytest.raises(StudyError, match="never overwritten"):
        calibrate_linkage(CalibrationPlan(out, "omega3"), lambda share: None)
    assert out.read_bytes() == b"before" and not stub.get("closes")


@pytest.mark.parametrize("name", ["falcon", "replay:a.h5", "simulated:a.h5"])
def test_devices_that_tell_no_linkage_say_so(tmp_path, name):
    with pytest.raises(DeviceError, match=r"no device called|has no linkage"):
        calibrate_linkage(CalibrationPlan(tmp_path / "cal.h5", name), lambda share: None)


@pytest.mark.slow
def test_the_calibrated_device_is_simulated_by_its_name(calibrated, rigs, tmp_path):
    calibration = calibrated().calibration
    settings = replace(rigs.SETTINGS, hand_on_handle=False)
    device = open_device(f"simulated:{tmp_path / 'cal.h5'}", settings, VirtualClock(), seed=1)
    try:
        assert device.info.simulated and device.info.name == "simulated omega.3 as calibrated"
        mass_kg = float(np.trace(calibration.inertia_kg[0]) / 3)
        assert device.info.effective_mass_kg == pytest.approx(mass_kg, rel=1e-3)
    finally:
        device.close()
    assert np.degrees(estimate_arm_azimuths(calibration.jacobian[0]))[0] == pytest.approx(90.0, abs=0.2)
