"""A single move, with rest before and after it, tests no law: nothing is named, and nothing is a candidate."""

import numpy as np
import pytest

RATE_HZ, SECONDS, STEP = 500.0, 8.0, 1e-4
GAINS = (300.0, 8.0)


@pytest.fixture(scope="module")
def find_move_balance(axis_module, find_balance):
    def found(moves):
        """moves: of a controller's reference, spread over the recording."""
        physics = axis_module.Physics(stiffness=0.0, damping=4.0, coulomb=1.5)
        count = int(RATE_HZ * SECONDS)
        reference = np.zeros(count)
        for move in range(moves):
            begin = count // 10 + move * count // moves
            reference[begin : begin + (count if moves == 1 else count // (2 * moves))] = 0.1 * (1 + 0.2 * (move % 3))
        noise = 1e-6 * np.random.default_rng(4).standard_normal(count)
        position, force = axis_module.simulate_axis(physics.numbers(), reference, np.array(GAINS), noise, RATE_HZ)
        position = STEP * np.round(position / STEP)
        return find_balance(axis_module.make_recording(force[:, None], position[:, None], RATE_HZ))[0]

    return found


@pytest.mark.slow
def test_a_single_step_tests_and_names_no_law(find_move_balance):
    found = find_move_balance(1)
    assert not found.tested
    assert not found.laws
    assert not found.further_laws


@pytest.mark.slow
def test_many_steps_show_the_friction(find_move_balance):
    found = find_move_balance(12)
    assert found.tested
    assert any("coulomb_friction" in (law.law.effect, *law.equivalents) for law in found.named)
