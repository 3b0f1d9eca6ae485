"""A device with physics of its own, clean or with a fault, and what the comparison of both says."""

from dataclasses import replace
from functools import cache

import numpy as np

from analysis.diagnosis.contrast.choose_fault import Decision, choose_fault
from analysis.diagnosis.contrast.rank_faults import rank_faults
from analysis.diagnosis.reference.compare_with_reference import Contrast, find_contrast
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal

RATE_HZ, COUNT = 500.0, 5000
SLOW = 400
"""Samples in which the model error changes."""
UNDONE = (
    "coulomb_friction", "asymmetric_friction", "presliding_hysteresis", "viscous_damping", "quadratic_damping",
    "force_gain", "force_gain_drift", "actuator_cubic", "force_deadband", "force_saturation",
)  # fmt: skip
"""All that comes near dry friction."""


def make_motion(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity, acceleration: a sum of sines up to 6 Hz."""
    random, t = np.random.default_rng(seed), np.arange(COUNT) / RATE_HZ
    found = np.zeros((3, COUNT))
    for f in np.arange(0.25, 6.0, 0.25):
        turn, phase, size = 2 * np.pi * f, random.uniform(0, 2 * np.pi), 0.02 / (1 + f**2)
        found[0] += size * np.sin(turn * t + phase)
        found[1] += size * turn * np.cos(turn * t + phase)
        found[2] -= size * turn**2 * np.sin(turn * t + phase)
    return found[0], found[1], found[2]


@cache
def record_rig(seed: int, change: str = "", level: float = 0.0) -> Recording:
    """Friction that is stronger at rest and on one side, a bent spring, model error that changes slowly."""
    q, v, a = make_motion(seed)
    random = np.random.default_rng(seed + 100)
    own = 1.2 * a + 3.0 * v + 80.0 * q + 9000.0 * q**3 + (1.0 + 0.6 * np.exp(-((v / 0.02) ** 2))) * np.tanh(v / 0.004)
    slow = np.convolve(random.normal(size=COUNT + SLOW), np.hanning(SLOW), "same")[:COUNT]
    force = own + 0.03 * np.std(own) * slow / slow.std() + 0.005 * np.std(own) * random.normal(size=COUNT)
    position = q + 2e-6 * random.normal(size=COUNT)
    added = {"added_mass": a, "viscous_damping": v, "coulomb_friction": np.tanh(v / 0.004)}
    if change in added:
        force = force + level * added[change]
    if change == "force_gain":
        force = force / level
    if change == "sensor_gain":
        position = position * level
    if change == "mains_hum":
        position = position + level * np.sin(2 * np.pi * 50.02 * np.arange(COUNT) / RATE_HZ)
    return Recording(
        "rig",
        Signal(force[:, None], RATE_HZ, "force", "N", ("fx",)),
        Signal(position[:, None], RATE_HZ, "position", "m", ("x",)),
        meta={"imposed": ""},
    )


def time_left() -> bool:
    return True


@cache
def make_contrast(change: str = "", level: float = 0.0, without: tuple[str, ...] = (), seed: int = 2) -> Contrast:
    """Of a recording with this change, beside a clean one; made once for all tests that ask."""
    return find_contrast([record_rig(seed, change, level)], [record_rig(1)], frozenset(without), time_left)


def decide_fault(faulty: Recording) -> Decision:
    found = rank_faults([faulty], [record_rig(1)], frozenset(), time_left)
    assert found is not None
    return choose_fault(found, 1)


def change_reading(seed: int, made) -> Recording:
    """The device in order, its position read otherwise. made: of readings (n,)."""
    whole = record_rig(seed)
    return replace(whole, response=replace(whole.response, samples=made(whole.response.samples[:, 0])[:, None]))


def add_noise(rms: float, seed: int = 2) -> Recording:
    plain = record_rig(seed)
    more = rms * np.random.default_rng(9).normal(size=plain.response.samples.shape)
    return replace(plain, response=replace(plain.response, samples=plain.response.samples + more))
