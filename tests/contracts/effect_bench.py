"""Invented devices with one effect each: what they answer, and the evidence that a diagnosis would draw from it."""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.missing_force import missing_force
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.evidence import Evidence
from equalizer.effects.simulator import Played, simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits

RATE_HZ, PERIOD_S = 1000.0, 2.0
LEVELS_N = (0.5, 1.5, 3.0)
NOISE_MPS2, NOISE_M = 0.042, 4.9e-6


def one_axis() -> MechanicalModel:
    """A handle on a spring at 4 Hz with a part that swings at 85 Hz."""
    mass, damping, stiffness = np.diag([0.3, 0.03]), np.diag([5.0, 0.0]), np.diag([230.0, 0.0])
    return _with_modes(mass, damping, stiffness, [np.array([1.0])], [85.0])


def three_axes() -> MechanicalModel:
    mass = np.diag([0.30, 0.29, 0.27, 0.05, 0.05, 0.023])
    mass[0, 1] = mass[1, 0] = -0.012
    damping = np.diag([5.5, 6.0, 5.0, 0, 0, 0])
    stiffness = np.diag([230.0, 240.0, 220.0, 0, 0, 0])
    ways = [np.array([0.3, 0.9, -0.2]), np.array([0.5, 0.2, 0.8]), np.array([0.8, 0.5, -0.3])]
    return _with_modes(mass, damping, stiffness, ways, [21.0, 96.0, 180.0])


def _with_modes(mass, damping, stiffness, ways, frequencies_hz) -> MechanicalModel:
    n, m = len(mass), len(ways[0])
    for k, (way, frequency_hz) in enumerate(zip(ways, frequencies_hz, strict=True)):
        tie = np.zeros(n)
        tie[:m], tie[m + k] = -way / np.linalg.norm(way), 1
        body, turning = mass[m + k, m + k], 2 * np.pi * frequency_hz
        stiffness = stiffness + body * turning**2 * np.outer(tie, tie)
        damping = damping + 0.06 * body * turning * np.outer(tie, tie)
    driven = np.eye(n)[:, :m]
    sensor = SensorLimits(bandwidth_hz=300.0, range=200.0)
    return MechanicalModel("bench", "acceleration", mass, damping, stiffness, driven, driven.T, sensor)


def commands(m: int, levels_n: tuple[float, ...] = LEVELS_N, periods: int = 2, seed: int = 1) -> np.ndarray:
    """(n, m), N: odd random-phase multisines, one axis after the other at each level, then all axes slowly."""
    n = int(PERIOD_S * RATE_HZ)
    parts = []
    for axis in range(m):
        for level in levels_n:
            rows = np.zeros((periods * n + n // 4, m))
            rows[: periods * n, axis] = np.tile(level * odd_multisine(seed + axis), periods)
            parts.append(rows)
    time_s = np.arange(3 * n)[:, None] / RATE_HZ
    rise = np.minimum(time_s / 0.5, 1)
    parts.append(1.6 * rise * np.sin(2 * np.pi * np.array([0.9, 1.3, 2.1])[:m] * time_s))
    return np.vstack(parts)


def odd_multisine(seed: int, lines: np.ndarray | None = None) -> np.ndarray:
    """(n,): one period, largest magnitude 1; three odd lines of four, from 1.5 to 239.5 Hz."""
    generator, n = np.random.default_rng(seed), int(PERIOD_S * RATE_HZ)
    odd = np.arange(3, 480, 2)
    chosen = odd[(odd // 2) % 4 != 2] if lines is None else lines
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    spectrum[chosen] = chosen**-0.5 * np.exp(2j * np.pi * generator.random(len(chosen)))
    period = np.fft.irfft(spectrum, n)
    return period / np.abs(period).max()


def silent_odd_lines() -> np.ndarray:
    odd = np.arange(3, 480, 2)
    return odd[(odd // 2) % 4 == 2]


@dataclass(frozen=True, slots=True)
class Measured:
    command: np.ndarray
    played: Played
    response: np.ndarray
    position: np.ndarray


def measured(model, placed, command: np.ndarray, seed: int | None = 0) -> Measured:
    """With noise, unless the seed is None."""
    played = simulate_mechanism(model, command, RATE_HZ, placed)
    generator, noisy = np.random.default_rng(seed), 0.0 if seed is None else 1.0
    response = played.response + noisy * NOISE_MPS2 * generator.standard_normal(played.response.shape)
    position = played.position + noisy * NOISE_M * generator.standard_normal(played.position.shape)
    return Measured(command, played, response, position)


def evidence(model: MechanicalModel, seen: Measured) -> Evidence:
    """As a diagnosis gathers it, of a model whose own numbers are right."""
    predicted = simulate_mechanism(model, seen.command, RATE_HZ)
    p = model.outputs
    unit = np.repeat([NOISE_MPS2, NOISE_M], p)
    left = np.hstack([seen.response - predicted.response, seen.position - predicted.position]) / unit
    expected = 0.1 * np.sqrt(np.mean(seen.command**2, axis=0))
    missing = missing_force(model, left, unit, RATE_HZ, expected)
    return Evidence(
        model=model,
        sample_rate_hz=RATE_HZ,
        command=seen.command,
        axis_position=predicted.axis_position + missing.position,
        axis_velocity=predicted.axis_velocity + missing.velocity,
        axis_force=missing.force,
        response=seen.response,
        predicted=predicted.response,
        noise=np.full(p, NOISE_MPS2),
        used=np.ones(len(seen.command)),
        position=seen.position,
        predicted_position=predicted.position,
        position_noise=np.full(p, NOISE_M),
    )


def placed(name: str, values: dict[str, float], *sites: int) -> tuple[PlacedEffect, ...]:
    return (PlacedEffect(EFFECTS[name], sites, values),)
