"""Poles put inside the unit circle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.identification.state_space.stable_poles import compute_pole_radius, stabilise_blocks, stabilise_poles

PARTS = st.floats(-3, 3)


def test_a_pole_at_the_bound_falls_to_one_over_e_in_the_time_given():
    assert compute_pole_radius(0.5, 1000.0) ** 500 == pytest.approx(np.exp(-1))


def test_an_unstable_pole_is_mirrored_and_a_stable_one_left_alone():
    poles = np.array([2.0 + 0j, 0.3 + 0.4j, 1.25j])
    np.testing.assert_allclose(stabilise_poles(poles, 0.999), [0.5, 0.3 + 0.4j, 0.8j])


def test_a_mirrored_pole_too_close_to_the_circle_goes_to_the_bound():
    assert np.abs(stabilise_poles(np.array([1.0001 + 0j]), 0.998))[0] == pytest.approx(0.998)


@given(a=PARTS, b=PARTS)
@settings(max_examples=100, deadline=None)
def test_blocks_end_within_the_bound_and_stay_where_they_were_inside_it(a, b):
    radius = 0.99
    new_a, new_b = stabilise_blocks(np.array([a]), np.array([b]), radius)
    root = np.sqrt(new_b.astype(complex))
    assert max(abs(new_a + root)[0], abs(new_a - root)[0]) <= radius * (1 + 1e-7)
    again_a, again_b = stabilise_blocks(new_a, new_b, radius)
    np.testing.assert_allclose([again_a, again_b], [new_a, new_b], atol=1e-6)
