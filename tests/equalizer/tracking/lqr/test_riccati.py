from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.riccati import compute_backward_gains, compute_stationary_gains
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 12), st.integers(0, 9), st.booleans(), st.sampled_from([0.0, 1.0]), st.integers(1, 60))
def test_the_compiled_recursion_is_the_plain_one(problem_of, order, seed, feedthrough, low, samples):
    problem = problem_of(order, seed, 1e-2, low, feedthrough=feedthrough)
    terminal = np.diag(np.arange(1.0, problem.order + 1))
    plain, compiled = (
        compute_backward_gains(problem, samples, terminal),
        compute_stored_gains(problem, samples, terminal).gains,
    )
    for name in ("K", "H_inverse", "P"):
        right = getattr(plain, name)
        assert np.abs(getattr(compiled, name) - right).max() <= 1e-10 * np.abs(right).max()


def test_p_is_what_the_best_forces_cost_from_a_state(problem_of):
    problem, x0 = problem_of(6, 3, 1e-2), np.arange(1.0, 7.0)
    gains = compute_stored_gains(problem, 40)
    played = track(gains, np.zeros((40, 3)), x0)
    cost = np.sum(played.predicted**2) + 1e-2 * np.sum(played.forces**2)
    assert x0 @ gains.gains.P @ x0 == pytest.approx(cost, rel=1e-10)


def test_far_from_the_end_the_gains_are_the_stationary_ones(problem_of):
    problem = problem_of(8, 2, 1e-2)
    far, forever = compute_backward_gains(problem, 3000), compute_stationary_gains(problem)
    assert far.K[0] == pytest.approx(forever.K[0], rel=1e-9, abs=1e-12)
    assert np.abs(far.P - forever.P).max() < 1e-9 * np.abs(far.P).max()


def test_near_the_end_they_are_not(problem_of, difference):
    problem = problem_of(8, 2, 1e-2)
    assert difference(compute_backward_gains(problem, 5).K[-1], compute_stationary_gains(problem).K[0]) > 0.1


@pytest.mark.parametrize("recursion", [compute_backward_gains, compute_stored_gains])
def test_a_delay_without_a_force_weight_is_refused(problem_of, recursion):
    with pytest.raises(TrackingError, match="at step 1 from the end a force has no effect"):
        recursion(problem_of(4, 0, 0.0, feedthrough=False), 10)


@pytest.mark.parametrize("recursion", [compute_backward_gains, lambda *given: compute_stored_gains(*given).gains])
@pytest.mark.parametrize("seed", range(12))
def test_feedthrough_needs_no_force_weight(problem_of, recursion, seed):
    # What is wanted is reached exactly, so P is zero: any negative eigenvalue left by rounding grows step by step.
    problem = problem_of(4, seed, 0.0)
    gains = recursion(problem, 400)
    assert np.isfinite(gains.K).all()
    assert np.linalg.eigvalsh(gains.P)[0] >= -1e-12 * np.abs(gains.P).max()


def test_a_terminal_weight_of_another_shape_is_refused(problem_of):
    with pytest.raises(TrackingError, match=r"terminal_weight must be .* \(4, 4\)"):
        compute_backward_gains(problem_of(4, 0), 5, np.eye(3))


def test_a_terminal_weight_that_rewards_a_distance_is_refused(problem_of):
    with pytest.raises(TrackingError, match=r"terminal_weight has the eigenvalue -2; none may be negative"):
        compute_backward_gains(problem_of(2, 0), 5, np.diag([1.0, -2.0]))


def test_nor_are_there_stationary_ones(device_model):
    with pytest.raises(TrackingError, match="there are no stationary gains: .* the force weight must be above zero"):
        compute_stationary_gains(make_tracking_problem(device_model, TrackingWeights(0.0)))


def test_a_growing_motion_that_no_force_reaches_has_no_stationary_gains(model_of):
    model = model_of(2, 0)
    unreached = replace(model, A=np.diag([1.1, 0.5]), B=np.vstack([np.zeros(3), np.ones(3)]))
    with pytest.raises(TrackingError, match="there are no stationary gains: .* must decay without control"):
        compute_stationary_gains(make_tracking_problem(unreached, TrackingWeights()))
