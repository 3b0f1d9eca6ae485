"""Faults of sensor, clock and mains injected into a recording of a real device, so that the fault is known. Faults of
mechanism and actuator are in `force_injections`.

The size of a fault is a ratio, an angle, or relative to the response (rms, peak, median frequency), because nothing
else is known of the device; a strength of 0 to 1 interpolates geometrically. No code is shared with the effects that a
diagnosis compares. Begin at `inject`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.axis_motion import compute_axis_motion, find_takes
from study.evaluation.challenge.injection.drive_injections import ForceInjection
from study.evaluation.challenge.injection.force_injections import FORCE_INJECTIONS
from study.evaluation.challenge.injection.reading_faults import (
    add_hum,
    apply_lag,
    apply_play,
    delay_readings,
    lose_samples,
    mix_channels,
    rotate_readings,
    shift_clock,
)

MAINS_HZ = (50.0, 60.0)
"""Nominal frequencies of the mains (Hz); injected hum has either, with equal probability and a normal deviation of 0.02
Hz."""
MAX_CLOCK_ERROR_PPM = 2e4
"""Largest drawn clock error (ppm): that of oscillators without a crystal."""


@dataclass(frozen=True, slots=True)
class ResponseStatistics:
    """Properties of the response by which the size of a fault is drawn; rms and peak in the unit of the response."""

    rate_hz: float
    """Sample rate (Hz)."""
    rms: float
    """Largest rms of a channel, without its mean."""
    peak: float
    """Largest magnitude in any channel."""
    median_hz: float
    """Median frequency of the response's power (Hz), at least the resolution of its spectrum."""
    seconds: float
    """Duration of the response (s)."""


Draw = Callable[[ResponseStatistics, float, np.random.Generator], dict[str, float]]
"""draw(statistics, strength, random): the parameters of a fault; strength 0 = weakest, 1 = strongest."""
ApplyFault = Callable[[FloatArray, float, Mapping[str, float], np.random.Generator], FloatArray]
"""apply(samples, rate_hz, values, random): the response (n, p) with the fault (`reading_faults`)."""


@dataclass(frozen=True, slots=True)
class Injection:
    """A fault of sensor, clock or mains that can be injected."""

    effect: str
    """Name in the vocabulary of effects, or a new name for a fault that is not in it, such as `sensor_play`."""
    draw: Draw
    apply: ApplyFault
    min_channels: int = 1
    """Least number of response channels."""
    memory: bool = False
    """Whether the fault depends on earlier readings, so that it is applied to each take separately."""


@dataclass(frozen=True, slots=True, eq=False)
class FaultyRecording:
    """A recording with its injected fault."""

    recording: Recording
    effect: str
    """Name of the fault; empty where nothing was injected."""
    values: dict[str, float]
    """Parameters of the fault, by name."""
    strength: float
    """Strength with which the fault was drawn, 0 to 1."""
    change: FloatArray
    """(p,): rms change per response channel; for a fault of mechanism or actuator, per command channel."""


def _interpolate_log(weakest: float, strongest: float, strength: float) -> float:
    """Interpolate geometrically between two values by the strength, 0 to 1."""
    return float(weakest * (strongest / weakest) ** strength)


def _draw_misalignment(
    statistics: ResponseStatistics, strength: float, random: np.random.Generator
) -> dict[str, float]:
    """Draw a misalignment: angle of 1 to 20 degrees about a random axis, a unit vector."""
    x, y, z = (direction := random.normal(size=3)) / np.linalg.norm(direction)
    return {
        "degrees": _interpolate_log(1.0, 20.0, strength),
        "about_x": float(x),
        "about_y": float(y),
        "about_z": float(z),
    }


def _draw_sign(random: np.random.Generator) -> float:
    """Draw +1 or -1 with equal probability."""
    return float(random.choice((-1.0, 1.0)))


