"""Invented devices with one effect each: what they answer, and the evidence that a diagnosis would draw from it."""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.forces.missing_force import estimate_missing_force
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.simulator import SimulationResult, simulate_mechanism
from equalizer.effects.starts.evidence import Evidence
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
    played: SimulationResult
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
    missing = estimate_missing_force(model, left, unit, RATE_HZ, expected)
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


EXAMPLES: dict[str, dict[str, float]] = {
    "coulomb_friction": {"level": 0.08},
    "asymmetric_friction": {"level_positive": 0.1, "level_negative": 0.05},
    "stribeck_friction": {"coulomb": 0.06, "static": 0.12, "speed": 0.01},
    "position_dependent_friction": {"level": 0.08, "slope_per_m": 40.0, "bend_per_m2": 3000.0},
    "presliding_hysteresis": {"level": 0.1, "stiffness": 3000.0},
    "viscous_damping": {"damping": 2.0},
    "quadratic_damping": {"coefficient": 8.0},
    "hardening_stiffness": {"k3": 1e6},
    "asymmetric_stiffness": {"k2": 6000.0},
    "constant_force": {"force": 0.1},
    "gravity_torque": {"torque": 0.1, "angle": 0.5},
    "cogging": {"amplitude": 0.1, "pitch": 0.002, "phase": 0.7},
    "backlash": {"gap": 5e-5, "motor_mass": 0.09, "contact_stiffness": 3e5, "contact_damping": 9.0},
    "loose_joint": {"gap": 1e-5, "stiffness": 4000.0, "slip": 0.02},
    "end_stop": {"position": 0.005, "stiffness": 3000.0, "opposite": 0.0},
    "pose_dependent_inertia": {"per_m": 15.0, "speed_share": 0.5},
    "extra_mode": {"frequency": 43.0, "mass": 0.012, "damping_ratio": 0.05, "tilt_next": 0.0, "tilt_after_next": 0.0},
    "added_mass": {"mass": 0.03},
    "hand_impedance": {"mass": 0.03, "damping": 1.5, "stiffness": 100.0},
    "time_varying_grip": {"rate_hz": 0.23, "depth": 0.5, "phase": 1.0, "stiffness_share": 0.0},
    "body_on_actuator": {"mass": 0.02, "damping": 2.0, "stiffness": 500.0},
    "force_saturation": {"limit": 2.0},
    "force_deadband": {"width": 0.05},
    "slew_limit": {"rate": 300.0},
    "amplifier_lag": {"time_constant": 0.001},
    "transport_delay": {"delay": 0.0013},
    "force_gain": {"gain": 0.9},
    "force_nonlinearity": {"square": 0.4, "reference": 1.0},
    "sensor_lag": {"bandwidth": 90.0},
    "sensor_clipping": {"limit": 8.0},
    "sensor_misalignment": {"about_x": 3.0, "about_y": -2.0, "about_z": 4.0},
    "cross_axis_sensitivity": {"from_next": 0.05, "from_after_next": -0.03},
    "sensor_gain": {"gain": 0.9},
    "sensor_nonlinearity": {"cubic": 2e-3},
    "sensor_offset": {"offset": 0.3},
    "sensor_drift": {"total": 0.5, "bend": 0.3},
    "quantization": {"step": 0.2},
    "mains_hum": {"amplitude": 0.1, "frequency": 50.03, "phase": 0.4},
    "clock_drift": {"ppm": 60.0, "interpolated": 1.0},
    "logger_offset": {"offset": 0.0013},
    "lost_samples": {"fraction": 0.02},
}
"""Of strengths that can be seen on the one-axis bench."""
NEEDS_THREE_AXES = ("sensor_misalignment", "cross_axis_sensitivity")


def bench_of(name: str) -> MechanicalModel:
    return three_axes() if name in NEEDS_THREE_AXES else one_axis()


def example(name: str, model: MechanicalModel, **changes: float) -> tuple[PlacedEffect, ...]:
    """At the first axis or channel, or at all where it befalls all."""
    effect = EFFECTS[name]
    sites = (0,) if "one" in effect.sites else tuple(range(model.inputs))
    return placed(name, EXAMPLES[name] | changes, *sites)


def absent(name: str, model: MechanicalModel) -> tuple[PlacedEffect, ...]:
    return example(
        name,
        model,
        **{parameter.name: parameter.none for parameter in EFFECTS[name].parameters if parameter.none is not None},
    )


@dataclass(frozen=True, slots=True)
class Distortion:
    """Power at silent lines over that at driven ones, dB; per level."""

    odd: list[float]
    even: list[float]


def distortion(model: MechanicalModel, effects: tuple[PlacedEffect, ...], signal: str = "response") -> Distortion:
    """Of the first axis in its steady state, at each level, without noise."""
    odd, even, n = [], [], int(PERIOD_S * RATE_HZ)
    for level in LEVELS_N:
        command = np.zeros((4 * n, model.inputs))
        command[:, 0] = np.tile(level * odd_multisine(5), 4)
        answer = getattr(simulate_mechanism(model, command, RATE_HZ, effects), signal)[:, 0]
        lines = np.abs(np.fft.rfft(answer[-2 * n :].reshape(2, n).mean(axis=0))) ** 2
        driven = np.setdiff1d(np.arange(3, 480, 2), silent_odd_lines())
        whole = lines[driven].mean()
        odd.append(10 * np.log10(lines[silent_odd_lines()].mean() / whole))
        even.append(10 * np.log10(lines[4:480:2].mean() / whole))
    return Distortion(odd, even)
