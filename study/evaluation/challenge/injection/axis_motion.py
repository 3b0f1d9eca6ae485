"""Motion along one command of a recording: position, velocity and acceleration."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

DERIVATIVE = {
    "position": 0, "displacement": 0, "angle": 0, "velocity": 1, "speed": 1, "acceleration": 2, "voltage": 0,
    "angular velocity": 1, "angular speed": 1, "angular acceleration": 2,
}  # fmt: skip
"""Time derivative of the position that a quantity is; voltage counts as position."""
WIDEST, LOUD = 0.15, 30.0
"""Upper limit of differentiation: this fraction of the sample rate, or the last frequency with this many times the
noise power."""
SHORTEST_TAKE = 16
"""Fewest samples of a take that is differentiated by itself."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisMotion:
    """Generalised position, velocity, acceleration and command of one axis; all (n,)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray
    command: FloatArray
    rate_hz: float

    def part(self, start: int, stop: int) -> "AxisMotion":
        """Samples start to stop."""
        q, v, a, command = (each[start:stop] for each in (self.q, self.v, self.a, self.command))
        return AxisMotion(q, v, a, command, self.rate_hz)

    @property
    def seconds(self) -> float:
        """Duration: samples over rate (s)."""
        return len(self.q) / self.rate_hz

    @property
    def share_of_time(self) -> FloatArray:
        """Time from 0 to 1, (n,)."""
        return np.linspace(0.0, 1.0, len(self.q))


def _end_hz(samples: FloatArray, rate_hz: float) -> float:
    """Highest frequency at which the power exceeds the noise floor."""
    frequency, power = welch(samples, rate_hz, nperseg=min(len(samples), 2048))
    above_noise = np.flatnonzero(power > LOUD * np.median(power[3 * len(power) // 4 :]))
    last = float(frequency[above_noise[-1]]) if len(above_noise) else 0.0
    return float(np.clip(last, 20 * rate_hz / len(samples), WIDEST * rate_hz))


def takes_of(recording: Recording) -> tuple[tuple[int, int], ...]:
    """First sample and the one after the last of each stretch without a border of a part (`meta`) in it, in order;
    they cover the recording. One of under `SHORTEST_TAKE` samples is joined to the one before."""
    named = [each for each in recording.meta.get("parts", ()) if isinstance(each, dict)]
    edges = sorted({int(each[side]) for each in named for side in ("start", "stop") if side in each})
    kept = [0]
    for edge in edges:
        if kept[-1] + SHORTEST_TAKE <= edge <= len(recording) - SHORTEST_TAKE:
            kept.append(edge)
    return tuple(zip(kept, [*kept[1:], len(recording)], strict=True))


def axis_motion(recording: Recording, axis: int) -> AxisMotion | None:
    """Motion of one axis, differentiated within each take; None where no signal of the recording measures it."""
    signals = [each for each in (recording.position, recording.response) if each is not None]
    width = recording.command.samples.shape[1]
    for signal in sorted(signals, key=lambda each: DERIVATIVE.get(each.quantities[0], 9)):
        orders = {DERIVATIVE.get(quantity, 9) for quantity in signal.quantities}
        if (signal.samples.shape[1] == width or width == 1) and max(orders) < 9:
            samples, order = signal.samples[:, axis], DERIVATIVE[signal.quantities[axis]]
            takes = [
                _differentiate(samples[start:stop], order, recording.sample_rate_hz)
                for start, stop in takes_of(recording)
            ]
            q, v, a = (np.concatenate(each) for each in zip(*takes, strict=True))
            return AxisMotion(q, v, a, recording.command.samples[:, axis], recording.sample_rate_hz)
    return None


def _differentiate(samples: FloatArray, order: int, rate_hz: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity and acceleration: differentiate or integrate in the frequency domain after odd mirroring at
    both ends; missing samples are interpolated linearly, and zero where none is known. order: derivative that
    `samples` are."""
    places, known = np.arange(len(samples)), np.isfinite(samples)
    filled = np.interp(places, places[known], samples[known]) if known.any() else np.zeros(len(samples))
    line = np.interp(places, [0, len(filled) - 1], [filled[0], filled[-1]])
    whole = np.concatenate([filled - line, -(filled - line)[-2:0:-1]])
    frequency = np.fft.rfftfreq(len(whole), 1 / rate_hz)
    spectrum = np.fft.rfft(whole)
    cut = _end_hz(filled - line, rate_hz)
    slope = (filled[-1] - filled[0]) / max(len(filled) - 1, 1) * rate_hz
    found = []
    for wanted in range(3):
        times = wanted - order
        turn = 2j * np.pi * np.maximum(frequency, 1e-12)
        gain = turn**times / (1 + (frequency / cut) ** 8)
        if times < 0:
            gain = np.where(frequency < 4 * rate_hz / len(filled), 0.0, gain)
        motion = np.fft.irfft(gain * spectrum, len(whole))[: len(filled)]
        found.append(motion + (line if times == 0 else slope if times == 1 else 0.0))
    return found[0], found[1], found[2]
