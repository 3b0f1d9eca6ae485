"""Where a force balance names laws along one body per command, its own parameters are the first model."""

from dataclasses import replace

import numpy as np
import pytest


@pytest.fixture(scope="module")
def play_axis(axis_module, find_balance):
    def balances(physics):
        command = axis_module.random_course(1, 2000, 250.0) * 5.0
        noise = 3e-6 * np.random.default_rng([1, 9]).standard_normal(len(command))
        position, _ = axis_module.simulate_axis(physics.numbers(), command, np.zeros(2), noise, 250.0)
        recording = axis_module.make_recording(command[:, None], position[:, None], 250.0)
        return find_balance(recording), recording

    return balances


@pytest.fixture(scope="module")
def rubbing(play_axis, axis_module):
    return play_axis(replace(axis_module.Physics(), coulomb=0.8))


def test_beside_friction_it_is_that_of_the_balance(rubbing):
    from analysis.diagnosis.first_model.model_from_balance import build_plain_model

    model = build_plain_model(*rubbing, "first")
    assert model is not None
    assert model.mass[0, 0] == pytest.approx(0.3, rel=0.05)
    assert model.stiffness[0, 0] == pytest.approx(100.0, rel=0.1)


@pytest.mark.slow
def test_without_a_named_law_another_fit_is_asked_for(play_axis, axis_module):
    from analysis.diagnosis.first_model.model_from_balance import build_plain_model

    assert build_plain_model(*play_axis(axis_module.Physics()), "first") is None


@pytest.mark.slow
def test_a_second_body_asks_for_another_fit(play_axis, axis_module):
    from analysis.diagnosis.first_model.model_from_balance import build_plain_model

    assert build_plain_model(*play_axis(replace(axis_module.Physics(), coulomb=0.8, second_mass=0.1)), "first") is None


def test_beside_a_law_of_the_command_it_is_fitted_without_the_modes_that_it_lacks(play_axis, axis_module):
    """A law of the command acts on the whole of it, so that no mode is subtracted from the command."""
    from analysis.diagnosis.balance.judged_law import NO_COLUMN
    from analysis.diagnosis.first_model.model_from_balance import build_plain_model

    (balance,), recording = play_axis(replace(axis_module.Physics(), coulomb=0.8, second_mass=0.1, second_hz=5.0))
    curved = replace(balance, laws=(replace(balance.named[0], law_index=NO_COLUMN),))
    regression = balance.search.regression
    assert regression.base_column_count > 4  # mass, damping, stiffness, a constant, and the second body
    expected = regression.fit_weights([0, 1, 2, regression.base_column_count - 1])
    model = build_plain_model((curved,), recording, "first")
    assert [model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0]] == pytest.approx(list(expected[:3]))


def test_a_band_holds_the_friction_of_a_slow_motion_but_no_ripple_above_it(rubbing):
    from analysis.diagnosis.first_model.model_from_balance import compute_law_power_share

    balances, _ = rubbing
    shares = [compute_law_power_share(balances, band_hz) for band_hz in (1e-3, 1.0, 1e3)]
    assert shares[0] < 0.05 and shares[0] < shares[1] < shares[2]
    assert shares[2] == pytest.approx(1.0)
