"""What a signal shows by itself: a line of the mains (hum) or white noise in a response that neither its clean
recording nor the command has, and a command in steps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.contrast.taken import Taken
from analysis.diagnosis.settings import STEP_FACTOR
from equalizer.effects.starts.lattice import confirm_lattice_step, lattice_step
from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.signal import FloatArray

MAINS_HZ = (50.0, 60.0)
OFF_HZ = 0.5
"""That mains or a logger's clock may be off."""
STANDS_OUT = 30.0
"""Times the median power of its surroundings, as far as some hertz: noise does so in one of e^30 lines."""
NEW = 6.0
"""Times as far as on the clean recordings, and as in the command, that it must stand out."""


LOUDER = 4.0
"""Times the largest noise of any clean stretch that the smallest of the faulty ones must have: what changes with the
motion is no noise of a sensor."""
EVEN = 1.6
"""By which two bands of white noise may differ at most."""
STRETCHES = 6


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A fault, of responses or of commands."""

    effect: str
    place: Place
    channels: tuple[int, ...]
    values: dict[str, float]
    """Of the largest channel."""


def hum_of(faulty: Sequence[Taken], clean: Sequence[Taken]) -> Line | None:
    found = [
        (*seen, channel)
        for channel in range(faulty[0].response.shape[1])
        if (seen := _line(faulty, clean, channel)) is not None
    ]
    if not found:
        return None
    amplitude, frequency_hz, _ = max(found)
    channels = tuple(channel for _, _, channel in found)
    return Line("mains_hum", "sensor", channels, {"amplitude": amplitude, "frequency": frequency_hz})


def noise_of(faulty: Sequence[Taken], clean: Sequence[Taken]) -> Line | None:
    """White noise has the same power in the highest eighth of the spectrum as in the one above its middle."""
    found: list[tuple[float, int]] = []
    for channel in range(faulty[0].response.shape[1]):
        here, usual = (
            np.array([_floors(part.response[:, channel], stretch) for part in parts for stretch in _stretches(part)])
            for parts in (faulty, clean)
        )
        if not len(here) or not len(usual):
            continue
        new = np.median(here, axis=0) - np.median(usual, axis=0)
        louder = bool(np.all(here.min(axis=0) > LOUDER * usual.max(axis=0)))
        if louder and 1 / EVEN < new[0] / new[1] < EVEN:
            found.append((float(np.sqrt(new.mean())), channel))
    if not found:
        return None
    return Line("sensor_noise", "sensor", tuple(channel for _, channel in found), {"rms": max(found)[0]})


def steps_of(faulty: Sequence[Taken], clean: Sequence[Taken]) -> Line | None:
    """A command whose values lie on a lattice that is wider than a clean one's. Clean ones of few values, such as
    steps, say nothing."""
    for channel in range(faulty[0].command.shape[1]):
        here, usual = (np.concatenate([part.command[:, channel] for part in parts]) for parts in (faulty, clean))
        step = lattice_step(here)
        many = len(np.unique(usual)) > 2 * len(np.unique(here))
        if many and step is not None and step > STEP_FACTOR * confirm_lattice_step(usual, step):
            return Line("force_quantization", "actuator", (channel,), {"step": step})
    return None


def _stretches(part: Taken) -> list[slice]:
    count = max(len(part.response) // STRETCHES, 64)
    starts = range(0, len(part.response) - count + 1, count)
    return [slice(start, start + count) for start in starts if part.known[start : start + count].all()]


def _floors(samples: FloatArray, stretch: slice) -> tuple[float, float]:
    """Power that white noise would have in all, by either band."""
    own = samples[stretch]
    window = np.hanning(len(own))
    moved = own - np.linspace(own[0], own[-1], len(own))
    power = np.abs(np.fft.rfft(moved * window)) ** 2 / float(np.sum(window**2))
    eighth = len(power) // 8
    # The median of a power with two degrees of freedom lies at log 2 of its mean.
    last, middle = (float(np.median(power[-k * eighth : (1 - k) * eighth or None])) / np.log(2) for k in (1, 4))
    return last, middle


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
