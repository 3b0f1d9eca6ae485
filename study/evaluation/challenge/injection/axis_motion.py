"""Motion along one axis of a recording: position, velocity and acceleration by differentiation of a measured signal.

Faults of mechanism and drive that are injected into real recordings are computed from it. Units are those of the
recorded signal: m or rad, in V where voltages were recorded, and their time derivatives.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

DERIVATIVE_ORDERS = {
    "position": 0, "displacement": 0, "angle": 0, "velocity": 1, "speed": 1, "acceleration": 2, "voltage": 0,
    "angular velocity": 1, "angular speed": 1, "angular acceleration": 2,
}  # fmt: skip
"""Order of the time derivative of position that a quantity is (0 = position); voltage counts as position."""
MAX_CUTOFF_SHARE, MIN_SIGNAL_TO_NOISE = 0.15, 30.0
"""Cutoff of the low pass in differentiation: at most this fraction of the sample rate, and the highest frequency with
this many times the noise power. Chosen by hand."""
MIN_CUTOFF_CYCLES, MIN_INTEGRATED_CYCLES = 20, 4
"""Least cutoff of the low pass, and lowest frequency that is integrated, in cycles per take: integration amplifies low
frequencies most. Chosen by hand."""
SPECTRUM_SAMPLES = 2048
"""Largest number of samples in a segment of the spectrum that determines the cutoff. Chosen by hand."""
UNRELATED_ORDER = 9
"""Stands for a quantity that is no derivative of position: above all orders."""
MIN_TAKE_SAMPLES = 16
"""Fewest samples of a take that is differentiated separately. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisMotion:
    """Position q, velocity v, acceleration a and command of one axis; all (n,)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray
    command: FloatArray
    rate_hz: float

    def select_samples(self, start: int, stop: int) -> "AxisMotion":
        """Motion from sample start to stop - 1."""
        q, v, a, command = (samples[start:stop] for samples in (self.q, self.v, self.a, self.command))
        return AxisMotion(q, v, a, command, self.rate_hz)

    @property
    def normalised_time(self) -> FloatArray:
        """(n,): time from 0 at the first sample to 1 at the last."""
        return np.linspace(0.0, 1.0, len(self.q))


def _find_bandwidth_hz(samples: FloatArray, rate_hz: float) -> float:
    """Find the highest frequency (Hz) at which the power density (Welch's method) exceeds `MIN_SIGNAL_TO_NOISE` times
    the noise floor, the median of the last quarter of the spectrum; at least `MIN_CUTOFF_CYCLES` per take, but at most
    `MAX_CUTOFF_SHARE` of the rate. samples: (n,), without missing samples."""
    frequency_hz, power = welch(samples, rate_hz, nperseg=min(len(samples), SPECTRUM_SAMPLES))
    above_noise = np.flatnonzero(power > MIN_SIGNAL_TO_NOISE * np.median(power[3 * len(power) // 4 :]))
    highest_hz = float(frequency_hz[above_noise[-1]]) if len(above_noise) else 0.0
    return float(np.clip(highest_hz, MIN_CUTOFF_CYCLES * rate_hz / len(samples), MAX_CUTOFF_SHARE * rate_hz))


def find_takes(recording: Recording) -> tuple[tuple[int, int], ...]:
    """Find the takes of a recording (stretches recorded without interruption), as (start, stop) in samples, in order. A
    boundary is where an entry of `meta["parts"]` begins or ends; ignored where a take would be shorter than
    `MIN_TAKE_SAMPLES`. The takes cover the recording."""
    parts = [part for part in recording.meta.get("parts", ()) if isinstance(part, dict)]
    boundaries = sorted(
        {int(part[bound_key]) for part in parts for bound_key in ("start", "stop") if bound_key in part}
    )
    starts = [0]
    for boundary in boundaries:
        if starts[-1] + MIN_TAKE_SAMPLES <= boundary <= len(recording) - MIN_TAKE_SAMPLES:
            starts.append(boundary)
    return tuple(zip(starts, [*starts[1:], len(recording)], strict=True))


def compute_axis_motion(recording: Recording, axis: int) -> AxisMotion | None:
    """Compute the motion of one axis, differentiated within each take; None where no signal of the recording measures
    it. Of position and response, the signal with the lowest order of derivative is used. axis: index of the command."""
    signals = [candidate for candidate in (recording.position, recording.response) if candidate is not None]
    axis_count = recording.command.samples.shape[1]
    signal_orders = [
        [DERIVATIVE_ORDERS.get(quantity, UNRELATED_ORDER) for quantity in signal.quantities] for signal in signals
    ]
    for signal, orders in sorted(zip(signals, signal_orders, strict=True), key=lambda entry: entry[1][0]):
        if (signal.samples.shape[1] == axis_count or axis_count == 1) and max(orders) < UNRELATED_ORDER:
            samples, derivative_order = signal.samples[:, axis], orders[axis]
            take_motions = [
                _differentiate(samples[start:stop], derivative_order, recording.sample_rate_hz)
                for start, stop in find_takes(recording)
            ]
            q, v, a = (np.concatenate(take_arrays) for take_arrays in zip(*take_motions, strict=True))
            return AxisMotion(q, v, a, recording.command.samples[:, axis], recording.sample_rate_hz)
    return None


def _differentiate(
    samples: FloatArray, derivative_order: int, rate_hz: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute position, velocity and acceleration in the frequency domain, from samples (n,) that are the derivative of
    position of this order. Missing samples are interpolated linearly; all are zero where none is known. The straight
    line through both ends is subtracted and the rest mirrored (odd), so that it is periodic. The low pass is the
    squared magnitude of a fourth-order Butterworth filter; integration removes frequencies below
    `MIN_INTEGRATED_CYCLES`."""
    sample_indices, is_finite = np.arange(len(samples)), np.isfinite(samples)
    interpolated = (
        np.interp(sample_indices, sample_indices[is_finite], samples[is_finite])
        if is_finite.any()
        else np.zeros(len(samples))
    )
    trend = np.interp(sample_indices, [0, len(interpolated) - 1], [interpolated[0], interpolated[-1]])
    mirrored = np.concatenate([interpolated - trend, -(interpolated - trend)[-2:0:-1]])
    frequency_hz = np.fft.rfftfreq(len(mirrored), 1 / rate_hz)
    spectrum = np.fft.rfft(mirrored)
    cutoff_hz = _find_bandwidth_hz(interpolated - trend, rate_hz)
    slope = (interpolated[-1] - interpolated[0]) / max(len(interpolated) - 1, 1) * rate_hz
    derivatives = []
    for target_order in range(3):
        differentiations = target_order - derivative_order
        j_omega = 2j * np.pi * np.maximum(frequency_hz, 1e-12)  # above 0: a negative power of it is finite
        gain = j_omega**differentiations / (1 + (frequency_hz / cutoff_hz) ** 8)
        if differentiations < 0:
            gain = np.where(frequency_hz < MIN_INTEGRATED_CYCLES * rate_hz / len(interpolated), 0.0, gain)
        derivative = np.fft.irfft(gain * spectrum, len(mirrored))[: len(interpolated)]
        derivatives.append(derivative + (trend if differentiations == 0 else slope if differentiations == 1 else 0.0))
    return derivatives[0], derivatives[1], derivatives[2]
