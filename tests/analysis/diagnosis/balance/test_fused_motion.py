"""Positions and accelerations of the same point become one motion with less noise; of other points they stay apart."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from analysis.diagnosis.balance.balances import find_balances
from analysis.diagnosis.balance.fused_motion import SensorNoise
from analysis.diagnosis.balance.motion import Motion, compute_motions
from analysis.diagnosis.data.observed_parts import observe_parts
from equalizer.signals.band_limited import filter_low_pass
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import Signal

RATE_HZ, COUNT, STEPS = 1000.0, 12_000, 10
POSITION_NOISE, ACCELERATION_NOISE = 5e-6, 0.03
INNER = slice(500, -500)


@cache
def play(seed: int, mass: float = 0.2, coupling: float = 3e5):
    """Command (n,) that is held, position, velocity and acceleration just before each change of it; damping that grows
    with x squared: m a + 1.5 v + 80 x + coupling x² v = u. Semi-implicit Euler, 10 steps a sample."""
    random = np.random.default_rng(seed)
    lines_hz = np.arange(1, 90) / 2
    wave = np.cos(2 * np.pi * np.outer(np.arange(COUNT) / RATE_HZ, lines_hz) + random.uniform(0, 6.28, len(lines_hz)))
    command = 2.5 * wave.sum(axis=1) / np.abs(wave.sum(axis=1)).max()
    x = v = held = 0.0
    rows = np.empty((COUNT, 3))
    for sample, level in enumerate(command):
        rows[sample] = x, v, (held - (1.5 + coupling * x * x) * v - 80 * x) / mass
        held = level
        for _ in range(STEPS):
            v += (held - (1.5 + coupling * x * x) * v - 80 * x) / mass / (RATE_HZ * STEPS)
            x += v / (RATE_HZ * STEPS)
    return command, *rows.T


def record(command, position, acceleration, seed=1, noise=(POSITION_NOISE, ACCELERATION_NOISE)) -> Recording:
    random = np.random.default_rng(seed)
    position, acceleration = (samples.reshape(COUNT, -1) for samples in (position, acceleration))
    channels = position.shape[1]
    return Recording(
        "rig",
        Signal(command.reshape(COUNT, -1), RATE_HZ, "force", "N", ("fx", "fy")[: command.size // COUNT]),
        Signal(acceleration + noise[1] * random.standard_normal(acceleration.shape), RATE_HZ, "acceleration", "m/s^2",
               ("ax", "ay")[: acceleration.shape[1]]),
        Signal(position + noise[0] * random.standard_normal(position.shape), RATE_HZ, "position", "m",
               ("x", "y")[:channels]),
        hold=Hold.ZERO_ORDER,
    )  # fmt: skip


def observe(recording: Recording) -> Motion:
    return compute_motions(observe_parts([recording], len(recording.response.channels)))[0]


def observe_position_alone(recording: Recording) -> Motion:
    position = recording.position
    assert position is not None
    return observe(replace(recording, response=position))


def true_acceleration(motion: Motion, command, position, velocity, mass=0.2, coupling=3e5):
    """(n, 1): of the sampled equation of motion, within the motion's band."""
    resisting = (1.5 + coupling * position**2) * velocity + 80 * position
    half_later = motion.filter_to_band(np.column_stack([resisting, np.append(resisting[1:], 0)])).mean(axis=1)
    return ((motion.filter_to_band(command[:, None])[:, 0] - half_later) / mass)[:, None]


def relative_error(found, truth):
    return float(np.std((found - truth)[INNER]) / np.std(truth[INNER]))


@pytest.mark.parametrize("seed", [1, 2])
def test_an_acceleration_that_was_measured_too_takes_the_noise_away(seed):
    command, x, v, a = play(seed)
    recording = record(command, x, a, seed)
    fused, alone = observe(recording), observe_position_alone(recording)
    truth = true_acceleration(fused, command, x, v)
    assert fused.band_hz == alone.band_hz
    assert relative_error(fused.acceleration, truth) < 0.2 * relative_error(alone.acceleration, truth)
    assert relative_error(fused.acceleration, truth) < 0.012


def test_gain_and_offset_of_the_accelerometer_are_those_of_the_position():
    command, x, v, a = play(3)
    fused = observe(record(command, x, 1.04 * a + 0.7))
    assert relative_error(fused.acceleration, true_acceleration(fused, command, x, v)) < 0.012


@pytest.mark.parametrize("fault", ["late", "another mode", "of nothing", "slow sensor"])
def test_an_acceleration_of_something_else_is_left_out(fault):
    command, x, _, a = play(4)
    wrong = {
        "late": np.roll(a, 4),
        "another mode": a + 0.3 * filter_low_pass(np.roll(a, 9)[:, None], RATE_HZ, 30.0)[:, 0],
        "of nothing": np.random.default_rng(0).standard_normal(COUNT),
        "slow sensor": filter_low_pass(a[:, None], RATE_HZ, 20.0)[:, 0],
    }[fault]
    recording = record(command, x, wrong)
    assert np.array_equal(observe(recording).acceleration, observe_position_alone(recording).acceleration)


def test_each_position_finds_its_own_acceleration():
    command, x, v, a = play(5)
    other_command, other_x, other_v, other_a = play(6, mass=0.35)
    both = record(
        np.column_stack([command, other_command]), np.column_stack([x, other_x]), np.column_stack([other_a, a])
    )
    fused = observe(both)
    for axis, (played, position, velocity, mass) in enumerate(
        [(command, x, v, 0.2), (other_command, other_x, other_v, 0.35)]
    ):
        truth = true_acceleration(fused, played, position, velocity, mass)
        assert relative_error(fused.acceleration[:, [axis]], truth) < 0.012


def test_the_weights_are_those_of_the_least_variance():
    noise, omega = SensorNoise(2e-12, 3e-4), np.linspace(0.0, 3000.0, 50)
    low, high = noise.compute_position_weight(omega), noise.compute_acceleration_weight(omega)
    np.testing.assert_allclose(low - high * omega**2, 1.0)  # the true motion passes unchanged
    best = low**2 * noise.position + high**2 * noise.acceleration
    for change in (0.9, 1.1):
        changed = low * change
        worse = changed[1:] ** 2 * noise.position + ((1 - changed[1:]) / omega[1:] ** 2) ** 2 * noise.acceleration
        assert (worse > best[1:]).all()


def test_a_weak_law_is_found_that_the_position_alone_does_not_show():
    command, x, _, a = play(7, coupling=3e4)
    recording = record(command, x, a)
    assert recording.position is not None
    found, alone = (
        find_balances([each], frozenset(), lambda: True)[0]
        for each in (recording, replace(recording, response=recording.position))
    )
    assert [law.formula.text for law in found.named] == ["-p0*q**2*v"] and not alone.named
    assert found.named[0].formula.numbers[0] == pytest.approx(3e4, rel=0.02)
