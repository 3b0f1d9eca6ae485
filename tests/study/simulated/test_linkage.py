import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study.devices.simulated.compiled import solve_pose
from study.devices.simulated.layout import PLATFORM_DEPTH
from study.devices.simulated.linkage import solve_forward_kinematics
from study.devices.simulated.packing import compute_isotropic_depth_m, pack_parameters
from study.devices.simulated.parameters import Linkage, Omega3Parameters

PARAMETERS = pack_parameters(Omega3Parameters(), has_hand=False, place_m=(0, 0, 0))
coordinate = st.floats(-0.075, 0.075)
places = st.tuples(coordinate, coordinate, coordinate).filter(lambda p: np.linalg.norm(p) <= 0.085).map(np.array)


def inverse(position):
    angles, jacobian = np.empty(3), np.empty((3, 3))
    solve_pose(PARAMETERS, np.array(position, float), angles, jacobian)
    return angles, jacobian


def forward(angles):
    position = np.empty(3)
    solve_forward_kinematics(PARAMETERS, angles, position)
    return position


@given(places)
@settings(deadline=None)
def test_there_and_back_is_the_same_place(place):
    assert forward(inverse(place)[0]) == pytest.approx(place, abs=1e-12)


@given(places)
@settings(deadline=None)
def test_every_forearm_spans_from_its_elbow_to_the_platform(place):
    linkage = Linkage()
    angles, _ = inverse(place)
    for angle, azimuth in zip(angles, np.radians(linkage.azimuths_deg), strict=True):
        radial = linkage.radius_m + linkage.upper_arm_m * np.cos(angle)
        elbow = [linkage.upper_arm_m * np.sin(angle), radial * np.cos(azimuth), radial * np.sin(azimuth)]
        platform = place + np.array([compute_isotropic_depth_m(linkage), 0, 0])
        assert np.linalg.norm(platform - elbow) == pytest.approx(linkage.forearm_m, abs=1e-12)


@given(places)
@settings(deadline=None)
def test_the_jacobian_is_the_slope_of_the_angles(place):
    step = 1e-6
    slopes = [(inverse(place + step * e)[0] - inverse(place - step * e)[0]) / (2 * step) for e in np.eye(3)]
    assert inverse(place)[1] == pytest.approx(np.array(slopes).T, rel=1e-5, abs=1e-5)


@given(places)
@settings(deadline=None)
def test_the_legs_stay_well_away_from_folding_and_stretching(place):
    assert np.linalg.cond(inverse(place)[1]) < 3


def test_the_centre_is_isotropic_and_places_off_it_are_not():
    _, centre = inverse([0, 0, 0])
    square = centre.T @ centre
    assert square == pytest.approx(square[0, 0] * np.eye(3), abs=1e-9 * square[0, 0])
    _, aside = inverse([0, 0.03, 0])
    assert np.linalg.cond(aside) > 1.1


def test_one_leg_is_upright_and_left_mirrors_right():
    assert inverse([0, 0, 0])[1][0, 1] == pytest.approx(0, abs=1e-12)
    left, right = inverse([0.01, -0.03, 0.02])[0], inverse([0.01, 0.03, 0.02])[0]
    assert left == pytest.approx(right[[0, 2, 1]], abs=1e-12)


def test_a_place_out_of_reach_still_gives_finite_angles():
    angles, _ = inverse([0.5, 0.5, 0.5])
    assert np.isfinite(angles).all()


def test_the_depth_of_the_centre_is_what_the_kinematics_use():
    assert PARAMETERS[PLATFORM_DEPTH] == compute_isotropic_depth_m(Linkage())


def test_arms_too_short_for_an_isotropic_point_are_refused():
    with pytest.raises(ValueError, match=r"no isotropic point on the axis: .* between -1 and 1"):
        compute_isotropic_depth_m(Linkage(upper_arm_m=0.05))
