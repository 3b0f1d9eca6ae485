import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.tracking.lqr.changing_direction import (
    make_initial_state,
    make_normal_transient,
    make_rotatable_transient,
    play,
    restart,
    step,
)
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.rotation import compute_rotation_basis
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem
from tests.equalizer.tracking.lqr.dense_least_squares import least_squares_forces
from tests.slow_instances import slow

N = 120


@pytest.fixture(scope="module")
def trajectory():
    return np.random.default_rng(7).standard_normal((N, 3))


@pytest.mark.parametrize("weight", [1e-2, *slow(1.0, 1e-4)])
@pytest.mark.parametrize("feedthrough", [True, False], ids=["feedthrough", "delay"])
def test_each_turn_is_a_new_solution_from_the_present_state(
    problem_of, random_rotation, difference, trajectory, weight, feedthrough
):
    for seed, tick in enumerate((1, 37, 60, 93, 110)):
        problem = problem_of(26, seed, weight, float(seed % 2), feedthrough=feedthrough)
        transient, turned = (
            make_rotatable_transient(compute_stored_gains(problem, N), trajectory),
            random_rotation(seed + 5),
        )
        before = play(transient, np.tile(random_rotation(seed), (tick, 1, 1)))
        after = play(transient, np.tile(turned, (N - tick, 1, 1)), before.state)
        right = least_squares_forces(problem, trajectory[tick:] @ turned.T, before.state.x)
        assert difference(after.forces, right) <= 1e-10, (seed, tick)


def test_and_on_a_device_s_own_equations(device_model, random_rotation, difference, trajectory):
    problem = make_tracking_problem(device_model, TrackingWeights(1e-4))
    transient = make_rotatable_transient(compute_stored_gains(problem, N), trajectory)
    before = play(transient, np.tile(random_rotation(0), (50, 1, 1)))
    after = play(transient, np.tile(random_rotation(1), (N - 50, 1, 1)), before.state)
    right = least_squares_forces(problem, trajectory[50:] @ random_rotation(1).T, before.state.x)
    assert difference(after.forces, right) <= 1e-10


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(0, 99), min_size=5, max_size=30))
def test_a_turn_at_every_tick_is_solved_again_at_every_tick(problem_of, random_rotation, difference, trajectory, seeds):
    problem = problem_of(5, 1, 1e-2)
    transient, state = make_rotatable_transient(compute_stored_gains(problem, N), trajectory), None
    state = make_initial_state(transient)
    for tick, seed in enumerate(seeds):
        R = random_rotation(seed)
        right = least_squares_forces(problem, trajectory[tick:] @ R.T, state.x)[0]
        force, state = step(transient, state, R)
        assert difference(force, right) <= 1e-10


def test_without_a_turn_it_is_the_rotation_basis(problem_of, random_rotation, trajectory):
    gains, R = compute_stored_gains(problem_of(6, 0), N), random_rotation(3)
    played = play(make_rotatable_transient(gains, trajectory), np.tile(R, (N, 1, 1)))
    assert played.forces == pytest.approx(compute_rotation_basis(gains, trajectory).compute_forces(R), abs=1e-10)
    assert played.predicted == pytest.approx(track(gains, trajectory @ R.T).predicted, abs=1e-10)


def test_steps_are_the_compiled_run(problem_of, random_rotation, trajectory):
    transient = make_rotatable_transient(compute_stored_gains(problem_of(6, 0), N), trajectory)
    turns = np.array([random_rotation(k) for k in range(N + 5)])
    state, forces = make_initial_state(transient), []
    for R in turns:
        force, state = step(transient, state, R)
        forces.append(force)
    run = play(transient, turns)
    assert np.array(forces) == pytest.approx(run.forces, abs=0)
    assert state.tick == run.state.tick == N + 5
    assert state.x == pytest.approx(run.state.x, abs=0)


def test_a_normal_that_turns_is_solved_again_too(problem_of, difference):
    problem, draw = problem_of(6, 0), np.random.default_rng(0).standard_normal
    recording, normals = draw(N), draw((2, 3))
    transient = make_normal_transient(compute_stored_gains(problem, N), recording)
    before = play(transient, np.tile(normals[0], (40, 1)))
    after = play(transient, np.tile(normals[1], (N - 40, 1)), before.state)
    right = least_squares_forces(problem, np.outer(recording[40:], normals[1]), before.state.x)
    assert difference(after.forces, right) <= 1e-10


def test_overlapping_transients_superpose(problem_of, trajectory):
    problem, R = problem_of(6, 0), np.eye(3)
    transient = make_rotatable_transient(compute_stored_gains(problem, N), trajectory)
    alone = play(transient, np.tile(R, (N + 30, 1, 1)))
    late = np.vstack([np.zeros((30, 3)), alone.forces[:N]])
    x, answers = np.zeros(6), []
    for force in alone.forces + late:
        answers.append(problem.C @ x + problem.D @ force)
        x = problem.A @ x + problem.B @ force
    shifted = np.vstack([np.zeros((30, 3)), alone.predicted[:N]])
    assert np.array(answers) == pytest.approx(alone.predicted + shifted, abs=1e-9)


def test_a_restart_steers_out_what_still_rings(problem_of, difference, trajectory):
    problem, turns = problem_of(6, 0), np.tile(np.eye(3), (N, 1, 1))
    transient = make_rotatable_transient(compute_stored_gains(problem, N), trajectory)
    first = play(transient, turns[:30])
    again = play(transient, turns, restart(first.state))
    assert difference(again.forces, least_squares_forces(problem, trajectory, first.state.x)) <= 1e-10


def test_after_the_last_row_no_force_is_played_and_the_model_rings_out(problem_of, trajectory):
    transient = make_rotatable_transient(compute_stored_gains(problem_of(6, 0), N), trajectory)
    played = play(transient, np.tile(np.eye(3), (N + 400, 1, 1)))
    assert (played.forces[N:] == 0).all() and (played.forces[:N] != 0).any()
    assert np.abs(played.predicted[-1]).max() < 1e-3 * np.abs(played.predicted[:N]).max()


def test_a_direction_of_another_shape_is_refused(problem_of, trajectory):
    transient = make_rotatable_transient(compute_stored_gains(problem_of(4, 0), N), trajectory)
    with pytest.raises(TrackingError, match=r"shape \(3,\); this transient takes \(3, 3\)"):
        step(transient, make_initial_state(transient), np.ones(3))
