"""The trackers against dense least squares: the oracle shares nothing with them but the cost."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem
from tests.equalizer.tracking.lqr.dense_least_squares import block_toeplitz, least_squares_forces
from tests.slow_instances import slow, slow_after

AGREEMENT = {1.0: 1e-10, 1e-2: 1e-10, 1e-4: 1e-10, 1e-6: 1e-9}


@pytest.mark.parametrize("feedthrough", [True, False], ids=["feedthrough", "delay"])
@pytest.mark.parametrize("weight", slow_after(1, AGREEMENT))
def test_riccati_equals_dense_least_squares(problem_of, difference, weight, feedthrough):
    for order in (2, 8, 14, 26):
        for seed, samples in enumerate((3, 7, 60, 150, 100)):
            problem = problem_of(order, seed, weight, float(seed % 2), feedthrough=feedthrough)
            draw = np.random.default_rng(seed).standard_normal
            wanted, x0 = draw((samples, 3)), draw(problem.order)
            found = track(compute_stored_gains(problem, samples), wanted, x0).forces
            right = least_squares_forces(problem, wanted, x0)
            assert difference(found, right) <= AGREEMENT[weight], (order, seed, samples)


@pytest.mark.parametrize("weight", [1e-6, *slow(1e-4, 1e-2, 1.0)])
def test_and_on_a_device_s_own_equations(device_model, difference, weight):
    problem = make_tracking_problem(device_model, TrackingWeights(weight))
    wanted = np.random.default_rng(0).standard_normal((250, 3))
    found = track(compute_stored_gains(problem, 250), wanted).forces
    assert difference(found, least_squares_forces(problem, wanted)) <= AGREEMENT[weight]


@settings(max_examples=25, deadline=None)
@given(
    st.integers(1, 10), st.integers(1, 4), st.integers(0, 99), st.integers(1, 40), st.sampled_from([1.0, 1e-2, 1e-4])
)
def test_with_any_output_weight_terminal_weight_and_target(model_of, difference, order, size, seed, samples, weight):
    draw = np.random.default_rng(seed).standard_normal
    root = draw((size, size))
    problem = make_tracking_problem(model_of(order, seed, size=size), TrackingWeights(weight, root @ root.T))
    end_root, wanted, x0, end = draw((order, order)), draw((samples, size)), draw(order), draw(order)
    terminal = end_root @ end_root.T
    found = track(compute_stored_gains(problem, samples, terminal), wanted, x0, end).forces
    assert difference(found, least_squares_forces(problem, wanted, x0, terminal, end)) <= 1e-10


def test_the_oracle_is_a_minimum(problem_of):
    problem, draw = problem_of(5, 1, 1e-2), np.random.default_rng(1).standard_normal
    wanted, T = draw((30, 3)), block_toeplitz(problem, 30)

    def cost(forces) -> float:
        return float(np.sum((T @ forces.ravel() - wanted.ravel()) ** 2) + 1e-2 * np.sum(forces**2))

    best = least_squares_forces(problem, wanted)
    assert all(cost(best + 1e-3 * draw(best.shape)) > cost(best) for _ in range(20))


def test_the_block_toeplitz_matrix_is_the_model_played_from_rest(problem_of):
    problem, forces = problem_of(5, 1), np.random.default_rng(0).standard_normal((20, 3))
    x, answers = np.zeros(5), []
    for force in forces:
        answers.append(problem.C @ x + problem.D @ force)
        x = problem.A @ x + problem.B @ force
    assert block_toeplitz(problem, 20) @ forces.ravel() == pytest.approx(np.ravel(answers), rel=1e-12)
