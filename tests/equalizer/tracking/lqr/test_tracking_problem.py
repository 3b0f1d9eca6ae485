from dataclasses import replace

import numpy as np
import pytest

from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem


def test_without_a_low_frequency_weight_the_model_is_taken_as_it_is(model_of):
    model = model_of(6, 0)
    problem = make_tracking_problem(model, TrackingWeights(0.5))
    assert (problem.A == model.A).all() and (problem.D == model.D).all()
    assert np.array_equal(problem.R, 0.5 * np.eye(3)) and np.array_equal(problem.Q, np.eye(3))
    assert (problem.order, problem.inputs, problem.outputs) == (6, 3, 3)


def test_the_low_frequency_output_is_a_first_order_low_pass_of_the_force(problem_of):
    problem = problem_of(4, 1, low_frequency_weight=2.0)
    for frequency, gain in ((0.01, 1.0), (3.0, 1 / np.sqrt(2)), (30.0, 0.1)):
        z = np.exp(2j * np.pi * frequency / 1000)
        response = problem.C @ np.linalg.solve(z * np.eye(7) - problem.A, problem.B) + problem.D
        assert np.abs(response[3:]) == pytest.approx(gain * np.eye(3), abs=0.02 * gain)
    assert np.diag(problem.Q).tolist() == [1, 1, 1, 2, 2, 2]


def test_a_low_frequency_weight_keeps_slow_force_down(device_model):
    wanted = np.zeros((1000, 3))
    wanted[:, 0] = 1.0
    free, held = (
        make_tracking_problem(device_model, TrackingWeights(1e-5, low_frequency_weight=w)) for w in (0.0, 10.0)
    )
    mean = [np.abs(track(compute_stored_gains(problem, 1000), wanted).forces[:, 0].mean()) for problem in (free, held)]
    assert mean[1] < 0.2 * mean[0]


def test_the_model_s_own_state_is_filled_up_with_penalties_at_rest(problem_of):
    problem = problem_of(4, 1, low_frequency_weight=1.0)
    assert problem.make_state(np.ones(4)).tolist() == [1, 1, 1, 1, 0, 0, 0]
    assert problem.make_state(np.ones(7)).tolist() == [1] * 7
    with pytest.raises(TrackingError, match=r"shape \(5,\); this problem takes \(7,\) or \(4,\)"):
        problem.make_state(np.ones(5))


def test_a_state_that_is_no_number_is_refused(problem_of):
    problem = problem_of(4, 1)
    with pytest.raises(TrackingError, match="a state holds values that are not finite"):
        track(compute_stored_gains(problem, 5), np.zeros((5, 3)), x0=np.array([0.0, np.nan, 0.0, 0.0]))


def test_the_matrices_cannot_be_written(problem_of):
    with pytest.raises(ValueError, match="read-only"):
        problem_of(4, 1).stage_cost[0, 0] = 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"weight": -1.0}, "weight is -1.0"),
        ({"weight": float("nan")}, "weight is nan"),
        ({"low_frequency_weight": -0.1}, "low_frequency_weight is -0.1"),
        ({"low_frequency_hz": 0.0}, "low_frequency_hz is 0.0"),
        ({"output_weight": np.array([[1.0, 1.0], [0.0, 1.0]])}, "square symmetric"),
        ({"output_weight": np.diag([1.0, -1.0])}, "eigenvalue -1"),
    ],
)
def test_weights_that_cannot_weigh_are_refused(arguments, message):
    with pytest.raises(TrackingError, match=message):
        TrackingWeights(**arguments)


def test_an_output_weight_of_another_size_is_refused(model_of):
    with pytest.raises(TrackingError, match="3 outputs need"):
        make_tracking_problem(model_of(4, 0), TrackingWeights(output_weight=np.eye(2)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"Q": -np.eye(3)}, "Q has the eigenvalue -1"),
        ({"Q": np.triu(np.ones((3, 3)))}, "Q must be a square symmetric matrix"),
        ({"R": -np.eye(3)}, "R has the eigenvalue -1"),
        ({"R": 1e-3}, "R must be a matrix of finite numbers"),
        ({"A": np.full((4, 4), np.nan)}, "A must be a matrix of finite numbers"),
        ({"B": np.zeros((3, 3))}, r"B has shape \(3, 3\), but 4 states, 3 forces and 3 outputs need \(4, 3\)"),
        ({"outputs": 4}, "outputs is 4; the tracked outputs are the first of the 3 rows of C"),
    ],
)
def test_matrices_that_make_no_problem_are_refused(problem_of, changes, said):
    with pytest.raises(TrackingError, match=said):
        replace(problem_of(4, 1), **changes)
