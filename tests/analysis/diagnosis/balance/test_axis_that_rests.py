"""An axis that rests now and then, or mostly: what it is given at rest tells nothing, and hides the friction."""

import numpy as np
import pytest

from analysis.diagnosis.balance.balances import balance_selected_motions, select_samples_in_motion
from analysis.diagnosis.balance.motion import compute_motions
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.limits import MOVING_TIME_SHARE

RATE_HZ, LEVEL, MASS, DAMPING = 100.0, 0.4, 0.05, 0.8


def _simulate_hunting(friction, seconds=120.0, fine=20):
    """Force and position (n, 1) of an axis that an integrating controller leads after a slow target; it waits at
    the end of each way, while its force wanders below what moves the axis."""
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
def hunting_balance(record_samples, find_balance):
    force, position = _simulate_hunting(LEVEL)
    return position, find_balance(record_samples(force, position, RATE_HZ))[0]


@pytest.mark.slow
def test_friction_of_an_axis_that_rests_at_its_targets_is_named(hunting_balance):
    position, balance = hunting_balance
    speed = np.gradient(position[:, 0], 1 / RATE_HZ)
    (named, *_) = balance.named

    assert np.mean(np.abs(speed) > 0.1 * speed.std()) < MOVING_TIME_SHARE + 0.3
    assert named.law.effect in ("coulomb_friction", "presliding_hysteresis")
    assert named.values["level"] == pytest.approx(LEVEL, rel=0.15)


@pytest.mark.slow
def test_an_axis_that_follows_without_friction_gets_no_name(record_samples, find_balance):
    (balance,) = find_balance(record_samples(*_simulate_hunting(0.0, seconds=60.0), RATE_HZ))

    assert not balance.named


def _simulate_pushes(friction, width=0.0, wander=0.95, seconds=120.0, fine=20, seed=3):
    """Force and position (n, 1) of an axis that is pushed now and then beyond what holds it, friction or a dead band.
    wander: of the force in between, as a share of that."""
    rng, n, step_s = np.random.default_rng(seed), int(seconds * RATE_HZ), 1 / (RATE_HZ * fine)
    course = np.convolve(rng.standard_normal(n + 100), np.hanning(100), "same")[:n]
    force = wander * LEVEL * np.clip(1.6 * course / np.abs(course).max(), -1, 1)
    push = np.hanning(80)
    for number, start_s in enumerate(np.arange(2, seconds - 3, 6.0)):
        first = int((start_s + rng.uniform(0, 2)) * RATE_HZ)
        force[first : first + len(push)] = (LEVEL + 0.25 * rng.uniform(0.7, 1.5)) * (-1) ** number * push
    place = speed = 0.0
    position = np.zeros((n, 1))
    for k in range(n):
        position[k], given = place, force[k] - np.clip(force[k], -width, width)
        for _ in range(fine):
            if friction and abs(speed) < 1e-3 and abs(given) <= friction:
                speed = 0.0
                continue
            way, before = np.sign(speed) or np.sign(given), speed
            speed += step_s * (given - DAMPING * speed - friction * way) / MASS
            speed = 0.0 if friction and before * speed < 0 else speed
            place += step_s * speed
    return force[:, None], position + 1e-4 * rng.standard_normal((n, 1))


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "width"), [(LEVEL, 0.0), pytest.param(0.0, LEVEL, marks=pytest.mark.slow)])
def test_a_dead_band_of_an_axis_that_rests_within_it_may_be_dry_friction(friction, width, record_samples, find_balance):
    (balance,) = find_balance(record_samples(*_simulate_pushes(friction, width), RATE_HZ))
    band = next(law for law in balance.named if law.law.effect == "force_deadband")

    assert band.values["width"] == pytest.approx(LEVEL, rel=0.15)
    assert "coulomb_friction" in band.equivalents


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "wander"), [(LEVEL, 0.95), (0.0, 0.0)])
def test_samples_in_motion_alone_show_what_holds_the_axis(friction, wander, record_samples):
    """The look that is taken where an axis mostly rests, and nothing is named over all samples."""
    force, position = _simulate_pushes(friction, wander=wander)
    speed = np.gradient(position[:, 0], 1 / RATE_HZ)
    assert np.mean(speed**2 > 0.01 * np.mean(speed**2)) < MOVING_TIME_SHARE
    records = observe_parts((record_samples(force, position, RATE_HZ),), 1)
    found = balance_selected_motions(
        select_samples_in_motion, records, compute_motions(records), frozenset(), lambda: True, map
    )
    assert bool(found) == bool(friction)
