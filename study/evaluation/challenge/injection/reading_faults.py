"""Faults of sensor, clock and line applied to readings of a real device.

Every function takes the readings (n, p), the sample rate (Hz), the parameters by name and a random generator, and
returns new readings (n, p). Amplitudes are in the unit of the readings. `injections` draws the parameters.
"""

from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from equalizer.signals.signal import FloatArray


def apply_lag(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """First-order low-pass with the corner frequency `bandwidth` (Hz), at rest at the first reading."""
    smoothing = 1.0 - np.exp(-2 * np.pi * values["bandwidth"] / rate_hz)
    filtered, _ = lfilter([smoothing], [1.0, smoothing - 1.0], samples, axis=0, zi=(1.0 - smoothing) * samples[:1])
    return np.asarray(filtered)


def clip_readings(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Clipping at +-limit."""
    return np.asarray(np.clip(samples, -values["limit"], values["limit"]))


def add_hum(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Mains hum, the same in all channels: `amplitude`, `frequency` (Hz), phase `turn` (turns)."""
    turns = values["frequency"] * np.arange(len(samples)) / rate_hz + values["turn"]
    return np.asarray(samples + values["amplitude"] * np.sin(2 * np.pi * turns)[:, None])


def add_drift(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Drift, the same in all channels: linear from 0 at the start to `total` at the end."""
    return samples + values["total"] * np.linspace(0.0, 1.0, len(samples))[:, None]


def add_offset(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Constant `offset`, the same in all channels."""
    return samples + values["offset"]


def quantize_readings(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Quantization to multiples of `step`."""
    return np.asarray(values["step"] * np.round(samples / values["step"]))


def lose_samples(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Each sample is lost with probability `fraction` and then repeats the previous sample."""
    is_lost = random.random(len(samples)) < values["fraction"]
    is_lost[0] = False
    source_index = np.maximum.accumulate(np.where(is_lost, 0, np.arange(len(samples))))
    return np.asarray(samples[source_index])


def shift_clock(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Clock error: readings taken at t (1 + ppm 1e-6), interpolated linearly."""
    index = np.arange(len(samples), dtype=np.float64)
    read_index = index * (1.0 + 1e-6 * values["ppm"])
    return np.column_stack([np.interp(read_index, index, channel) for channel in samples.T])


def rotate_readings(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Misalignment: rotation of the three channels by `degrees` about the unit vector (about_x, about_y, about_z)."""
    axis = np.array([values["about_x"], values["about_y"], values["about_z"]])
    return np.asarray(Rotation.from_rotvec(np.radians(values["degrees"]) * axis).apply(np.array(samples)))


def scale_readings(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Factor `gain` in all channels."""
    return values["gain"] * samples


def delay_readings(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Readings delayed by `offset` (s), interpolated linearly."""
    index = np.arange(len(samples), dtype=np.float64)
    return np.column_stack([np.interp(index - values["offset"] * rate_hz, index, channel) for channel in samples.T])


def add_cubic_term(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Cubic nonlinearity a + cubic a^3."""
    return np.asarray(samples + values["cubic"] * samples**3)


def add_square_term(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Quadratic nonlinearity a + square a^2."""
    return np.asarray(samples + values["square"] * samples**2)


def add_noise(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Added white normal noise with the given `rms`."""
    return np.asarray(samples + values["rms"] * random.normal(size=samples.shape))


def apply_play(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Hysteresis (play operator) with the total width `gap`. A missing reading (NaN) stays missing."""
    output, previous, half_gap = np.empty_like(samples), samples[0], 0.5 * values["gap"]
    for index, reading in enumerate(samples):
        is_finite = np.isfinite(reading)
        previous = np.where(
            is_finite,
            np.where(np.isfinite(previous), np.clip(previous, reading - half_gap, reading + half_gap), reading),
            previous,
        )
        output[index] = np.where(is_finite, previous, np.nan)
    return output


def mix_channels(
    samples: FloatArray, rate_hz: float, values: Mapping[str, float], random: np.random.Generator
) -> FloatArray:
    """Cross-axis sensitivity: the first channel also reads the second, scaled to the standard deviation of the first,
    times `from_next`."""
    output = samples.copy()
    output[:, 0] += values["from_next"] * samples[:, 1] * np.nanstd(samples[:, 0]) / np.nanstd(samples[:, 1])
    return np.asarray(output)
