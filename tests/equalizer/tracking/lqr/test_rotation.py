import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.rotation import compute_normal_basis, compute_rotation_basis
from equalizer.tracking.lqr.tracking_problem import TrackingError

SEEDS = st.integers(0, 2**16)


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.booleans(), st.sampled_from([1.0, 1e-3]))
def test_a_rotated_trajectory_is_a_combination_of_nine_solutions(
    problem_of, random_rotation, difference, seed, feedthrough, weight
):
    gains = compute_stored_gains(problem_of(7, seed % 5, weight, 1.0, feedthrough=feedthrough), 60)
    trajectory, R = np.random.default_rng(seed).standard_normal((60, 3)), random_rotation(seed)
    basis, right = compute_rotation_basis(gains, trajectory), track(gains, trajectory @ R.T)
    assert difference(basis.compute_forces(R), right.forces) <= 1e-11
    assert difference(basis.predict_response(R), right.predicted) <= 1e-11


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_a_recording_along_a_normal_is_a_combination_of_three(problem_of, difference, seed):
    gains, draw = compute_stored_gains(problem_of(7, seed % 5), 60), np.random.default_rng(seed).standard_normal
    recording, normal = draw(60), draw(3)
    found = compute_normal_basis(gains, recording).compute_forces(normal)
    assert difference(found, track(gains, np.outer(recording, normal)).forces) <= 1e-11


def test_two_axes_need_four_solutions(problem_of):
    basis = compute_rotation_basis(compute_stored_gains(problem_of(4, 0, size=2), 20), np.ones((20, 2)))
    assert basis.stored_forces.shape == (4, 40)
    assert basis.compute_forces(np.eye(2)).shape == (20, 2)


def test_a_rotation_is_not_its_inverse(problem_of, random_rotation, difference):
    basis = compute_rotation_basis(
        compute_stored_gains(problem_of(4, 0), 20), np.random.default_rng(0).standard_normal((20, 3))
    )
    R = random_rotation(1)
    assert difference(basis.compute_forces(R.T), basis.compute_forces(R)) > 0.1


def test_a_direction_of_another_shape_is_refused(problem_of):
    gains = compute_stored_gains(problem_of(4, 0), 20)
    with pytest.raises(TrackingError, match=r"shape \(3,\); this basis takes \(3, 3\)"):
        compute_rotation_basis(gains, np.ones((20, 3))).compute_forces(np.ones(3))
    with pytest.raises(TrackingError, match=r"shape \(3, 3\); this basis takes \(3,\)"):
        compute_normal_basis(gains, np.ones(20)).predict_response(np.eye(3))


def test_a_recording_of_three_axes_is_no_recording_along_one(problem_of):
    with pytest.raises(TrackingError, match=r"shape \(20, 3\); it must be \(N,\)"):
        compute_normal_basis(compute_stored_gains(problem_of(4, 0), 20), np.ones((20, 3)))