INJECTIONS: tuple[Injection, ...] = (
    Injection(
        "sensor_lag",
        lambda statistics, s, r: {"bandwidth": statistics.median_hz * _interpolate_log(20.0, 0.5, s)},
        apply_lag,
        memory=True,
    ),
    Injection(
        "sensor_clipping",
        lambda statistics, s, r: {"limit": statistics.peak * _interpolate_log(0.95, 0.25, s)},
        lambda y, rate_hz, values, r: np.clip(y, -values["limit"], values["limit"]),
    ),
    Injection(
        "mains_hum",
        lambda statistics, s, r: {
            "amplitude": statistics.rms * _interpolate_log(0.01, 1.0, s),
            "frequency": float(r.choice(MAINS_HZ)) + float(r.normal(0.0, 0.02)),
            "turn": float(r.random()),
        },
        add_hum,
    ),
    Injection(
        "sensor_drift",
        lambda statistics, s, r: {"total": _draw_sign(r) * statistics.rms * _interpolate_log(0.05, 3.0, s)},
        lambda y, rate_hz, values, r: y + values["total"] * np.linspace(0.0, 1.0, len(y))[:, None],
    ),
    Injection(
        "sensor_offset",
        lambda statistics, s, r: {"offset": _draw_sign(r) * statistics.rms * _interpolate_log(0.02, 1.5, s)},
        lambda y, rate_hz, values, r: y + values["offset"],
    ),
    Injection(
        "quantization",
        lambda statistics, s, r: {"step": statistics.rms * _interpolate_log(0.05, 1.5, s)},
        lambda y, rate_hz, values, r: values["step"] * np.round(y / values["step"]),
    ),
    Injection("lost_samples", lambda statistics, s, r: {"fraction": _interpolate_log(0.003, 0.3, s)}, lose_samples),
    Injection(
        "clock_drift",
        lambda statistics, s, r: {
            "ppm": _draw_sign(r)
            * min(1e6 * _interpolate_log(0.02, 1.0, s) / statistics.median_hz / statistics.seconds, MAX_CLOCK_ERROR_PPM)
        },
        shift_clock,
    ),
    Injection(
        "sensor_gain",
        lambda statistics, s, r: {"gain": 1 + float(r.choice((-0.5, 1.0))) * _interpolate_log(0.02, 0.8, s)},
        lambda y, rate_hz, values, r: values["gain"] * y,
    ),
    Injection(
        "logger_offset",
        lambda statistics, s, r: {"offset": _interpolate_log(0.005, 0.1, s) / statistics.median_hz},
        delay_readings,
        memory=True,
    ),
    Injection(
        "sensor_nonlinearity",
        lambda statistics, s, r: {"cubic": _draw_sign(r) * _interpolate_log(0.02, 0.3, s) / statistics.peak**2},
        lambda y, rate_hz, values, r: y + values["cubic"] * y**3,
    ),
    Injection(
        "sensor_asymmetry",
        lambda statistics, s, r: {"square": _draw_sign(r) * _interpolate_log(0.02, 0.4, s) / statistics.peak},
        lambda y, rate_hz, values, r: y + values["square"] * y**2,
    ),
    Injection(
        "sensor_noise",
        lambda statistics, s, r: {"rms": statistics.rms * _interpolate_log(0.003, 0.5, s)},
        lambda y, rate_hz, values, r: y + values["rms"] * r.normal(size=y.shape),
    ),
    Injection(
        "sensor_play",
        lambda statistics, s, r: {"gap": statistics.rms * _interpolate_log(0.01, 0.6, s)},
        apply_play,
        memory=True,
    ),
    Injection(
        "cross_axis_sensitivity",
        lambda statistics, s, r: {"from_next": _interpolate_log(0.02, 0.8, s)},
        mix_channels,
        min_channels=2,
    ),
    Injection("sensor_misalignment", _draw_misalignment, rotate_readings, min_channels=3),
)
"""Faults of sensor, clock and mains: name, draw of the parameters, and change of the response. In the functions, s is
the strength, r the random generator and y the readings; the ranges were chosen by hand."""


def inject(recording: Recording, effect: str, strength: float, random: np.random.Generator) -> FaultyRecording:
    """Inject a fault of a strength from 0 to 1. effect: a name from INJECTIONS or FORCE_INJECTIONS; empty = none, with
    the strength ignored. Raises ValueError for an unknown name, a strength outside 0 to 1, or a fault for which the
    recording lacks channels or a motion."""
    if not effect:
        return FaultyRecording(recording, "", {}, 0.0, np.zeros(recording.response.samples.shape[1]))
    if not 0.0 <= strength <= 1.0:
        raise ValueError(f"strength is {strength}; it must lie between 0 and 1")
    force_injection = next((candidate for candidate in FORCE_INJECTIONS if candidate.effect == effect), None)
    if force_injection is not None:
        return _inject_force(recording, force_injection, strength, random)
    injection = next((candidate for candidate in INJECTIONS if candidate.effect == effect), None)
    if injection is None:
        known_names = ", ".join(
            [*(candidate.effect for candidate in INJECTIONS), *(candidate.effect for candidate in FORCE_INJECTIONS)]
        )
        raise ValueError(f"there is no way to inject '{effect}'; known are {known_names}")
    samples = recording.response.samples
    if samples.shape[1] < injection.min_channels:
        raise ValueError(f"{effect} needs {injection.min_channels} response channels, and there are {samples.shape[1]}")
    values = injection.draw(measure_response(recording), strength, random)
    takes = find_takes(recording) if injection.memory else ((0, len(recording)),)
    rate_hz = recording.sample_rate_hz
    faulty = np.vstack([injection.apply(samples[start:stop], rate_hz, values, random) for start, stop in takes])
    change = np.sqrt(np.nanmean((faulty - samples) ** 2, axis=0))
    response = replace(recording.response, samples=faulty)
    return FaultyRecording(replace(recording, response=response), effect, values, strength, np.asarray(change))


