import numpy as np
import pytest

from analysis.look.imposed_motion import LARGEST_MISFIT, compute_law_misfit, is_motion_imposed

T = np.arange(20_000) / 1000
NOISE = np.random.default_rng(3).standard_normal(len(T))


def smooth(values, count=60):
    return np.convolve(values, np.hanning(count) / np.hanning(count).sum(), "same")


def hysteretic_force(x):
    """Force of a spring with a hardening and a hysteretic part."""
    held, force = 0.0, []
    for step in np.diff(x, prepend=x[0]):
        held = np.clip(held + 4 * step, -0.5, 0.5)
        force.append(held)
    return np.array(force) + x**3 + 0.01 * NOISE


def driven_motion(force, mass=1.0, damping=2.0, stiffness=40.0, friction=0.3):
    x = v = 0.0
    path = []
    for push in force:
        v += (push - damping * v - stiffness * x - friction * np.tanh(v / 0.01)) / mass / 1000
        x += v / 1000
        path.append(x)
    return np.array(path)


TRIANGLE = 2 * np.abs(2 * (0.5 * T % 1) - 1) - 1
SINE = np.sin(2 * np.pi * 1.3 * T)
SWEEP = np.sin(2 * np.pi * (0.2 + 0.12 * T) * T)
STEPS = np.sign(np.sin(2 * np.pi * 0.3 * T))


@pytest.mark.parametrize("motion", [TRIANGLE, SINE, SWEEP, T / 10, SINE * (1 + (T > 10))])
def test_a_motion_by_ramps_or_sines_is_imposed_on_what_answers_with_another_force(motion):
    measured = motion + 0.002 * NOISE
    assert compute_law_misfit(measured) < LARGEST_MISFIT
    assert is_motion_imposed(measured, hysteretic_force(motion))


@pytest.mark.parametrize("force", [TRIANGLE, SINE, SWEEP, STEPS, 5 * NOISE, smooth(9 * NOISE)])
def test_the_motion_of_a_driven_device_is_not_imposed(force):
    motion = driven_motion(force)
    assert not is_motion_imposed(motion + 0.001 * np.std(motion) * NOISE, force)


def test_where_both_follow_a_law_or_neither_does_nothing_is_said():
    assert not is_motion_imposed(SINE + 0.001 * NOISE, 3 * SINE + 0.02 * NOISE)
    assert not is_motion_imposed(smooth(NOISE), hysteretic_force(smooth(NOISE)))


@pytest.mark.parametrize("values", [np.ones(500), np.full(500, np.nan), T[:20]])
def test_what_does_not_move_or_is_too_short_says_nothing(values):
    assert compute_law_misfit(values) == 1.0
