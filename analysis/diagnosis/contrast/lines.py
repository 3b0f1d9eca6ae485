"""Hum: a line of the mains in a response that neither its clean recording nor the command has."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.contrast.taken import Taken
from equalizer.signals.signal import FloatArray

MAINS_HZ = (50.0, 60.0)
OFF_HZ = 0.5
"""That mains or a logger's clock may be off."""
STANDS_OUT = 30.0
"""Times the median power of its surroundings, as far as some hertz: noise does so in one of e^30 lines."""
NEW = 6.0
"""Times as far as on the clean recordings, and as in the command, that it must stand out."""


@dataclass(frozen=True, slots=True, eq=False)
class Hum:
    channels: tuple[int, ...]
    amplitude: float
    """Of the largest channel."""
    frequency_hz: float


def hum_of(faulty: Sequence[Taken], clean: Sequence[Taken]) -> Hum | None:
    found = [
        (*seen, channel)
        for channel in range(faulty[0].response.shape[1])
        if (seen := _line(faulty, clean, channel)) is not None
    ]
    if not found:
        return None
    amplitude, frequency_hz, _ = max(found)
    return Hum(tuple(channel for _, _, channel in found), amplitude, frequency_hz)


def _line(faulty: Sequence[Taken], clean: Sequence[Taken], channel: int) -> tuple[float, float] | None:
    """Amplitude and frequency."""
    longest = max(faulty, key=lambda part: len(part.response))
    best: tuple[float, float] | None = None
    for mains in MAINS_HZ:
        if longest.rate_hz < 2.5 * mains:
            continue
        ratio, amplitude, at = _standing_out(longest.response[:, channel], longest.rate_hz, mains)
        usual = [_standing_out(part.response[:, channel], part.rate_hz, mains)[0] for part in clean]
        driven = [_standing_out(column, longest.rate_hz, mains)[0] for column in longest.command.T]
        if ratio > STANDS_OUT and ratio > NEW * max([1.0, *usual, *driven]) and (best is None or amplitude > best[0]):
            best = amplitude, at
    return best


def _standing_out(samples: FloatArray, rate_hz: float, mains: float) -> tuple[float, float, float]:
    """Power over that of the surroundings, amplitude, frequency."""
    window = np.hanning(len(samples))
    moved = samples - np.linspace(samples[0], samples[-1], len(samples))
    power = np.abs(np.fft.rfft((moved - moved.mean()) * window)) ** 2
    frequency = np.fft.rfftfreq(len(samples), 1 / rate_hz)
    resolution = rate_hz / len(samples)
    near = np.abs(frequency - mains) <= max(OFF_HZ, 1.5 * resolution)
    around = (np.abs(frequency - mains) <= max(6.0, 24 * resolution)) & (
        np.abs(frequency - mains) > max(2 * OFF_HZ, 4 * resolution)
    )
    if not near.any() or not around.any():
        return 0.0, 0.0, mains
    top = int(np.flatnonzero(near)[np.argmax(power[near])])
    floor = max(float(np.median(power[around])), 1e-300)
    return float(power[top]) / floor, 2 * float(np.sqrt(power[top])) / float(window.sum()), float(frequency[top])
