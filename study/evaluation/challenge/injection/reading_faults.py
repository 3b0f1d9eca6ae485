"""Faults of sensor, clock, mains and data link applied to readings of a real device.

Every function takes the readings (n, p), the sample rate (Hz), the parameters by name and a random generator, and
returns new readings (n, p), n >= 1. Amplitudes are in the unit of the readings. A missing reading (NaN) stays missing
where a fault changes each reading by itself. `apply_lag` makes all later readings of the channel NaN, too;
`rotate_readings` and `mix_channels` pass a NaN on to other channels, `shift_clock` and `delay_readings` to the readings
that are interpolated with it; `lose_samples` may repeat or replace it. Arguments that a fault does not need are
ignored.
"""

import numpy as np
from numpy.random import Generator
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.injection.drive_injections import Values, delay_samples


def apply_lag(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Apply a first-order low-pass with the corner frequency `bandwidth` (Hz), at rest at the first reading."""
    smoothing_factor = 1.0 - np.exp(-2 * np.pi * parameters["bandwidth"] / rate_hz)
    filtered, _ = lfilter(
        [smoothing_factor], [1.0, smoothing_factor - 1.0], readings, axis=0, zi=(1.0 - smoothing_factor) * readings[:1]
    )
    return np.asarray(filtered)


def add_hum(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Add mains hum, the same in all channels: `amplitude`, `frequency` (Hz), phase `turn` (turns)."""
    turns = parameters["frequency"] * np.arange(len(readings)) / rate_hz + parameters["turn"]
    return np.asarray(readings + parameters["amplitude"] * np.sin(2 * np.pi * turns)[:, None])


def lose_samples(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Lose each sample but the first with probability `fraction`: all channels repeat the last sample that was not
    lost."""
    is_lost = random.random(len(readings)) < parameters["fraction"]
    is_lost[0] = False
    source_indices = np.maximum.accumulate(np.where(is_lost, 0, np.arange(len(readings))))
    return np.asarray(readings[source_indices])


def shift_clock(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Apply a clock error of `ppm` (parts per million): reading k is taken at the time k (1 + 1e-6 ppm) / rate_hz, by
    linear interpolation; before the first reading and after the last, their values are repeated."""
    indices = np.arange(len(readings), dtype=np.float64)
    read_indices = indices * (1.0 + 1e-6 * parameters["ppm"])
    return np.column_stack([np.interp(read_indices, indices, channel) for channel in readings.T])


def rotate_readings(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Rotate exactly three channels, as a misaligned sensor, by `degrees` about the unit vector (about_x, about_y,
    about_z)."""
    unit_vector = np.array([parameters["about_x"], parameters["about_y"], parameters["about_z"]])
    return np.asarray(Rotation.from_rotvec(np.radians(parameters["degrees"]) * unit_vector).apply(np.array(readings)))


def delay_readings(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Delay the readings by `offset` (s; negative: advance), interpolated linearly; the end values are repeated."""
    return np.column_stack([delay_samples(channel, parameters["offset"] * rate_hz) for channel in readings.T])


def apply_play(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Apply a hysteresis (play operator) with the total width `gap`: the output follows the reading at a distance of at
    most half the gap, beginning at the first reading. A missing reading (NaN) stays missing."""
    output, previous, half_gap = np.empty_like(readings), readings[0], 0.5 * parameters["gap"]
    for index, reading in enumerate(readings):
        is_finite = np.isfinite(reading)
        previous = np.where(
            is_finite,
            np.where(np.isfinite(previous), np.clip(previous, reading - half_gap, reading + half_gap), reading),
            previous,
        )
        output[index] = np.where(is_finite, previous, np.nan)
    return output


def mix_channels(readings: FloatArray, rate_hz: float, parameters: Values, random: Generator) -> FloatArray:
    """Apply a cross-axis sensitivity: add to the first channel the second, scaled to the standard deviation of the
    first, times `from_next`. At least two channels; the second must vary."""
    output = readings.copy()
    output[:, 0] += parameters["from_next"] * readings[:, 1] * np.nanstd(readings[:, 0]) / np.nanstd(readings[:, 1])
    return np.asarray(output)
