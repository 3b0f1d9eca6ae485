"""The integrator against exact answers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from study.evaluation.challenge.concealed_effect import replace_cells, replace_handle_forces
from study.evaluation.challenge.device import Device, simulate_motion
from study.evaluation.challenge.drive_plan import RATE_HZ
from study.evaluation.challenge.friction_kernel import BRISTLE_STIFFNESS, LEVEL_NEGATIVE, LEVEL_POSITIVE
from study.evaluation.challenge.handle_force_kernel import QUADRATIC_DAMPING


def exactly(bench, command):
    """Acceleration and position of the linear bench, held forces, by the matrix exponential."""
    mass, damping, stiffness = bench.assemble_matrices()
    n = len(mass)
    inverse = np.linalg.inv(mass)
    whole = np.zeros((2 * n + 3,) * 2)
    whole[:n, n : 2 * n] = np.eye(n)
    whole[n : 2 * n, : 2 * n] = -inverse @ np.hstack([stiffness, damping])
    whole[n : 2 * n, 2 * n :] = inverse[:, :3]
    step = expm(whole / RATE_HZ)
    state, before = np.zeros(2 * n), np.zeros(3)
    acceleration, position = [], []
    for force in command:
        acceleration.append(whole[n : n + 3] @ np.concatenate([state, before]))
        position.append(state[:3])
        state, before = step[: 2 * n] @ np.concatenate([state, force]), force
    return np.array(acceleration), np.array(position)


def test_the_linear_bench_moves_as_the_matrix_exponential_says(bench, command):
    acceleration, position = simulate_motion(Device(bench), command)
    true_acceleration, true_position = exactly(bench, command)
    assert (acceleration - true_acceleration).std() < 0.01 * true_acceleration.std()
    assert (position - true_position).std() < 1e-3 * true_position.std()


def test_a_sample_is_read_before_its_own_command_acts(bench):
    command = np.zeros((5, 3))
    command[2:, 0] = 1.0
    acceleration, _ = simulate_motion(Device(bench), command)
    assert not acceleration[:3].any()
    assert acceleration[3, 0] == pytest.approx(np.linalg.inv(bench.assemble_matrices()[0])[0, 0], rel=0.2)


def test_friction_above_the_drive_holds_the_handle(bench, command):
    held = replace_cells(np.zeros((3, 7)), 0, {LEVEL_POSITIVE: 50.0, LEVEL_NEGATIVE: 50.0, BRISTLE_STIFFNESS: 3e6})
    _, position = simulate_motion(Device(bench, friction=held), command)
    assert np.abs(position[:, 0]).max() < 2e-5 < np.abs(position[:, 1]).max()


def test_drag_takes_energy_away_and_an_even_spring_does_not_blow_up(bench, command):
    _, free = simulate_motion(Device(bench), command)
    _, dragged = simulate_motion(replace_handle_forces(Device(bench), 0, {QUADRATIC_DAMPING: 50.0}), command)
    assert dragged[:, 0].std() < free[:, 0].std()


def test_a_device_that_runs_away_is_refused(bench, command):
    with pytest.raises(ValueError, match="ran away"):
        simulate_motion(replace(Device(bench), coupling=1e7), command)
