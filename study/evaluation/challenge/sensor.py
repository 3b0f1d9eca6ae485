"""Simulated sensors of the bench: accelerometer, position encoders, and the sampling clock and data line of both.

Order of the effects on the acceleration: low-pass, orientation, static law, gain and cubic term, saturation, play
hysteresis; offset, drift, mains hum; clock error and delay; noise; range; quantization; lost samples. The position has
clock error, noise, quantization and the same lost samples.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.sensor_kernel import apply_play_hysteresis, filter_first_order

BANDWIDTH_HZ, RANGE_MPS2 = 500.0, 29.43
"""Cut-off frequency (Hz) and range (m/s^2, 3 g) of the accelerometer ADXL335 with a 500 Hz output filter."""
NOISE_MPS2 = (0.042, 0.042, 0.083)
"""Standard deviation of the noise of x, y, z (m/s^2): 150 (x, y) and 300 (z) ug per root Hz over the noise bandwidth of
the filter, 1.6 x 500 Hz (data sheet of the ADXL335)."""
POSITION_NOISE_M, POSITION_STEP_M = 4e-6, 1e-5
"""Standard deviation of the noise, and resolution, of the position at the handle (m). Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """Parameters of the sensors and of their faults; by default there are noise and a limited band and range, but no
    fault. Arrays (3,) have a value per channel of the accelerometer."""

    bandwidth_hz: float = BANDWIDTH_HZ
    """Cut-off frequency (-3 dB) of the first-order low-pass (Hz)."""
    orientation: FloatArray = field(default_factory=lambda: np.eye(3))
    """(channels, axes): rotation and cross-axis sensitivity."""
    gain: FloatArray = field(default_factory=lambda: np.ones(3))
    """Ratio of reading to acceleration."""
    cubic_gain: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Coefficient of the third power of the acceleration, 1/(m/s^2)^2."""
    drift_mps2: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Drift (m/s^2) at the end of the recording; it grows linearly from 0."""
    offset_mps2: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Constant error of the acceleration (m/s^2)."""
    delay_s: float = 0.0
    """Delay of the recorded acceleration relative to the commands; negative: it is early."""
    hum_mps2: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    """Amplitudes of the mains hum (m/s^2), (sine and cosine, channels)."""
    hum_hz: float = 50.0
    """Frequency of the hum (Hz)."""
    range_mps2: FloatArray = field(default_factory=lambda: np.full(3, RANGE_MPS2))
    """Magnitude at which the acceleration is clipped (m/s^2)."""
    resolution_mps2: float = 0.0
    """Quantization step of the acceleration (m/s^2); 0: not quantized."""
    clock_error_ppm: float = 0.0
    """Relative error e of the sampling clock, in 1e-6: a sample with the time stamp t was taken at t (1 + 1e-6 e)."""
    lost_fraction: float = 0.0
    """Probability that a sample is lost; the last received sample is then repeated."""
    inverse_saturation: float = 0.0
    """s of the saturating characteristic tanh(s a) / s, 1/(m/s^2): inverse of its largest output; 0: none."""
    play_half_width_mps2: float = 0.0
    """Half of the width of the play hysteresis (m/s^2); 0: none."""
    static_law: Callable[[FloatArray], FloatArray] | None = None
    """Additional static characteristic: maps accelerations (samples, 3) to accelerations; None: the identity."""


def read_sensor(
    sensor: Sensor, acceleration: FloatArray, position: FloatArray, rate_hz: float, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Simulate the readings of acceleration (m/s^2) and position (m), (samples, 3) each, from the true values of the
    same shape and unit at `rate_hz`. random: of noise and lost samples."""
    low_passed = filter_first_order(acceleration, 1.0 - np.exp(-2 * np.pi * sensor.bandwidth_hz / rate_hz))
    reading = _apply_nonlinearity(sensor, low_passed @ sensor.orientation.T)
    elapsed_share = np.linspace(0.0, 1.0, len(reading))[:, None]
    hum_phase_rad = 2 * np.pi * sensor.hum_hz * np.arange(len(reading))[:, None] / rate_hz
    reading = (
        reading
        + sensor.offset_mps2
        + sensor.drift_mps2 * elapsed_share
        + sensor.hum_mps2[0] * np.sin(hum_phase_rad)
        + sensor.hum_mps2[1] * np.cos(hum_phase_rad)
    )
    reading = _resample(reading, sensor.clock_error_ppm, sensor.delay_s * rate_hz)
    position_reading = _resample(position, sensor.clock_error_ppm, 0.0)
    reading = np.clip(reading + random.normal(size=reading.shape) * NOISE_MPS2, -sensor.range_mps2, sensor.range_mps2)
    if sensor.resolution_mps2 > 0.0:
        reading = sensor.resolution_mps2 * np.round(reading / sensor.resolution_mps2)
    position_reading = position_reading + POSITION_NOISE_M * random.normal(size=position_reading.shape)
    position_reading = POSITION_STEP_M * np.round(position_reading / POSITION_STEP_M)
    sample_index = _find_last_received(len(reading), sensor.lost_fraction, random)
    return reading[sample_index], position_reading[sample_index]


def _apply_nonlinearity(sensor: Sensor, reading: FloatArray) -> FloatArray:
    """Apply static law, gain and cubic term, saturation and hysteresis, in this order. reading: (samples, 3)."""
    reading = reading if sensor.static_law is None else sensor.static_law(reading)
    reading = sensor.gain * reading + sensor.cubic_gain * reading**3
    if sensor.inverse_saturation > 0.0:
        reading = np.tanh(sensor.inverse_saturation * reading) / sensor.inverse_saturation
    return (
        reading if sensor.play_half_width_mps2 == 0.0 else apply_play_hysteresis(reading, sensor.play_half_width_mps2)
    )


def _resample(samples: FloatArray, clock_error_ppm: float, delay_samples: float) -> FloatArray:
    """Resample (samples, 3) by linear interpolation at the times of a faulty clock, with a delay in samples. Beyond the
    ends, the first or last sample is repeated."""
    if clock_error_ppm == 0.0 and delay_samples == 0.0:
        return samples
    sample_indices = np.arange(len(samples), dtype=np.float64)
    positions = sample_indices * (1.0 + 1e-6 * clock_error_ppm) - delay_samples
    return np.column_stack([np.interp(positions, sample_indices, column) for column in samples.T])


def _find_last_received(
    sample_count: int, lost_fraction: float, random: np.random.Generator
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Index of the last received sample at every sample, (sample_count,). The first sample is never lost."""
    is_received = random.random(sample_count) >= lost_fraction
    is_received[0] = True
    sample_index: np.ndarray[tuple[int], np.dtype[np.int64]] = np.maximum.accumulate(
        np.where(is_received, np.arange(sample_count), 0)
    )
    return sample_index
