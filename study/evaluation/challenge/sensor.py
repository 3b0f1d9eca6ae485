"""Sensors of the bench: accelerometer, position sensor, and the clock and line that carry both.

Order: accelerometer pole, orientation, gain, nonlinearity, drift, hum; clock; noise; range; quantization; lost samples.
Clock drift and lost samples affect acceleration and position alike.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.sensor_kernel import one_pole, play_hysteresis

BANDWIDTH_HZ, RANGE_MPS2 = 500.0, 29.43
"""ADXL335 behind its 500 Hz filter: range 3 g."""
NOISE_MPS2 = (0.042, 0.042, 0.083)
"""Standard deviation of x, y, z: 150 and 300 ug per root Hz over the filter's noise bandwidth of 1.6 x 500 Hz (data
sheet)."""
POSITION_NOISE_M, POSITION_STEP_M = 4e-6, 1e-5
"""Noise and resolution of the encoders at the handle."""


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """Parameters of a simulated accelerometer and its faults; by default it has no fault."""

    bandwidth_hz: float = BANDWIDTH_HZ
    """One pole."""
    orientation: FloatArray = field(default_factory=lambda: np.eye(3))
    """Rows are channels: rotation, and cross-axis sensitivity."""
    gain: FloatArray = field(default_factory=lambda: np.ones(3))
    cubic: FloatArray = field(default_factory=lambda: np.zeros(3))
    """1/(m/s^2)^2"""
    drift: FloatArray = field(default_factory=lambda: np.zeros(3))
    """m/s^2, reached at the end."""
    offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    """m/s^2"""
    late_s: float = 0.0
    """Delay of the acceleration's record behind the commands."""
    hum: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    """m/s^2 of sine and cosine."""
    hum_hz: float = 50.0
    limit: FloatArray = field(default_factory=lambda: np.full(3, RANGE_MPS2))
    """m/s^2, clipping per channel."""
    step: float = 0.0
    """m/s^2, quantization; 0 = none."""
    ppm: float = 0.0
    """Clock error; positive: the response is taken at t (1 + ppm 1e-6)."""
    lost: float = 0.0
    """Fraction of the samples that repeat the one before."""
    bend: float = 0.0
    """1/(m/s^2): curvature of a saturating characteristic."""
    play: float = 0.0
    """m/s^2, half the width of a hysteresis."""
    law: Callable[[FloatArray], FloatArray] | None = None
    """Maps the readings (samples, 3)."""


def read_sensor(
    sensor: Sensor, acceleration: FloatArray, position: FloatArray, rate_hz: float, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Measured acceleration and position, (samples, 3) each."""
    smoothed = one_pole(acceleration, 1.0 - np.exp(-2 * np.pi * sensor.bandwidth_hz / rate_hz))
    signal = _apply_nonlinearity(sensor, smoothed @ sensor.orientation.T)
    elapsed_share = np.linspace(0.0, 1.0, len(signal))[:, None]
    turns = 2 * np.pi * sensor.hum_hz * np.arange(len(signal))[:, None] / rate_hz
    signal = (
        signal
        + sensor.offset
        + sensor.drift * elapsed_share
        + sensor.hum[0] * np.sin(turns)
        + sensor.hum[1] * np.cos(turns)
    )
    signal = _resample(signal, sensor.ppm, sensor.late_s * rate_hz)
    position_reading = _resample(position, sensor.ppm, 0.0)
    signal = np.clip(signal + random.normal(size=signal.shape) * NOISE_MPS2, -sensor.limit, sensor.limit)
    if sensor.step > 0.0:
        signal = sensor.step * np.round(signal / sensor.step)
    position_reading = position_reading + POSITION_NOISE_M * random.normal(size=position_reading.shape)
    position_reading = POSITION_STEP_M * np.round(position_reading / POSITION_STEP_M)
    sample_index = _last_received(len(signal), sensor.lost, random)
    return signal[sample_index], position_reading[sample_index]


def _apply_nonlinearity(sensor: Sensor, signal: FloatArray) -> FloatArray:
    """Static law, gain, cubic term, soft saturation, then hysteresis."""
    signal = signal if sensor.law is None else sensor.law(signal)
    signal = sensor.gain * signal + sensor.cubic * signal**3
    if sensor.bend > 0.0:
        signal = np.tanh(sensor.bend * signal) / sensor.bend
    return signal if sensor.play == 0.0 else play_hysteresis(signal, sensor.play)


def _resample(samples: FloatArray, ppm: float, delay_samples: float) -> FloatArray:
    """Resample with linear interpolation for a clock error (ppm) and a delay. delay_samples: in samples."""
    if ppm == 0.0 and delay_samples == 0.0:
        return samples
    k = np.arange(len(samples), dtype=np.float64)
    times = k * (1.0 + 1e-6 * ppm) - delay_samples
    return np.column_stack([np.interp(times, k, column) for column in samples.T])


def _last_received(
    samples: int, lost: float, random: np.random.Generator
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Index of the last sample that was not lost, for every sample."""
    is_received = random.random(samples) >= lost
    is_received[0] = True
    sample_index: np.ndarray[tuple[int], np.dtype[np.int64]] = np.maximum.accumulate(
        np.where(is_received, np.arange(samples), 0)
    )
    return sample_index
