"""Faults of sensor, clock and line, put into a recording of a real device: real noise, known truth. Those of mechanism
and actuator are in `force_injections`.

Written for the challenge alone: nothing of it is shared with the effects that a diagnosis compares.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.drive_injections import ForceInjection
from study.evaluation.challenge.injection.force_injections import FORCE_INJECTIONS
from study.evaluation.challenge.injection.moved_axis import moved_axis
from study.evaluation.challenge.injection.spoiled_readings import (
    clip,
    cross,
    cubic,
    drift,
    hum,
    lag,
    late,
    lose,
    noise,
    offset,
    other_clock,
    play,
    scale,
    square,
    steps,
    turn,
)

MAINS_HZ = (50.0, 60.0)
FASTEST_PPM = 2e4
"""No clock is further off: so far are oscillators without a crystal."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What a fault is drawn for."""

    rate_hz: float
    rms: float
    """Of the largest channel,"""
    peak: float
    """and its largest magnitude."""
    middle_hz: float
    """Below which half of the response's power lies."""
    seconds: float


Draw = Callable[[Reading, float, np.random.Generator], dict[str, float]]
"""Numbers of a fault from its strength, 0 (weakest) to 1."""
Spoil = Callable[[FloatArray, float, Mapping[str, float], np.random.Generator], FloatArray]
"""Response (n, p), sample rate, numbers."""


@dataclass(frozen=True, slots=True)
class Injection:
    effect: str
    """As the vocabulary calls it."""
    draw: Draw
    spoil: Spoil
    axes: int = 1
    """Response channels that it needs."""


@dataclass(frozen=True, slots=True, eq=False)
class Injected:
    recording: Recording
    effect: str
    """Empty where nothing was injected."""
    values: dict[str, float]
    strength: float
    change: FloatArray
    """(p,): rms of what it changed, per response; per command where that was changed."""


def _between(low: float, high: float, strength: float) -> float:
    return float(low * (high / low) ** strength)


def _draw_turn(at: Reading, strength: float, random: np.random.Generator) -> dict[str, float]:
    x, y, z = (direction := random.normal(size=3)) / np.linalg.norm(direction)
    return {"degrees": _between(1.0, 20.0, strength), "about_x": float(x), "about_y": float(y), "about_z": float(z)}


def _either(random: np.random.Generator) -> float:
    return float(random.choice((-1.0, 1.0)))


INJECTIONS: tuple[Injection, ...] = (
    Injection("sensor_lag", lambda at, s, r: {"bandwidth": at.middle_hz * _between(20.0, 0.5, s)}, lag),
    Injection("sensor_clipping", lambda at, s, r: {"limit": at.peak * _between(0.95, 0.25, s)}, clip),
    Injection(
        "mains_hum",
        lambda at, s, r: {
            "amplitude": at.rms * _between(0.01, 1.0, s),
            "frequency": float(r.choice(MAINS_HZ)) + float(r.normal(0.0, 0.02)),
            "turn": float(r.random()),
        },
        hum,
    ),
    Injection("sensor_drift", lambda at, s, r: {"total": _either(r) * at.rms * _between(0.05, 3.0, s)}, drift),
    Injection("sensor_offset", lambda at, s, r: {"offset": _either(r) * at.rms * _between(0.02, 1.5, s)}, offset),
    Injection("quantization", lambda at, s, r: {"step": at.rms * _between(0.05, 1.5, s)}, steps),
    Injection("lost_samples", lambda at, s, r: {"fraction": _between(0.003, 0.3, s)}, lose),
    Injection(
        "clock_drift",
        lambda at, s, r: {
            "ppm": _either(r) * min(1e6 * _between(0.02, 1.0, s) / at.middle_hz / at.seconds, FASTEST_PPM)
        },
        other_clock,
    ),
    Injection(
        "sensor_gain", lambda at, s, r: {"gain": 1 + float(r.choice((-0.5, 1.0))) * _between(0.02, 0.8, s)}, scale
    ),
    Injection("logger_offset", lambda at, s, r: {"offset": _between(0.005, 0.1, s) / at.middle_hz}, late),
    Injection(
        "sensor_nonlinearity", lambda at, s, r: {"cubic": _either(r) * _between(0.02, 0.3, s) / at.peak**2}, cubic
    ),
    Injection("sensor_asymmetry", lambda at, s, r: {"square": _either(r) * _between(0.02, 0.4, s) / at.peak}, square),
    Injection("sensor_noise", lambda at, s, r: {"rms": at.rms * _between(0.003, 0.5, s)}, noise),
    Injection("sensor_play", lambda at, s, r: {"gap": at.rms * _between(0.01, 0.6, s)}, play),
    Injection("cross_axis_sensitivity", lambda at, s, r: {"from_next": _between(0.02, 0.8, s)}, cross, axes=2),
    Injection("sensor_misalignment", _draw_turn, turn, axes=3),
)


