"""Laws are found within the band in which the device moves, where part of a command reaches no motion."""

import numpy as np
import pytest

from analysis.diagnosis.balance.motion import compute_motion_band_hz, compute_motions
from analysis.diagnosis.data.observed_parts import observe_parts

RATE_HZ, SECONDS, SEED = 300.0, 20.0, 3
INERTIA, DAMPING, SPRING, LAG_S, STEP, FIRST, DITHER = 1e-3, 1.2e-2, 1.6, 0.03, 6e-3, 1.2, 3.0


def simulate_arm(cube, seed=SEED):
    """Command in steps, with a tone in it that is not played, and angle, (n,) each: a drive that lags, a spring that
    hardens, an encoder of coarse steps."""
    rng = np.random.default_rng(seed)
    count, fine = int(RATE_HZ * SECONDS), 5
    command = np.repeat([FIRST, *rng.uniform(0.1, 1.0, 19)], count // 20)
    angle, q, v, push, dt = np.zeros(count), 0.0, 0.0, 0.0, 1 / (fine * RATE_HZ)
    for k in range(count):
        angle[k] = STEP * np.round(q / STEP)
        for _ in range(fine):
            push += dt * (command[k] - push) / LAG_S
            v += dt * (push - DAMPING * v - SPRING * q - cube * q**3) / INERTIA
            q += dt * v
    return command + DITHER * np.sin(2 * np.pi * 20 * np.arange(count) / RATE_HZ), angle


@pytest.fixture
def record_arm(record_samples):
    def made(cube):
        command, angle = simulate_arm(cube)
        return record_samples(command[:, None], angle[:, None], RATE_HZ)

    return made


@pytest.mark.slow
def test_a_spring_that_hardens_shows_in_the_band_of_the_motion(record_arm, find_balance):
    recording = record_arm(1.5)
    motions = compute_motions(observe_parts([recording], 1))
    (balance,) = find_balance(recording)
    assert balance.search.regression.motions[0].band_hz == pytest.approx(compute_motion_band_hz(motions, [0]))
    (law,) = balance.named
    assert "hardening_stiffness" in (law.law.effect, *law.equivalents)
    assert law.gain_low > 0.1


@pytest.mark.slow
def test_a_straight_spring_has_no_name_in_either_band(record_arm, find_balance):
    assert not find_balance(record_arm(0.0))[0].named


def test_a_slow_course_moves_in_a_narrow_band(record_samples):
    time_s = np.arange(3000) / RATE_HZ
    slow = np.sin(2 * np.pi * time_s) + 0.001 * np.sin(2 * np.pi * 30 * time_s)
    motions = compute_motions(observe_parts([record_samples(slow[:, None], slow[:, None], RATE_HZ)], 1))
    assert compute_motion_band_hz(motions, [0]) == pytest.approx(1.0, abs=0.2)
