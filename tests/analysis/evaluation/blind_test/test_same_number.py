"""A number that is said in another way is no miss, and one that is another number is."""

import math

import pytest

from analysis.evaluation.blind_test.score import find_nearest_true_value


@pytest.mark.parametrize(("said", "true"), [(-3.0, 2 * math.pi - 3.0), (0.1, 6.2), (13.0, 0.43)])
def test_a_phase_may_have_turned_round(said, true):
    found = find_nearest_true_value("phase", said, {"phase": true})
    assert abs(found - said) <= math.pi
    assert math.isclose(math.cos(found), math.cos(true), abs_tol=1e-12)
    assert math.isclose(math.sin(found), math.sin(true), abs_tol=1e-12)


def test_a_stop_on_both_sides_may_be_named_after_either():
    assert find_nearest_true_value("position", -0.0121, {"position": 0.012, "opposite": 1.0}) == -0.012
    assert find_nearest_true_value("position", 0.0121, {"position": -0.012, "opposite": 1.0}) == 0.012


def test_a_stop_on_one_side_has_its_side():
    assert find_nearest_true_value("position", -0.0121, {"position": 0.012, "opposite": 0.0}) == 0.012


def test_other_numbers_are_compared_as_they_are():
    assert find_nearest_true_value("gain", -1.1, {"gain": 1.1}) == 1.1
