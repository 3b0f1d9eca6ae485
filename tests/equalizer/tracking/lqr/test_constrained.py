import numpy as np
import pytest
from scipy.optimize import minimize

from equalizer.tracking.lqr.constrained import CapSettings, track_under_cap
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem
from tests.equalizer.tracking.lqr.dense_least_squares import block_toeplitz


def walk(samples, seed):
    return np.cumsum(np.random.default_rng(seed).standard_normal((samples, 3)), axis=0)


def free_peak(problem, wanted):
    return float(np.linalg.norm(track(compute_stored_gains(problem, len(wanted)), wanted).forces, axis=1).max())


def dense_optimum(problem, wanted, cap_n, already):
    """(forces, cost) by a general solver on the dense problem."""
    N, m, q = len(wanted), problem.inputs, problem.C.shape[0]
    root = np.linalg.cholesky(problem.Q + 1e-15 * np.eye(q))
    T = np.einsum("ij,njk->nik", root.T, block_toeplitz(problem, N).reshape(N, q, N * m)).reshape(N * q, N * m)
    right = (np.hstack([wanted, np.zeros((N, q - problem.outputs))]) @ root).ravel()
    H = T.T @ T + np.kron(np.eye(N), problem.R)

    def room(u):
        return cap_n**2 - ((u.reshape(N, m) + already) ** 2).sum(axis=1)

    def slope(u):
        return -2 * np.kron(np.eye(N), np.ones((1, m))) * (u + already.ravel())

    found = minimize(
        lambda u: u @ H @ u - 2 * u @ (T.T @ right) + right @ right,
        np.zeros(N * m),
        jac=lambda u: 2 * (H @ u - T.T @ right),
        constraints=[{"type": "ineq", "fun": room, "jac": slope}],
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-13},
    )
    return found.x.reshape(N, m), found.fun


@pytest.mark.parametrize("low_frequency_weight", [0.0, 0.5])
@pytest.mark.parametrize(("share", "seed"), [(0.3, 1), (0.7, 2)])
def test_the_capped_forces_are_those_of_a_dense_solver(problem_of, share, seed, low_frequency_weight):
    problem, wanted = problem_of(6, seed, 1e-2, low_frequency_weight), walk(14, seed)
    cap_n = share * free_peak(problem, wanted)
    already = 0.3 * cap_n * np.sin(np.arange(14))[:, None] * np.array([0.6, 0.0, 0.8])
    capped = track_under_cap(problem, wanted, cap_n, already, CapSettings(gap=1e-10, rounds=20000))
    forces, cost = dense_optimum(problem, wanted, cap_n, already)
    assert capped.loss.cost_capped == pytest.approx(cost, rel=1e-6)
    assert np.abs(capped.forces - forces).max() < 1e-3 * cap_n


@pytest.mark.parametrize("share", [0.3, 0.6, pytest.param(0.9, marks=pytest.mark.slow)])
def test_the_cap_holds_exactly_and_the_loss_is_less_than_that_of_clipping(device_model, share):
    problem, t = make_tracking_problem(device_model, TrackingWeights(1e-3)), np.arange(300) / 1000
    wanted = 20 * (np.exp(-t / 0.05) * np.sin(2 * np.pi * 20 * t))[:, None] * np.array([1, 0.3, -0.4])
    cap_n = share * free_peak(problem, wanted)
    capped = track_under_cap(problem, wanted, cap_n)
    loss = capped.loss
    assert np.linalg.norm(capped.forces, axis=1).max() <= cap_n
    assert loss.gap <= 1e-5
    assert loss.error_free < loss.error_capped < 0.8 * loss.error_clipped
    assert loss.cost_free < loss.cost_capped
    assert loss.lost == loss.error_capped - loss.error_free
    error = np.linalg.norm(capped.predicted - wanted) / np.linalg.norm(wanted)
    assert error == pytest.approx(loss.error_capped)


def test_a_cap_that_does_not_bind_costs_nothing(problem_of):
    problem, wanted = problem_of(6, 3), walk(50, 3)
    capped = track_under_cap(problem, wanted, 1.01 * free_peak(problem, wanted))
    assert np.array_equal(capped.forces, track(compute_stored_gains(problem, 50), wanted).forces)
    assert (capped.loss.lost, capped.loss.gap, capped.loss.rounds) == (0.0, 0.0, 0)


def test_the_stated_gap_bounds_how_far_the_cost_is_from_the_best(problem_of):
    problem, wanted = problem_of(8, 4), walk(60, 4)
    cap_n = 0.4 * free_peak(problem, wanted)
    rough = track_under_cap(problem, wanted, cap_n, settings=CapSettings(gap=0.05)).loss
    best = track_under_cap(problem, wanted, cap_n, settings=CapSettings(gap=1e-8, rounds=20000)).loss
    assert best.cost_capped <= rough.cost_capped <= best.cost_capped / (1 - rough.gap)


def test_what_has_no_answer_under_the_cap_is_refused(problem_of):
    problem, wanted = problem_of(6, 5), walk(30, 5)
    cap_n = 0.2 * free_peak(problem, wanted)
    others = np.zeros((30, 3))
    others[7] = 2 * cap_n
    with pytest.raises(TrackingError, match="the other forces alone reach .* N at row 7, above the cap of"):
        track_under_cap(problem, wanted, cap_n, others)
    with pytest.raises(TrackingError, match=r"the other forces have shape \(29, 3\); it must be \(30, 3\)"):
        track_under_cap(problem, wanted, cap_n, others[1:])
    with pytest.raises(TrackingError, match="after 3 rounds the forces under the cap .* are only known to be within"):
        track_under_cap(problem, wanted, cap_n, settings=CapSettings(gap=1e-9, rounds=3))
    with pytest.raises(
        TrackingError, match="after 0 rounds the forces under the cap .* are only known to be within inf"
    ):
        track_under_cap(problem, wanted, cap_n, settings=CapSettings(rounds=0))
