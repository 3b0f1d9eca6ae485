"""An axis that friction holds most of the time: what it is given at rest tells nothing, and hides the friction."""

import numpy as np
import pytest

from analysis.diagnosis.settings import MOVES_MOST_OF_THE_TIME

RATE_HZ, LEVEL, MASS, DAMPING = 100.0, 0.4, 0.05, 0.8


def _hunt(friction, seconds=120.0, fine=20):
    """Force and position (n, 1) of an axis that an integrating controller leads after a slow target; it waits for half
    of the time, while its force wanders below what moves the axis."""
    rng, n, step_s = np.random.default_rng(3), int(seconds * RATE_HZ), 1 / (RATE_HZ * fine)
    target = np.interp(np.arange(n) / RATE_HZ, np.arange(0, seconds + 6, 6), rng.uniform(-1, 1, int(seconds / 6) + 1))
    place = speed = kept = 0.0
    force, position = np.zeros((n, 1)), np.zeros((n, 1))
    for k in range(n):
        kept += 2.0 * (target[k] - place) / RATE_HZ
        given = 1.5 * (target[k] - place) + kept - 0.3 * speed
        force[k], position[k] = given, place
        for _ in range(fine):
            if friction and abs(speed) < 1e-3 and abs(given) <= friction:
                speed = 0.0
                continue
            way = np.sign(speed) or np.sign(given)
            before = speed
            speed += step_s * (given - DAMPING * speed - friction * way) / MASS
            speed = 0.0 if friction and before * speed < 0 else speed
            place += step_s * speed
    return force, position + 1e-4 * rng.standard_normal((n, 1))


@pytest.fixture(scope="module")
def held(recording_of, balance_of):
    force, position = _hunt(LEVEL)
    return position, balance_of(recording_of(force, position, RATE_HZ))[0]


def test_friction_of_an_axis_that_mostly_rests_is_named(held):
    position, balance = held
    speed = np.gradient(position[:, 0], 1 / RATE_HZ)
    (named, *_) = balance.named

    assert np.mean(np.abs(speed) > 0.1 * speed.std()) < MOVES_MOST_OF_THE_TIME + 0.3
    assert named.law.effect in ("coulomb_friction", "presliding_hysteresis")
    assert named.values["level"] == pytest.approx(LEVEL, rel=0.15)


def test_an_axis_that_rests_without_friction_gets_no_name(recording_of, balance_of):
    (balance,) = balance_of(recording_of(*_hunt(0.0, seconds=60.0), RATE_HZ))

    assert not balance.named
