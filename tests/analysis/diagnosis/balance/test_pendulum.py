"""A weight on a lever: named as such, and not as cogging that repeats once per turn."""

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

RATE_HZ, TURN, RUBBING, SEED = 200.0, 0.25, 0.02, 5
INERTIA, DAMPING = 0.01, 0.002


def simulate_lever(weight, rubbing, seed=SEED):
    """Torque and angle, (n,) each, in steps of a tenth of a sample; dry friction with a narrow ramp about rest."""
    rng = np.random.default_rng(seed)
    torque = filtfilt(*butter(3, 2 / (RATE_HZ / 2)), rng.standard_normal(6000))
    torque *= 0.15 / torque.std()
    angle, q, v, step_s = np.zeros(len(torque)), 0.0, 0.0, 0.1 / RATE_HZ
    for k, push in enumerate(torque):
        angle[k] = q
        for _ in range(10):
            v += step_s * (push - DAMPING * v - rubbing * np.tanh(v / 0.02) - weight * np.sin(q)) / INERTIA
            q += step_s * v
    return torque, angle + 1e-4 * rng.standard_normal(len(angle))


@pytest.fixture
def find_lever_balance(record_samples, find_balance):
    def found(weight, rubbing):
        torque, angle = simulate_lever(weight, rubbing)
        recording = record_samples(torque[:, None], angle[:, None], RATE_HZ, unit="rad")
        return find_balance(recording)[0]

    return found


@pytest.mark.slow
def test_the_weight_of_a_lever_is_recovered(find_lever_balance):
    named = {law.law.effect: law.values for law in find_lever_balance(TURN, RUBBING).named}
    assert named["gravity_torque"]["torque"] == pytest.approx(TURN, rel=0.02)
    assert named["gravity_torque"]["angle"] == pytest.approx(0.0, abs=0.02)
    assert "cogging" not in named


@pytest.mark.slow
def test_a_balanced_lever_has_no_weight(find_lever_balance):
    assert "gravity_torque" not in {law.law.effect for law in find_lever_balance(0.0, RUBBING).named}


@pytest.mark.slow
def test_a_weight_that_a_spring_would_have_to_cancel_is_not_named(record_samples, find_balance):
    """A weak bend of a spring over a small travel is what is left of a huge weight beside its tangent."""
    rng = np.random.default_rng(SEED)
    angle = filtfilt(*butter(3, 2 / (RATE_HZ / 2)), rng.standard_normal(8000))
    angle *= 0.35 / np.abs(angle).max()
    speed = np.gradient(angle) * RATE_HZ
    huge = 20.0 * (np.sin(angle + 0.3) - np.sin(0.3) - np.cos(0.3) * angle)
    force = angle + 0.01 * speed + huge
    force += 0.01 * force.std() * rng.standard_normal(len(force))
    recording = record_samples(force[:, None], angle[:, None], RATE_HZ, unit="rad", meta={"imposed": "position"})
    (found,) = find_balance(recording)
    law = next(each for each in found.laws if each.law.effect == "gravity_torque")
    assert "times the recorded force" in law.objection
