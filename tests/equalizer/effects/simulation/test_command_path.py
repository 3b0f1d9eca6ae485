"""Against closed forms; what moves masses is the mean over a step, what an acceleration shows is its end."""

import numpy as np
import pytest

from equalizer.effects.effect import PlacedEffect
from equalizer.effects.force_saturation import EFFECT as SATURATION
from equalizer.effects.simulation.command_path import (
    compute_delayed_end,
    compute_delayed_mean,
    compute_lagged_end,
    compute_lagged_mean,
    subdivide_commands,
)
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.effects.slew_limit import EFFECT as SLEW
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel
from equalizer.signals.recording import Hold

STEP_S = 1e-3
TIME_S = np.arange(1, 41) * STEP_S
JUMP = np.ones(40)


def free_mass(**actuator) -> MechanicalModel:
    nothing, identity = np.zeros((1, 1)), np.eye(1)
    return MechanicalModel(
        "m", "acceleration", 2 * identity, nothing, nothing, identity, identity, actuator=ActuatorLimits(**actuator)
    )


def slewed(rate: float) -> tuple[np.ndarray, np.ndarray]:
    acts = SLEW.action
    return acts.change(JUMP, STEP_S, {"rate": rate}), acts.at_end(JUMP, STEP_S, {"rate": rate})


def test_a_lagged_jump_rises_exponentially():
    tau = 2.7e-3
    np.testing.assert_allclose(compute_lagged_end(JUMP, STEP_S, tau), 1 - np.exp(-TIME_S / tau), atol=1e-12)
    # The mean over a step is the difference of the integral t + tau exp(-t / tau).
    integral = np.concatenate([[tau], TIME_S + tau * np.exp(-TIME_S / tau)])
    np.testing.assert_allclose(compute_lagged_mean(JUMP, STEP_S, tau), np.diff(integral) / STEP_S, atol=1e-12)


def test_a_delay_by_whole_steps_shifts_and_by_a_part_shares_out():
    pulse = np.zeros(10)
    pulse[2] = 1.0
    assert np.flatnonzero(compute_delayed_mean(pulse, 1.0, 3.0)).tolist() == [5]
    np.testing.assert_allclose(compute_delayed_mean(pulse, 1.0, 3.25)[5:7], [0.75, 0.25])
    assert np.flatnonzero(compute_delayed_end(pulse, 1.0, 3.25)).tolist() == [5]
    assert not compute_delayed_mean(pulse, 1.0, 1e6).any()


def test_a_slew_limited_jump_is_a_ramp():
    mean, end = slewed(300.0)
    np.testing.assert_allclose(end, np.minimum(300 * TIME_S, 1.0), atol=1e-12)
    # On the ramp, half of rise time times height is missing.
    assert np.sum(1 - mean) * STEP_S == pytest.approx(0.5 / 300)


def test_a_slew_limit_follows_down_as_it_follows_up():
    there_and_back = np.concatenate([JUMP, -JUMP])
    end = SLEW.action.at_end(there_and_back, STEP_S, {"rate": 300.0})
    np.testing.assert_allclose(end[40:46], [0.7, 0.4, 0.1, -0.2, -0.5, -0.8], atol=1e-12)


def test_a_free_mass_shows_the_force_of_its_very_instant():
    """Not the mean over the last step, which would be early by half of it."""
    played = simulate_mechanism(free_mass(bandwidth_hz=100.0), np.ones((50, 1)), 1000.0)
    exact = (1 - np.exp(-2 * np.pi * 100 * np.arange(50) / 1000)) / 2
    np.testing.assert_allclose(played.response[:, 0], exact, atol=1e-12)


@pytest.mark.parametrize("delay_s", [0.4e-3, 0.5e-3, 2.7e-3])
def test_a_lagged_force_comes_late_by_a_part_of_a_step_too(delay_s):
    played = simulate_mechanism(free_mass(bandwidth_hz=100.0, delay_s=delay_s), np.ones((50, 1)), 1000.0)
    since_s = np.maximum(np.arange(50) / 1000 - delay_s, 0.0)
    exact = (1 - np.exp(-2 * np.pi * 100 * since_s)) / 2
    np.testing.assert_allclose(played.response[:, 0], exact, atol=2e-3)


def test_what_a_model_knows_of_its_actuator_comes_after_what_it_lacks():
    sites = PlacedEffect(SATURATION, (0,), {"limit": 0.5})
    commands = np.vstack([np.zeros((3, 1)), np.ones((47, 1))])
    played = simulate_mechanism(free_mass(delay_s=2e-3, limit=0.4), commands, 1000.0, [sites])
    np.testing.assert_allclose(played.response[:6, 0], 0, atol=1e-12)
    np.testing.assert_allclose(played.response[6:, 0], 0.4 / 2, atol=1e-12)


@pytest.mark.parametrize("hold", Hold)
def test_a_finer_command_ends_its_steps_where_the_samples_are(hold):
    time_s = np.arange(400) / 1000
    commands = np.sin(2 * np.pi * 20 * time_s)[:, None]
    fine = subdivide_commands(commands, 4, hold)
    before = commands[100:300] if hold is Hold.ZERO_ORDER else commands[101:301]
    np.testing.assert_allclose(fine.end[403:1203:4], before, atol=1e-3)
    assert fine.mean.shape == (1600, 1)


def test_an_actuator_that_is_not_there_is_reported():
    with pytest.raises(ValueError, match="force_saturation is placed at axis 3; there are 1"):
        simulate_mechanism(free_mass(), np.ones((5, 1)), 1000.0, [PlacedEffect(SATURATION, (2,), {"limit": 1.0})])
