"""Stimulus of a trial from its level: a sinusoid of whole periods along one of the two directions of the task.

The commanded force (N), or the target acceleration (m/s²) where stimuli are equalized, is

    w(t) = A sin(2 pi f t) d,        d = (cos a, sin a) in the protocol's plane, a = symmetry + 45° or - 45°

A: amplitude, signed (its sign is the polarity); f: frequency (Hz); a: angle of the direction; "symmetry": angle of the
device's line of symmetry in the plane (degrees). The two directions are orthogonal and mirror images of each other in
that line, so that inertia and stiffness of the device are equal along both. The loop holds whole periods and is
repeated until the participant answers.
"""

import math
from dataclasses import replace

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.equalizer import Equalizer
from protocols.definition.apparatus import TestDirections
from protocols.definition.study_protocol import StimulusSettings
from study.session.stimulus.held_stimulus import HeldStimulus

MIN_SAMPLES_PER_PERIOD = 4
"""Smallest number of samples in a period of a stimulus, as in `protocols.definition.field_types`."""

PLANE_AXES = {"xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}
"""Indices (x: 0, y: 1, z: 2) of a plane's first and second axis; an angle counts from the first towards the second."""


def compute_direction_vector(directions: TestDirections, direction: int) -> FloatArray:
    """Compute the unit vector (3,) of direction 1 (+45° from the line of symmetry) or 2 (-45°). Raises ValueError for
    any other number."""
    if direction not in (1, 2):
        raise ValueError(f"there are directions 1 and 2, not {direction}")
    return compute_vector_at_angle(directions, compute_direction_angle_deg(directions, direction))


def compute_vector_at_angle(directions: TestDirections, angle_deg: float) -> FloatArray:
    """Compute the unit vector (3,) in the plane of the directions, at `angle_deg` from its first axis towards its
    second."""
    angle_rad = math.radians(angle_deg)
    first_axis, second_axis = PLANE_AXES[directions.plane]
    unit_vector = np.zeros(3)
    unit_vector[first_axis], unit_vector[second_axis] = math.cos(angle_rad), math.sin(angle_rad)
    return unit_vector


def compute_direction_angle_deg(directions: TestDirections, direction: int) -> float:
    """Compute the angle of direction 1 or 2 in the plane (degrees), from the plane's first axis towards its second. Any
    other number counts as 2."""
    return directions.symmetry_deg + (45.0 if direction == 1 else -45.0)


def count_loop_samples(frequency_hz: float, sample_rate_hz: float) -> int:
    """Count the samples of the shortest loop of whole periods: rate / gcd(rate, frequency), both rounded to multiples
    of 0.1 Hz. Exact only for such multiples: protocols accept no other frequencies, a device may have another rate."""
    sample_rate_decihertz, frequency_decihertz = round(sample_rate_hz * 10), round(frequency_hz * 10)
    return sample_rate_decihertz // math.gcd(sample_rate_decihertz, frequency_decihertz)


def compute_fade_in(settings: StimulusSettings, sample_rate_hz: float) -> FloatArray:
    """Compute the envelope (ticks,) of the fade-in, from 0 towards 1 (linear or raised cosine), as the safety layer
    applies it to a stimulus without `onset`."""
    tick_count = round(settings.fade_in_s * sample_rate_hz)
    elapsed_fraction: FloatArray = np.arange(tick_count) / max(tick_count, 1)
    return elapsed_fraction if settings.fade_shape == "linear" else 0.5 - 0.5 * np.cos(np.pi * elapsed_fraction)


def make_held_stimulus(
    settings: StimulusSettings,
    unit_vector: FloatArray,
    frequency_hz: float,
    amplitude: float,
    equalizer: Equalizer,
    sample_rate_hz: float,
) -> HeldStimulus:
    """Compute the loop of one trial, and its onset where the equalizer computes one. amplitude: peak, in N where the
    equalizer takes a force, in m/s² where it takes an acceleration; its sign is the polarity. unit_vector: (3,),
    the direction."""
    loop_sample_count = count_loop_samples(frequency_hz, sample_rate_hz)
    # The frequency of whole periods in the loop: the force must not jump where the loop begins again.
    played_hz = round(loop_sample_count * frequency_hz / sample_rate_hz) * sample_rate_hz / loop_sample_count
    phase_rad = 2 * math.pi * played_hz / sample_rate_hz * np.arange(loop_sample_count)
    is_force = equalizer.reference_quantity == "force"
    target_signal = Signal(
        samples=amplitude * np.sin(phase_rad)[:, None] * unit_vector,
        sample_rate_hz=sample_rate_hz,
        quantity=equalizer.reference_quantity,
        unit="N" if is_force else "m/s^2",
        channels=("fx", "fy", "fz") if is_force else ("ax", "ay", "az"),
    )
    envelope = compute_fade_in(settings, sample_rate_hz)
    loop, onset = (
        equalizer.compute_loop_commands(target_signal),
        equalizer.compute_onset_commands(target_signal, envelope),
    )
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
