import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.tracking.lqr.limits import ForceLimitError, find_force_peaks, project_to_cap, require_under_cap


def test_the_peak_is_that_of_the_force_vector():
    forces = np.array([[0.0, 0, 0], [1.0, 2, 2], [2.0, 0, 0], [0.0, 3, 0]])
    peaks = find_force_peaks(forces, 2.5)
    assert (peaks.peak_n, peaks.peak_row, peaks.share_above) == (3.0, 1, 0.5)
    assert not peaks.is_under_cap
    assert find_force_peaks(forces * peaks.largest_scale, 2.5).peak_n == pytest.approx(2.5)


def test_forces_above_the_cap_are_refused_with_what_would_fit():
    forces = np.zeros((1000, 3))
    forces[250] = [0, 0, 4.7]
    with pytest.raises(ForceLimitError) as refusal:
        require_under_cap(forces, 3.0, 1000.0)
    text = str(refusal.value)
    assert "reach 4.7 N at 0.250 s, above the cap of 3 N (0.1% of the time above it); nothing was clipped" in text
    assert "fits when scaled by 0.6382 or less" in text
    assert refusal.value.peaks.peak_row == 250
    assert require_under_cap(0.6382 * forces, 3.0, 1000.0).is_under_cap


def test_nothing_has_no_peak():
    assert find_force_peaks(np.zeros((0, 3)), 3.0).peak_n == 0
    assert find_force_peaks(np.zeros((5, 3)), 3.0).largest_scale == np.inf


@pytest.mark.parametrize("cap_n", [0.0, -1.0, np.nan])
def test_a_cap_must_be_a_positive_number(cap_n):
    with pytest.raises(ValueError, match="cap_n is .*; it must be a positive number"):
        find_force_peaks(np.zeros((5, 3)), cap_n)


def test_forces_that_are_no_numbers_have_no_peak():
    with pytest.raises(ValueError, match="forces hold values that are not finite numbers"):
        find_force_peaks(np.full((2, 3), np.nan), 3.0)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 1000), st.floats(1e-3, 1e3))
def test_the_nearest_allowed_forces_are_never_above_the_cap(seed, cap_n):
    forces = np.random.default_rng(seed).standard_normal((50, 3)) * cap_n
    assert np.linalg.norm(project_to_cap(forces, cap_n), axis=1).max() <= cap_n
