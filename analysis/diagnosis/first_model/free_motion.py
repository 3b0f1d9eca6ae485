"""Convert recordings of a free motion, such as a decay, to recordings of the force per unit mass that it implies.

Without a driving force, m q'' + c q' + k q + h(q, q') = 0 determines each term up to a common factor. Per unit mass,
the force -q'' balances damping, spring and nonlinear laws h along the motion q. The result is a recording with an
imposed motion q and a measured force -q'', of a device without mass. A decay is divided into segments of equal
duration, each with its amplitude, so that fit and test both contain all levels.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.balance.band import compute_band_end_hz
from analysis.diagnosis.balance.motion import differentiate
from analysis.diagnosis.data.measured_motion import FREE_MOTION, fill_gaps, is_driven, is_quasi_static
from analysis.diagnosis.data.observed import find_moving_spans
from analysis.diagnosis.limits import DECAY_LEAST_CYCLES, DECAY_MOST_LEVELS
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording, Segment, find_parts
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.unit_system import LINEAR, ROTATIONAL, determine_unit_system


def is_undriven_motion(recordings: Sequence[Recording]) -> bool:
    """Whether no command ever changes, and positions or velocities, of one order and either linear or angular, were
    measured, in recordings none of which is quasi-static. recordings: at least one, alike in channels."""
    orders = {DERIVATIVE_OF_QUANTITY.get(quantity, 2) for quantity in recordings[0].response.quantities}
    rotational_flags = {unit.startswith("rad") for unit in recordings[0].response.units}
    is_uniform = len(orders) == 1 and len(rotational_flags) == 1
    # Order 2 is an acceleration, or a quantity that is no motion.
    return not is_driven(recordings) and is_uniform and max(orders) < 2 and not any(map(is_quasi_static, recordings))


def convert_free_motion(recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], str]:
    """Replace the command of recordings of a free motion by the force per unit mass -q'' (unit: `_choose_force_unit`),
    remove the excitation, and return a sentence about it. Recordings whose segments have neither roles nor several
    amplitudes are divided into levels. Unchanged, with an empty sentence, without recordings or where
    `is_undriven_motion` is False."""
    if not recordings or not is_undriven_motion(recordings):
        return tuple(recordings), ""
    response = recordings[0].response
    order, rate_hz = DERIVATIVE_OF_QUANTITY[response.quantities[0]], response.sample_rate_hz
    filled_samples = [fill_gaps(recording.response.samples) for recording in recordings]
    # The motion is discontinuous between two parts.
    parts_by_recording = [find_parts(recording) for recording in recordings]
    part_samples = [
        motion[start:stop]
        for motion, recording_parts in zip(filled_samples, parts_by_recording, strict=True)
        for start, stop in recording_parts
    ]
    band_hz = compute_band_end_hz(part_samples, rate_hz, order)
    quantity, unit = _choose_force_unit(response)
    converted_recordings = []
    for recording, motion, recording_parts in zip(recordings, filled_samples, parts_by_recording, strict=True):
        force = np.zeros_like(motion)
        for start, stop in recording_parts:
            force[start:stop] = -differentiate(motion[start:stop], rate_hz, band_hz, 2 - order)
        command = Signal(force, rate_hz, quantity, unit, response.channels)
        has_levels = (
            any(segment.role for segment in recording.segments)
            or len({recorded_segment.amplitude for recorded_segment in recording.segments}) > 1
        )
        segments = recording.segments if has_levels else _split_into_levels(recording, motion)
        meta = {**recording.meta, "imposed": FREE_MOTION}
        converted_recordings.append(replace(recording, command=command, excitation=None, segments=segments, meta=meta))
    unit_mass = {LINEAR.force: "mass (1 kg)", ROTATIONAL.force: "inertia (1 kg m^2)"}.get(unit, f"mass, in {unit}")
    return tuple(converted_recordings), (
        "No command changes: the motion is free and determines forces only relative to the mass. All forces are per "
        f"unit {unit_mass}."
    )


def _choose_force_unit(response: Signal) -> tuple[str, str]:
    """Choose quantity and unit of the force per unit mass: a force for 1 kg, or a torque for 1 kg m^2, or, where the
    position is neither in m nor in rad, an acceleration in its unit."""
    length = determine_unit_system((LINEAR.force,), response.units).length
    if length == ROTATIONAL.length:
        return "torque", ROTATIONAL.force
    return "force", LINEAR.force if length == LINEAR.length else f"{length}/s^2"


def _split_into_levels(recording: Recording, samples: FloatArray) -> tuple[Segment, ...]:
    """Split each moving part into segments of equal duration, with their amplitude on the channel of the largest range:
    at most `DECAY_MOST_LEVELS`, of `DECAY_LEAST_CYCLES` cycles or more on average; a shorter motion is one segment.
    samples: (n, p)."""
    segments = []
    for span in find_moving_spans(samples, find_parts(recording)):
        motion = samples[span.start : span.end_of_motion]
        widest_motion = motion[:, int(np.argmax(np.ptp(motion, axis=0)))]
        rest_value = float(np.median(samples[span.start : span.stop, int(np.argmax(np.ptp(motion, axis=0)))]))
        # A cycle crosses its rest value twice.
        cycle_count = np.count_nonzero(np.diff(np.signbit(widest_motion - rest_value))) / 2
        level_count = int(np.clip(cycle_count / DECAY_LEAST_CYCLES, 1, DECAY_MOST_LEVELS))
        edges = np.linspace(span.start, span.end_of_motion, level_count + 1).astype(int)
        for start, stop in pairwise(edges.tolist()):
            segments.append(
                Segment(
                    start,
                    stop,
                    "free",
                    float(np.abs(widest_motion[start - span.start : stop - span.start] - rest_value).max()),
                )
            )
    return tuple(segments)