def _inject_force(
    recording: Recording, injection: ForceInjection, strength: float, random: np.random.Generator
) -> FaultyRecording:
    """Inject a fault of mechanism or actuator at a random axis: the recorded command is changed instead of the
    response. Raises ValueError where the recording has no motion along the command."""
    samples = recording.command.samples.copy()
    axis = int(random.integers(samples.shape[1]))
    motion = compute_axis_motion(recording, axis)
    if motion is None:
        raise ValueError(f"{injection.effect} needs a motion along command {axis + 1}")
    values = injection.draw(motion, strength, random)
    takes = find_takes(recording) if injection.memory else ((0, len(recording)),)
    samples[:, axis] = np.concatenate([injection.command(motion.select_samples(*bounds), values) for bounds in takes])
    change = np.sqrt(np.mean((samples - recording.command.samples) ** 2, axis=0))
    command = replace(recording.command, samples=samples)
    return FaultyRecording(replace(recording, command=command), injection.effect, values, strength, np.asarray(change))


def list_applicable_injections(recording: Recording) -> tuple[str, ...]:
    """List the faults that can be injected into this recording. A cross-axis sensitivity needs two response channels;
    mains hum a sample rate above 4 x 60 Hz; a misalignment channels whose names end in x, y and z, and no others; a
    fault of the mechanism a measured motion along each command; a fault of the actuator in addition a motion that is
    not imposed."""
    rate_hz = recording.sample_rate_hz
    sensor_axes = 3 if sorted(name[-1:] for name in recording.response.channels) == ["x", "y", "z"] else 1
    is_hum_resolved = rate_hz > 4 * max(MAINS_HZ)
    has_two_channels = len(recording.response.channels) > 1
    sensor_effects = [
        injection.effect
        for injection in INJECTIONS
        if (injection.min_channels in (1, sensor_axes) or (injection.min_channels == 2 and has_two_channels))
        and (is_hum_resolved or injection.effect != "mains_hum")
    ]
    axes = range(recording.command.samples.shape[1])
    force_injections = [
        injection for injection in FORCE_INJECTIONS if not (injection.actuator and "imposed" in recording.meta)
    ]
    is_motion_measured = all(compute_axis_motion(recording, axis) is not None for axis in axes)
    return (*sensor_effects, *(injection.effect for injection in force_injections if is_motion_measured))


def find_place(effect: str) -> Place:
    """Find the place where the fault acts: mechanism, actuator or sensor; sensor for an unknown name."""
    injection = next((candidate for candidate in FORCE_INJECTIONS if candidate.effect == effect), None)
    return "sensor" if injection is None else "actuator" if injection.actuator else "mechanism"


def measure_response(recording: Recording) -> ResponseStatistics:
    """Measure rate, rms, peak, median frequency and duration of the response; samples with NaN in any channel are left
    out (at least one must remain), except in the duration. Raises ValueError for a constant response."""
    finite_rows = recording.response.samples[np.isfinite(recording.response.samples).all(axis=1)]
    if not np.ptp(finite_rows, axis=0).any():
        raise ValueError("the response is constant, so that no fault can be scaled to it; record a moving device")
    centred = finite_rows - finite_rows.mean(axis=0)
    power = np.sum(np.abs(np.fft.rfft(centred, axis=0)) ** 2, axis=1)
    rate_hz = recording.sample_rate_hz
    median_hz = float(np.searchsorted(np.cumsum(power), power.sum() / 2)) * rate_hz / len(finite_rows)
    return ResponseStatistics(
        rate_hz,
        float(np.sqrt(np.mean(centred**2, axis=0)).max()),
        float(np.abs(finite_rows).max()),
        max(median_hz, rate_hz / len(finite_rows)),
        len(recording) / rate_hz,
    )
