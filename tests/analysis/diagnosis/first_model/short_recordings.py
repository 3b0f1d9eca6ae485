"""Recordings of 100 Hz from given commands and responses."""

import numpy as np

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ = 100.0


def smooth_noise(count, seed, width=25):
    noise = np.random.default_rng(seed).standard_normal(count + width)
    course = np.convolve(noise, np.hanning(width), "same")[:count]
    return course / course.std()


def make_recording(command, response):
    """Each a list of (name, quantity, unit, samples)."""

    def signal(channels):
        names, quantities, units, samples = zip(*channels, strict=True)
        return Signal(np.column_stack(samples), RATE_HZ, quantities, units, names)

    return Recording("form", signal(command), signal(response))


def simulate_speed(push, mass=0.05, damping=0.3):
    """(n,): in fine steps."""
    speed, found = 0.0, []
    for force in push:
        found.append(speed)
        for _ in range(10):
            speed += (force - damping * speed) / mass / RATE_HZ / 10
    return np.array(found)
