import numpy as np
import pytest

from equalizer.tracking.lqr.lqr import (
    compute_costate_feedforward,
    compute_free_decay_weight,
    compute_periodic_state,
    compute_stored_gains,
    track,
)
from equalizer.tracking.lqr.padding import simulate_from_rest
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem


@pytest.fixture(scope="module")
def noise(plants):
    return plants.multisine(5.0, 35.0, 1.0) * np.sin(np.pi * np.arange(1000) / 1000)[:, None] ** 2


def test_what_is_predicted_is_what_the_device_plays(device_model, plants, noise):
    played = track(compute_stored_gains(make_tracking_problem(device_model, TrackingWeights()), 1000), noise)
    truth = plants.omega_like().play(played.forces)
    assert played.predicted == pytest.approx(truth, abs=1e-9)
    assert np.linalg.norm(truth - noise) < 2e-3 * np.linalg.norm(noise)


def test_forces_are_linear_in_the_trajectory_and_the_state(problem_of):
    gains, draw = compute_stored_gains(problem_of(6, 0), 50), np.random.default_rng(0).standard_normal
    r1, r2, x1, x2 = draw((50, 3)), draw((50, 3)), draw(6), draw(6)
    both = track(gains, 2 * r1 - r2, 2 * x1 - x2).forces
    assert both == pytest.approx(2 * track(gains, r1, x1).forces - track(gains, r2, x2).forces, abs=1e-9)


def test_the_second_half_from_where_the_first_ended_is_the_second_half(problem_of):
    problem, wanted = problem_of(6, 0), np.random.default_rng(0).standard_normal((80, 3))
    whole = track(compute_stored_gains(problem, 80), wanted)
    x = np.zeros(6)
    for force in whole.forces[:30]:
        x = problem.A @ x + problem.B @ force
    rest = track(compute_stored_gains(problem, 50), wanted[30:], x)
    assert rest.forces == pytest.approx(whole.forces[30:], abs=1e-10)
    assert rest.final_state == pytest.approx(whole.final_state, abs=1e-10)


def test_leaving_out_the_simulated_state_misses_most_of_the_trajectory(device_model, noise):
    problem = make_tracking_problem(device_model, TrackingWeights())
    literal = simulate_from_rest(problem, compute_costate_feedforward(compute_stored_gains(problem, 1000), noise))
    assert np.linalg.norm(literal - noise) > 0.5 * np.linalg.norm(noise)


def test_a_fade_in_that_is_drawn_to_the_loop_s_state_leaves_no_transient(device_model):
    problem, time_s = make_tracking_problem(device_model, TrackingWeights()), np.arange(600) / 1000
    loop = np.column_stack([np.sin(2 * np.pi * 10 * time_s[:100]), np.zeros((100, 2))])
    start = compute_periodic_state(problem, loop)
    steady = simulate_from_rest(problem, np.tile(loop, (100, 1)))[-100:]
    wanted = np.tile(steady, (6, 1)) * np.minimum(1, time_s / 0.3)[:, None]
    free = track(compute_stored_gains(problem, 600), wanted)
    drawn = track(compute_stored_gains(problem, 600, compute_free_decay_weight(problem)), wanted, final_state=start)
    held = track(
        compute_stored_gains(problem, 600, 1e3 * compute_free_decay_weight(problem)), wanted, final_state=start
    )

    def ringing(faded) -> float:
        after = simulate_from_rest(problem, np.vstack([faded.forces, np.tile(loop, (10, 1))]))[600:]
        return float(np.abs(after - np.tile(steady, (10, 1))).max() / np.abs(steady).max())

    assert ringing(held) < 1e-4 < ringing(drawn) < 5e-3 < 0.02 < ringing(free)


def test_the_ringing_weight_is_all_that_is_still_to_come(problem_of):
    problem, x = problem_of(5, 2), np.arange(1.0, 6.0)
    outputs, state = [], x
    for _ in range(3000):
        outputs.append(problem.C @ state)
        state = problem.A @ state
    assert x @ compute_free_decay_weight(problem) @ x == pytest.approx(np.sum(np.square(outputs)), rel=1e-9)


def test_a_periodic_state_comes_round_again(problem_of):
    problem, loop = problem_of(5, 2), np.random.default_rng(0).standard_normal((17, 3))
    start = x = compute_periodic_state(problem, loop)
    for force in loop:
        x = problem.A @ x + problem.B @ force
    assert x == pytest.approx(start, abs=1e-12)


@pytest.mark.parametrize(
    "question", [compute_free_decay_weight, lambda problem: compute_periodic_state(problem, np.ones((3, 3)))]
)
def test_what_never_settles_is_refused(model_of, question):
    model = model_of(4, 0)
    numbers = model.parameters.copy()
    numbers[:16] *= 1.1
    with pytest.raises(TrackingError, match="not stable"):
        question(make_tracking_problem(model.replace_parameters(numbers), TrackingWeights()))


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        (np.zeros((9, 3)), "has 9 samples, but the gains are for 10"),
        (np.zeros((10, 2)), r"shape \(10, 2\); this problem takes \(N, 3\)"),
        (np.full((10, 3), np.nan), "not finite"),
    ],
)
def test_a_trajectory_that_does_not_fit_is_refused(problem_of, wanted, message):
    with pytest.raises(TrackingError, match=message):
        track(compute_stored_gains(problem_of(4, 0), 10), wanted)


def test_a_horizon_of_nothing_is_refused(problem_of):
    with pytest.raises(TrackingError, match="has 0 samples"):
        compute_stored_gains(problem_of(4, 0), 0)
