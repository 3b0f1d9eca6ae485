"""Dry friction and a dead band of the actuator, distinguished on trapezoidal moves with rests between them."""

import numpy as np
import pytest

from analysis.diagnosis.balance.judged_law import find_family
from tests.analysis.diagnosis.balance.invented_axis import make_recording
from tests.slow_instances import slow

RATE_HZ, STEPS = 250.0, 20
MASS_KG, DAMPING_N_S_PER_M, GAINS = 0.4, 0.3, (400.0, 25.0)
LEVEL_N = 4.0


def reference_m():
    """(n,): three moves of 10 m, there and back and there, with rests."""
    ramp, rest = np.linspace(0.0, 1.0, int(0.6 * RATE_HZ)), np.zeros(int(0.25 * RATE_HZ))
    speed = np.concatenate([ramp, np.ones(int(1.9 * RATE_HZ)), ramp[::-1], rest])
    whole = np.cumsum(np.concatenate([speed, -speed, speed])) / RATE_HZ
    return 10.0 * whole / whole.max()


def simulate_motor(friction_n, dead_band_n, seed, spring_n_per_m2=0.0, noise_share=0.1):
    """A motor under position control; a spring pulls it with the square of the distance from half way. noise_share: of
    what is recorded of its command."""
    random, aims = np.random.default_rng(seed), reference_m()
    position, command = np.empty(len(aims)), np.empty(len(aims))
    q = v = 0.0
    for k, (aim, noise) in enumerate(
        zip(aims.tolist(), (1e-4 * random.standard_normal(len(aims))).tolist(), strict=True)
    ):
        position[k] = q + noise
        command[k] = GAINS[0] * (aim - position[k]) - GAINS[1] * v
        force = np.sign(command[k]) * max(abs(command[k]) - dead_band_n, 0.0)
        for _ in range(STEPS):
            pull = spring_n_per_m2 * (q - 5.0) ** 2
            free = v + (force - DAMPING_N_S_PER_M * v - pull) / MASS_KG / (STEPS * RATE_HZ)
            v = np.sign(free) * max(abs(free) - friction_n / MASS_KG / (STEPS * RATE_HZ), 0.0)
            q += v / (STEPS * RATE_HZ)
    command += noise_share * command.std() * random.standard_normal(len(command))
    return make_recording(command[:, None], position[:, None], RATE_HZ)


@pytest.mark.parametrize("seed", [0, *slow(1, 2)])
def test_friction_that_holds_a_motor_between_its_moves_is_no_dead_band(find_balance, seed):
    (balance,) = find_balance(simulate_motor(LEVEL_N, 0.0, seed))
    (named,) = balance.named
    assert named.law.effect in find_family("coulomb_friction")


@pytest.mark.slow
def test_a_named_spring_does_not_hide_friction_that_two_laws_share(find_balance):
    """The balance holds two frictions, of which neither seems necessary beside the other."""
    (balance,) = find_balance(simulate_motor(LEVEL_N, 0.0, 1, spring_n_per_m2=0.1, noise_share=0.03))
    named = {law.law.effect for law in balance.named}
    assert len(named) == 2
    assert named & find_family("asymmetric_stiffness") and named & find_family("coulomb_friction")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *slow(1, 2)])
def test_a_dead_band_beside_which_the_motor_coasts_is_no_friction(find_balance, seed):
    (balance,) = find_balance(simulate_motor(0.0, LEVEL_N, seed))
    assert not [law for law in balance.named if law.law.effect != "force_deadband"]
