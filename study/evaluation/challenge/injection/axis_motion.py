"""Motion along one command of a recording: position, velocity and acceleration, from which `injections` computes the
forces of injected faults."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

DERIVATIVE_ORDERS = {
    "position": 0, "displacement": 0, "angle": 0, "velocity": 1, "speed": 1, "acceleration": 2, "voltage": 0,
    "angular velocity": 1, "angular speed": 1, "angular acceleration": 2,
}  # fmt: skip
"""Time derivative of the position that a quantity is; voltage counts as position."""
MAX_CUTOFF_SHARE, MIN_SIGNAL_TO_NOISE = 0.15, 30.0
"""Cutoff of differentiation: at most this fraction of the sample rate, and the last frequency with this many times the
noise power. Chosen by hand."""
MIN_TAKE_SAMPLES = 16
"""Fewest samples of a take that is differentiated by itself."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisMotion:
    """Generalised position, velocity, acceleration and command of one axis; all (n,)."""

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
    def seconds(self) -> float:
        """Duration: samples over rate (s)."""
        return len(self.q) / self.rate_hz

    @property
    def share_of_time(self) -> FloatArray:
        """Time from 0 to 1, (n,)."""
        return np.linspace(0.0, 1.0, len(self.q))


def _find_bandwidth_hz(samples: FloatArray, rate_hz: float) -> float:
    """Highest frequency (Hz) at which the power exceeds the noise floor, the median of the last quarter of the
    spectrum; at least 20 lines, at most `MAX_CUTOFF_SHARE` of the rate."""
    frequency, power = welch(samples, rate_hz, nperseg=min(len(samples), 2048))
    above_noise = np.flatnonzero(power > MIN_SIGNAL_TO_NOISE * np.median(power[3 * len(power) // 4 :]))
    last_hz = float(frequency[above_noise[-1]]) if len(above_noise) else 0.0
    return float(np.clip(last_hz, 20 * rate_hz / len(samples), MAX_CUTOFF_SHARE * rate_hz))


def find_takes(recording: Recording) -> tuple[tuple[int, int], ...]:
    """Takes of a recording, (start, stop) in order: split where a part of its `meta` begins or ends. They cover the
    recording; a border within `MIN_TAKE_SAMPLES` of another or of the end is ignored."""
    parts = [part for part in recording.meta.get("parts", ()) if isinstance(part, dict)]
    edges = sorted({int(part[side]) for part in parts for side in ("start", "stop") if side in part})
    starts = [0]
    for edge in edges:
        if starts[-1] + MIN_TAKE_SAMPLES <= edge <= len(recording) - MIN_TAKE_SAMPLES:
            starts.append(edge)
    return tuple(zip(starts, [*starts[1:], len(recording)], strict=True))


def compute_axis_motion(recording: Recording, axis: int) -> AxisMotion | None:
    """Motion of one axis, differentiated within each take; None where no signal of the recording measures it."""
    signals = [candidate for candidate in (recording.position, recording.response) if candidate is not None]
    axis_count = recording.command.samples.shape[1]
    for signal in sorted(signals, key=lambda candidate: DERIVATIVE_ORDERS.get(candidate.quantities[0], 9)):
        orders = {DERIVATIVE_ORDERS.get(quantity, 9) for quantity in signal.quantities}
        if (signal.samples.shape[1] == axis_count or axis_count == 1) and max(orders) < 9:
            samples, order = signal.samples[:, axis], DERIVATIVE_ORDERS[signal.quantities[axis]]
            takes = [
                _differentiate(samples[start:stop], order, recording.sample_rate_hz)
                for start, stop in find_takes(recording)
            ]
            q, v, a = (np.concatenate(pieces) for pieces in zip(*takes, strict=True))
            return AxisMotion(q, v, a, recording.command.samples[:, axis], recording.sample_rate_hz)
    return None


def _differentiate(samples: FloatArray, order: int, rate_hz: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity and acceleration: differentiate or integrate in the frequency domain after odd mirroring at
    both ends; missing samples are interpolated linearly, and zero where none is known. order: derivative that
    `samples` are."""
    index, is_finite = np.arange(len(samples)), np.isfinite(samples)
    interpolated = np.interp(index, index[is_finite], samples[is_finite]) if is_finite.any() else np.zeros(len(samples))
    trend = np.interp(index, [0, len(interpolated) - 1], [interpolated[0], interpolated[-1]])
    mirrored = np.concatenate([interpolated - trend, -(interpolated - trend)[-2:0:-1]])
    frequency = np.fft.rfftfreq(len(mirrored), 1 / rate_hz)
    spectrum = np.fft.rfft(mirrored)
    cutoff_hz = _find_bandwidth_hz(interpolated - trend, rate_hz)
    slope = (interpolated[-1] - interpolated[0]) / max(len(interpolated) - 1, 1) * rate_hz
    derivatives = []
    for target_order in range(3):
        differentiations = target_order - order
        j_omega = 2j * np.pi * np.maximum(frequency, 1e-12)
        gain = j_omega**differentiations / (1 + (frequency / cutoff_hz) ** 8)
        if differentiations < 0:
            gain = np.where(frequency < 4 * rate_hz / len(interpolated), 0.0, gain)
        derivative = np.fft.irfft(gain * spectrum, len(mirrored))[: len(interpolated)]
        derivatives.append(derivative + (trend if differentiations == 0 else slope if differentiations == 1 else 0.0))
    return derivatives[0], derivatives[1], derivatives[2]
