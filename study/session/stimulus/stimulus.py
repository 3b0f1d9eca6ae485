"""Stimulus of a trial from its level: one loop of whole periods along one of the two directions.

The force (N), or the wanted acceleration (m/s²) where stimuli are equalized, is

    w(t) = A sin(2 pi f t) d,        d = (cos a, sin a) in the protocol's plane, a = symmetry + 45° or - 45°

A: amplitude, signed (its sign is the polarity); f: frequency (Hz); "symmetry": angle of the device's line of symmetry
in the plane. The two directions are orthogonal and mirror images of each other in that line, so that the device itself
favours neither. The loop holds whole periods and is repeated until the participant answers.
"""

import math
from dataclasses import replace

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.equalizer import Equalizer
from protocols.definition.apparatus import TestDirections
from protocols.definition.study_protocol import StimulusSettings
from study.session.stimulus.held_stimulus import HeldStimulus

AXES = {"xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}
"""Indices of a plane's first and second axis; an angle counts from the first towards the second."""


def direction_vector(directions: TestDirections, direction: int) -> FloatArray:
    """Unit vector (3,) of direction 1 or 2: 45° to either side of the line of symmetry. Raises ValueError for any other
    number."""
    if direction not in (1, 2):
        raise ValueError(f"there are directions 1 and 2, not {direction}")
    return vector_at_angle(directions, direction_angle_deg(directions, direction))


def vector_at_angle(directions: TestDirections, angle_deg: float) -> FloatArray:
    """Unit vector (3,) at this angle (degrees) in the plane of the directions."""
    angle = math.radians(angle_deg)
    first, second = AXES[directions.plane]
    vector = np.zeros(3)
    vector[first], vector[second] = math.cos(angle), math.sin(angle)
    return vector


def direction_angle_deg(directions: TestDirections, direction: int) -> float:
    """Angle of direction 1 or 2 in the plane (degrees), from the plane's first axis towards its second."""
    return directions.symmetry_deg + (45.0 if direction == 1 else -45.0)


def loop_length(frequency_hz: float, sample_rate_hz: float) -> int:
    """Number of samples in the shortest loop of whole periods. Frequency and sample rate are rounded to multiples of
    0.1 Hz."""
    rate, frequency = round(sample_rate_hz * 10), round(frequency_hz * 10)
    return rate // math.gcd(rate, frequency)


def fade_in(settings: StimulusSettings, sample_rate_hz: float) -> FloatArray:
    """Envelope (ticks,) of the fade-in, from 0 towards 1, as the safety layer applies it to a stimulus without
    `onset`."""
    ticks = round(settings.fade_in_s * sample_rate_hz)
    share: FloatArray = np.arange(ticks) / max(ticks, 1)
    return share if settings.fade_shape == "linear" else 0.5 - 0.5 * np.cos(np.pi * share)


def make_held_stimulus(
    settings: StimulusSettings,
    unit_vector: FloatArray,
    frequency_hz: float,
    amplitude: float,
    equalizer: Equalizer,
    sample_rate_hz: float,
) -> HeldStimulus:
    """The stimulus of one trial. amplitude: peak, in N where the equalizer takes a force, in m/s^2 where it takes an
    acceleration; its sign is the polarity of the onset. unit_vector: (3,)."""
    n = loop_length(frequency_hz, sample_rate_hz)
    phase = 2 * math.pi * frequency_hz / sample_rate_hz * np.arange(n)
    force = equalizer.takes == "force"
    target = Signal(
        samples=amplitude * np.sin(phase)[:, None] * unit_vector,
        sample_rate_hz=sample_rate_hz,
        quantity=equalizer.takes,
        unit="N" if force else "m/s^2",
        channels=("fx", "fy", "fz") if force else ("ax", "ay", "az"),
    )
    envelope = fade_in(settings, sample_rate_hz)
    loop, onset = equalizer.periodic(target), equalizer.onset(target, envelope)
    if onset is not None:
        # The loop is rotated so that its first sample is the one that follows the last sample of the onset.
        loop = replace(loop, samples=np.roll(loop.samples, -len(envelope), axis=0))
    return HeldStimulus(
        loop=loop,
        onset=onset,
        fade_in_s=settings.fade_in_s,
        fade_out_s=settings.fade_out_s,
        fade_shape=settings.fade_shape,
    )
