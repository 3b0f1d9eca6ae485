import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.tracking.workspace.place_weights import compute_place_weights

LINE = np.array([[0.0, 0.01, 0.0], [0.06, 0.01, 0.0], [0.03, 0.01, 0.0]])
PLANE = np.array([[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0], [0.05, 0.05, 0], [0.02, 0.03, 0]], float)
VOLUME = np.vstack([PLANE, [[0.02, 0.02, 0.05], [0.03, 0.01, -0.04]]])
POINTS = pytest.mark.parametrize("points", [LINE, PLANE, VOLUME], ids=["line", "plane", "volume"])
COORDINATE = st.floats(-0.08, 0.08)


@POINTS
def test_a_point_counts_alone_where_it_lies(points):
    for index, point in enumerate(points):
        weights = compute_place_weights(points, point)
        alone = np.eye(len(points))[index]
        np.testing.assert_allclose(weights.linear, alone, atol=1e-5)
        np.testing.assert_allclose(weights.smooth, alone, atol=1e-6)
        assert weights.remark is None


@POINTS
@given(place=st.tuples(COORDINATE, COORDINATE, COORDINATE))
@settings(max_examples=25, deadline=None)
def test_weights_sum_to_one_and_linear_ones_are_never_negative(points, place):
    weights = compute_place_weights(points, place)
    assert weights.linear.sum() == pytest.approx(1)
    assert weights.smooth.sum() == pytest.approx(1)
    assert weights.linear.min() >= 0


@POINTS
@given(place=st.tuples(COORDINATE, COORDINATE, COORDINATE))
@settings(max_examples=25, deadline=None)
def test_weights_are_continuous(points, place):
    here = compute_place_weights(points, place)
    near = compute_place_weights(points, tuple(x + 1e-6 for x in place))
    np.testing.assert_allclose(near.linear, here.linear, atol=2e-3)
    np.testing.assert_allclose(near.smooth, here.smooth, atol=2e-3)


@POINTS
def test_what_is_linear_in_the_place_is_interpolated_exactly(points):
    place = points.mean(axis=0)
    weights = compute_place_weights(points, place)
    np.testing.assert_allclose(weights.linear @ points, place, atol=1e-7)
    np.testing.assert_allclose(weights.smooth @ points, place, atol=1e-7)


def test_outside_the_nearest_place_inside_is_used_and_reported():
    outside = compute_place_weights(LINE, (0.08, 0.01, 0.0))
    assert outside.linear.tolist() == pytest.approx([0, 1, 0], abs=1e-6)
    assert outside.outside_m == pytest.approx(0.02)
    assert "20.0 mm outside" in outside.remark


def test_points_placed_by_hand_along_a_line_have_neighbours_along_it():
    shaky = LINE + 1e-3 * np.array([[0, 1, 0], [0, 1, 0], [0, -1, 0.5]])
    weights = compute_place_weights(shaky, (0.015, 0.0095, 0.0))
    assert weights.linear == pytest.approx([0.5, 0, 0.5], abs=0.02)


def test_points_that_a_flattening_would_put_together_stay_apart():
    """A triangle with one very short side."""
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.003, 0]])
    for index, point in enumerate(points):
        np.testing.assert_allclose(compute_place_weights(points, point).linear, np.eye(3)[index], atol=1e-5)


def test_smooth_weights_follow_a_curve_where_linear_ones_cut_it_off():
    points = np.column_stack([np.linspace(0, 0.06, 4), np.zeros((4, 2))])
    bent = np.sin(np.pi * points[:, 0] / 0.06)
    for along in np.linspace(0, 0.06, 13):
        weights = compute_place_weights(points, (along, 0, 0))
        assert abs(weights.smooth @ bent - np.sin(np.pi * along / 0.06)) < 0.02
    assert abs(compute_place_weights(points, (0.03, 0, 0)).linear @ bent - 1) > 0.1


def test_between_three_points_a_parabola_is_followed_better_than_a_cubic_spline_does():
    points = np.array([[0.0, 0, 0], [0.03, 0, 0], [0.06, 0, 0]])
    along = np.linspace(0, 0.06, 25)
    found = np.array([compute_place_weights(points, (x, 0, 0)).smooth @ (points[:, 0] / 0.06) ** 2 for x in along])
    assert np.abs(found - (along / 0.06) ** 2).max() < 0.01 < 0.074 / 4


def test_one_point_counts_everywhere():
    weights = compute_place_weights(LINE[:1], (0.0, 0.01, 0.05))
    assert weights.linear.tolist() == [1.0]
    assert weights.outside_m == pytest.approx(0.05)
