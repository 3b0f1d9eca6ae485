"""Converts a motion that is not driven, such as a decay, to a recording of the force per unit mass that it implies.

Without a force, m q'' + c q' + k q + h(q, q') = 0 determines each term up to a common factor. Per unit of mass, the
force -q'' balances damping, spring and laws along the motion q: like a recording with an imposed motion and a measured
force, without a mass.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.balance.band import compute_band_end_hz
from analysis.diagnosis.balance.motion import differentiate
from analysis.diagnosis.data.measured_motion import FREE_MOTION, fill_gaps, is_driven, is_quasi_static
from analysis.diagnosis.data.observed import find_moving_spans
from analysis.diagnosis.data.observed_parts import find_parts
from analysis.diagnosis.settings import DECAY_LEAST_CYCLES, DECAY_MOST_LEVELS
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal


def is_free_motion(recordings: Sequence[Recording]) -> bool:
    """Whether no command ever changes, and positions or velocities were measured over time."""
    orders = {DERIVATIVE_OF_QUANTITY.get(quantity, 2) for quantity in recordings[0].response.quantities}
    rotational = {unit.startswith("rad") for unit in recordings[0].response.units}
    is_uniform = len(orders) == 1 and len(rotational) == 1
    return not is_driven(recordings) and is_uniform and max(orders) < 2 and not any(map(is_quasi_static, recordings))


def read_free_motion(recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], str]:
    """The recordings with the force per unit mass as their command, and a sentence about it; unchanged, with an empty
    sentence, where a command drives the motion."""
    if not recordings or not is_free_motion(recordings):
        return tuple(recordings), ""
    response = recordings[0].response
    order, rate_hz = DERIVATIVE_OF_QUANTITY[response.quantities[0]], response.sample_rate_hz
    motions = [fill_gaps(recording.response.samples) for recording in recordings]
    # The motion is discontinuous between two parts.
    parts = [find_parts(recording) for recording in recordings]
    part_samples = [
        samples[start:stop]
        for samples, recording_parts in zip(motions, parts, strict=True)
        for start, stop in recording_parts
    ]
    band_hz = compute_band_end_hz(part_samples, rate_hz, order)
    is_rotational = response.units[0].startswith("rad")
    converted = []
    for recording, samples, recording_parts in zip(recordings, motions, parts, strict=True):
        force = np.zeros_like(samples)
        for start, stop in recording_parts:
            force[start:stop] = -differentiate(samples[start:stop], rate_hz, band_hz, 2 - order)
        quantity, unit = ("torque", "N m") if is_rotational else ("force", "N")
        command = Signal(force, rate_hz, quantity, unit, response.channels)
        has_levels = (
            any(segment.role for segment in recording.segments) or len({s.amplitude for s in recording.segments}) > 1
        )
        segments = recording.segments if has_levels else _levels(recording, samples)
        meta = {**recording.meta, "imposed": FREE_MOTION}
        converted.append(replace(recording, command=command, excitation=None, segments=segments, meta=meta))
    unit_mass = "inertia (1 kg m^2)" if is_rotational else "mass (1 kg)"
    return tuple(converted), (
        "No command changes: the motion is free and determines forces only relative to the mass. All forces are per "
        f"unit {unit_mass}."
    )


def _levels(recording: Recording, samples: FloatArray) -> tuple[Segment, ...]:
    """Segments of at least `DECAY_LEAST_CYCLES` cycles each, with their amplitude: a decaying motion passes through all
    levels, and every level should be among the samples to fit and to test by. samples: (n, p)."""
    segments = []
    for span in find_moving_spans(samples, find_parts(recording)):
        motion = samples[span.start : span.end_of_motion]
        displacement = motion[:, int(np.argmax(np.ptp(motion, axis=0)))]
        rest_position = float(np.median(samples[span.start : span.stop, int(np.argmax(np.ptp(motion, axis=0)))]))
        cycles = np.count_nonzero(np.diff(np.signbit(displacement - rest_position))) / 2
        count = int(np.clip(cycles / DECAY_LEAST_CYCLES, 1, DECAY_MOST_LEVELS))
        edges = np.linspace(span.start, span.end_of_motion, count + 1).astype(int)
        for start, stop in pairwise(edges.tolist()):
            segments.append(
                Segment(
                    start,
                    stop,
                    "free",
                    float(np.abs(displacement[start - span.start : stop - span.start] - rest_position).max()),
                )
            )
    return tuple(segments)