def inject(recording: Recording, effect: str, strength: float, random: np.random.Generator) -> Injected:
    """effect: of INJECTIONS; empty = nothing is injected. Raises ValueError for a name or a strength that is none, or
    a fault that needs more channels than there are."""
    if not effect:
        return Injected(recording, "", {}, 0.0, np.zeros(recording.response.samples.shape[1]))
    if not 0.0 <= strength <= 1.0:
        raise ValueError(f"strength is {strength}; it must lie between 0 and 1")
    forced = next((each for each in FORCE_INJECTIONS if each.effect == effect), None)
    if forced is not None:
        return _forced(recording, forced, strength, random)
    wanted = next((each for each in INJECTIONS if each.effect == effect), None)
    if wanted is None:
        known = ", ".join([*(each.effect for each in INJECTIONS), *(each.effect for each in FORCE_INJECTIONS)])
        raise ValueError(f"there is no way to inject '{effect}'; known are {known}")
    samples = recording.response.samples
    if samples.shape[1] < wanted.axes:
        raise ValueError(f"{effect} needs {wanted.axes} response channels, and there are {samples.shape[1]}")
    values = wanted.draw(reading_of(recording), strength, random)
    spoiled = np.asarray(wanted.spoil(samples, recording.sample_rate_hz, values, random))
    change = np.sqrt(np.nanmean((spoiled - samples) ** 2, axis=0))
    response = replace(recording.response, samples=spoiled)
    return Injected(replace(recording, response=response), effect, values, strength, np.asarray(change))


def _forced(recording: Recording, wanted: ForceInjection, strength: float, random: np.random.Generator) -> Injected:
    """At an axis by chance."""
    samples = recording.command.samples.copy()
    axis = int(random.integers(samples.shape[1]))
    moved = moved_axis(recording, axis)
    if moved is None:
        raise ValueError(f"{wanted.effect} needs a motion along command {axis + 1}")
    values = wanted.draw(moved, strength, random)
    samples[:, axis] = wanted.command(moved, values)
    change = np.sqrt(np.mean((samples - recording.command.samples) ** 2, axis=0))
    command = replace(recording.command, samples=samples)
    return Injected(replace(recording, command=command), wanted.effect, values, strength, np.asarray(change))


def fitting_injections(recording: Recording) -> tuple[str, ...]:
    """Names of the faults that the recording can carry: mains hum asks for a rate well above it, a tilt for one
    sensor's three directions, which are called so: three sensors at three places are not turned together; a force asks
    for a motion along each command, and an actuator for one that is not imposed."""
    rate_hz = recording.sample_rate_hz
    width = 3 if {name[-1:] for name in recording.response.channels} == {"x", "y", "z"} else 1
    hums = rate_hz > 4 * max(MAINS_HZ)
    several = len(recording.response.channels) > 1
    sensed = [
        each.effect
        for each in INJECTIONS
        if (each.axes in (1, width) or (each.axes == 2 and several)) and (hums or each.effect != "mains_hum")
    ]
    axes = range(recording.command.samples.shape[1])
    forced = [each for each in FORCE_INJECTIONS if not (each.actuator and "imposed" in recording.meta)]
    moves = all(moved_axis(recording, axis) is not None for axis in axes)
    return (*sensed, *(each.effect for each in forced if moves))


def place_of(effect: str) -> Place:
    forced = next((each for each in FORCE_INJECTIONS if each.effect == effect), None)
    return "sensor" if forced is None else "actuator" if forced.actuator else "mechanism"


def reading_of(recording: Recording) -> Reading:
    samples = recording.response.samples
    known = samples[np.isfinite(samples).all(axis=1)]
    moving = known - known.mean(axis=0)
    power = np.sum(np.abs(np.fft.rfft(moving, axis=0)) ** 2, axis=1)
    rate_hz = recording.sample_rate_hz
    middle = float(np.searchsorted(np.cumsum(power), power.sum() / 2)) * rate_hz / len(known)
    return Reading(
        rate_hz,
        float(np.sqrt(np.mean(moving**2, axis=0)).max()),
        float(np.abs(known).max()),
        max(middle, rate_hz / len(known)),
        len(samples) / rate_hz,
    )
