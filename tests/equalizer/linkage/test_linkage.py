"""The mirror lines, the grid, the checks and the field of inertia, on an invented linkage whose formulas are known."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.linkage.calibration import CalibrationError, estimate_local_inertia
from equalizer.linkage.grid import (
    compute_difference_error,
    estimate_arm_azimuths,
    list_difference_positions,
    make_symmetric_grid,
)
from equalizer.linkage.mirror_lines import (
    complete_by_symmetry,
    compute_reflection,
    measure_line_asymmetry,
    write_asymmetry_warnings,
)
from tests.equalizer.linkage.truth import ARMS_DEG, calibration, rates, reading, readings

AZIMUTHS = np.radians(ARMS_DEG)


@pytest.mark.parametrize("turned_deg", [0.0, 15.0, -40.0])
def test_the_arms_are_found_from_one_jacobian(turned_deg):
    arms_deg = ARMS_DEG + turned_deg
    found = estimate_arm_azimuths(np.linalg.inv(rates(np.zeros(3), arms_deg)))
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * np.radians(arms_deg)), atol=1e-12)


def test_joints_that_count_backwards_change_no_arm():
    backwards = np.diag([-1.0, 1.0, -1.0]) @ rates(np.zeros(3))
    np.testing.assert_allclose(np.degrees(estimate_arm_azimuths(np.linalg.inv(backwards))) % 360, ARMS_DEG)


@pytest.mark.parametrize("arms_deg", [(90.0, 210.0, 300.0), (90.0, 90.0, 210.0), (0.0, 90.0, 180.0)])
def test_arms_that_are_no_delta_s_are_refused(arms_deg):
    uneven = rates(np.zeros(3), np.array(arms_deg)) + 0.01 * np.arange(9).reshape(3, 3)
    with pytest.raises(CalibrationError, match="120 degrees apart"):
        estimate_arm_azimuths(np.linalg.inv(uneven))


def test_every_line_maps_the_grid_onto_itself():
    grid = make_symmetric_grid(AZIMUTHS, 0.05, 0.04)
    assert grid.shape == (185, 3) and not grid[0].any()
    for azimuth in AZIMUTHS:
        images = grid @ compute_reflection(azimuth)
        distances = np.linalg.norm(images[:, None] - grid[None], axis=2).min(axis=1)
        assert distances.max() < 1e-12


def test_like_arms_mirror_and_an_odd_one_is_named():
    shares, _ = measure_line_asymmetry(readings(), AZIMUTHS)
    assert shares.max() < 1e-12
    odd, where = measure_line_asymmetry(readings(np.array([1e-3, 1.3e-3, 1e-3])), AZIMUTHS)
    assert odd[1] < 1e-12 and odd[0] > 0.05 and odd[2] > 0.05
    warnings = write_asymmetry_warnings(odd, where, ARMS_DEG)
    assert len(warnings) == 3 and "The line at 210 degrees is a line of symmetry" in warnings[-1]
    assert write_asymmetry_warnings(shares, where, ARMS_DEG) == ()


def test_three_unlike_arms_are_said_and_none_is_blamed():
    shares, where = measure_line_asymmetry(readings(np.array([1e-3, 1.3e-3, 0.8e-3])), AZIMUTHS)
    warnings = write_asymmetry_warnings(shares, where, ARMS_DEG)
    assert len(warnings) == 3 and not any("holds" in warning for warning in warnings)


def test_what_was_not_read_is_filled_in_as_it_would_have_been_read():
    every = readings()
    kept = [each for each in every if each.position_m[2] < 0.03]
    gone = [each for each in every if each.position_m[2] >= 0.03]
    assert len(gone) >= 15
    filled, unknown = complete_by_symmetry(kept, AZIMUTHS, np.array([each.position_m for each in gone]))
    assert len(filled) == len(gone) and unknown.size == 0
    for found, true in zip(filled, gone, strict=True):
        np.testing.assert_allclose(found.position_m, true.position_m, atol=1e-12)
        np.testing.assert_allclose(found.joint_angle_rad, true.joint_angle_rad, atol=1e-12)
        np.testing.assert_allclose(found.jacobian, true.jacobian, atol=1e-12)
        np.testing.assert_allclose(found.inertia_kg, true.inertia_kg, atol=1e-12)


def test_gravity_is_filled_in_by_the_upright_line_alone():
    left, right = (reading(np.array([0.01, y, 0.02])) for y in (-0.03, 0.03))
    sideways = replace(left, gravity_n=np.array([0.0, 0.3, 2.0]))
    (filled,), _ = complete_by_symmetry([sideways], AZIMUTHS, right.position_m[None])
    np.testing.assert_allclose(filled.gravity_n, [0.0, -0.3, 2.0], atol=1e-12)
    about_another = compute_reflection(AZIMUTHS[1]) @ left.position_m
    (filled,), _ = complete_by_symmetry([sideways], AZIMUTHS, about_another[None])
    assert np.isnan(filled.gravity_n).all()


def test_a_place_without_an_image_stays_unknown():
    filled, unknown = complete_by_symmetry([reading(np.zeros(3))], AZIMUTHS, np.array([[0.0, 0.01, 0.0]]))
    assert filled == [] and len(unknown) == 1


def test_a_jacobian_is_told_from_another_by_differences():
    true = np.linalg.inv(rates(np.zeros(3)))
    places = list_difference_positions(np.zeros(3))
    angles = places @ rates(np.zeros(3)).T
    assert compute_difference_error(true, places, angles) < 1e-12
    assert compute_difference_error(1.2 * true, places, angles) == pytest.approx(0.2)
    assert compute_difference_error(true.T, places, angles) > 0.4


SPOILT = {
    "inertia contains a value that is not a number": {"inertia_kg": np.full((3, 3), np.nan)},
    "Jacobian contains a value that is not a number": {"jacobian": np.full((3, 3), np.inf)},
    "joint angles contains a value that is not a number": {"joint_angle_rad": np.array([0.0, np.nan, 0.0])},
    "gravity force is not a number": {"gravity_n": np.array([0.0, np.nan, 0.0])},
    "singular": {"jacobian": np.ones((3, 3))},
    "not symmetric": {"inertia_kg": 0.3 * np.eye(3) + 0.01 * np.eye(3, k=1)},
    "not positive definite": {"inertia_kg": np.diag([0.3, 0.3, -0.3])},
    "not plausible for a handle": {"inertia_kg": 300.0 * np.eye(3)},
}


@pytest.mark.parametrize("said", SPOILT)
def test_readings_that_cannot_be_are_refused_by_name_and_place(said):
    spoilt = replace(reading(np.array([0.0, 0.01, -0.02])), **SPOILT[said])
    with pytest.raises(CalibrationError, match=said) as refused:
        calibration([reading(np.zeros(3)), spoilt])
    assert all("at (0, 10, -20) mm" in problem for problem in refused.value.problems)


def test_unequal_counts_and_large_differences_are_refused():
    some = readings()[:10]
    with pytest.raises(CalibrationError, match="inertia_kg does not have one entry for each of the 10"):
        calibration(some, inertia_kg=np.zeros((9, 3, 3)))
    with pytest.raises(CalibrationError, match="differs from finite differences"):
        calibration(some, difference=0.2)
    with pytest.raises(CalibrationError, match="not finite"):
        calibration(some, asymmetry=np.array([0.0, np.nan, 0.0]))


def test_a_fault_everywhere_is_told_ten_times_and_counted():
    heavy = [replace(each, inertia_kg=1e3 * each.inertia_kg) for each in readings()]
    with pytest.raises(CalibrationError) as refused:
        calibration(heavy)
    assert len(refused.value.problems) == 11 and "and 175 more" in refused.value.problems[-1]


def test_gravity_may_be_unknown_where_it_was_filled_in():
    unknown = replace(reading(np.zeros(3)), gravity_n=np.full(3, np.nan))
    assert calibration([unknown], filled=np.ones(1)).filled.all()


def test_inertia_and_its_slopes_are_those_of_the_formula():
    """The formula's inertia is a polynomial of the second degree: exactly found."""
    place, step = np.array([0.013, -0.02, 0.007]), 1e-5
    inertia, slopes = estimate_local_inertia(calibration(readings()), place)
    np.testing.assert_allclose(inertia, reading(place).inertia_kg, atol=1e-10)
    for axis in range(3):
        aside = step * np.eye(3)[axis]
        slope = (reading(place + aside).inertia_kg - reading(place - aside).inertia_kg) / (2 * step)
        np.testing.assert_allclose(slopes[axis], slope, atol=1e-7)


def test_positions_in_a_plane_tell_no_slopes():
    flat = [each for each in readings() if each.position_m[0] == 0.0]
    with pytest.raises(ValueError, match="do not determine how the inertia changes"):
        estimate_local_inertia(calibration(flat), np.zeros(3))
