"""Converts a motion that is not driven, such as a decay, to a recording of the force per unit mass that it implies.

Without a force, m q'' + c q' + k q + h(q, q') = 0 determines each term up to a common factor. Per unit of mass, the
force -q'' balances damping, spring and laws along the motion q: like a recording with an imposed motion and a measured
force, without a mass.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.balance.band import band_end_hz
from analysis.diagnosis.balance.motion import differentiate
from analysis.diagnosis.data.measured_motion import FREE, fill_gaps, is_driven, is_quasi_static
from analysis.diagnosis.data.observed import find_moving_spans
from analysis.diagnosis.data.observed_parts import parts_of
from analysis.diagnosis.settings import DECAY_LEAST_CYCLES, DECAY_MOST_LEVELS
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal


def is_free_motion(recordings: Sequence[Recording]) -> bool:
    """Whether no command ever changes, and positions or velocities were measured over time."""
    orders = {DERIVATIVE_OF_QUANTITY.get(quantity, 2) for quantity in recordings[0].response.quantities}
    turning = {unit.startswith("rad") for unit in recordings[0].response.units}
    alike = len(orders) == 1 and len(turning) == 1
    return not is_driven(recordings) and alike and max(orders) < 2 and not any(map(is_quasi_static, recordings))


def read_free_motion(recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], str]:
    """The recordings with the force per unit mass as their command, and a sentence about it; unchanged, with an empty
    sentence, where a command drives the motion."""
    if not recordings or not is_free_motion(recordings):
        return tuple(recordings), ""
    response = recordings[0].response
    order, rate_hz = DERIVATIVE_OF_QUANTITY[response.quantities[0]], response.sample_rate_hz
    moved = [fill_gaps(each.response.samples) for each in recordings]
    # The motion is discontinuous between two parts.
    parts = [parts_of(each) for each in recordings]
    cut = [samples[start:stop] for samples, those in zip(moved, parts, strict=True) for start, stop in those]
    band_hz = band_end_hz(cut, rate_hz, order)
    turning = response.units[0].startswith("rad")
    found = []
    for each, samples, those in zip(recordings, moved, parts, strict=True):
        force = np.zeros_like(samples)
        for start, stop in those:
            force[start:stop] = -differentiate(samples[start:stop], rate_hz, band_hz, 2 - order)
        quantity, unit = ("torque", "N m") if turning else ("force", "N")
        command = Signal(force, rate_hz, quantity, unit, response.channels)
        stated = any(segment.role for segment in each.segments) or len({s.amplitude for s in each.segments}) > 1
        segments = each.segments if stated else _levels(each, samples)
        meta = {**each.meta, "imposed": FREE}
        found.append(replace(each, command=command, excitation=None, segments=segments, meta=meta))
    what = "inertia (1 kg m^2)" if turning else "mass (1 kg)"
    return tuple(found), (
        "No command changes: the motion is free and determines forces only relative to the mass. All forces are per "
        f"unit {what}."
    )


def _levels(recording: Recording, samples: FloatArray) -> tuple[Segment, ...]:
    """Segments of at least `DECAY_LEAST_CYCLES` cycles each, with their amplitude: a decaying motion passes through all
    levels, and every level should be among the samples to fit and to test by. samples: (n, p)."""
    found = []
    for span in find_moving_spans(samples, parts_of(recording)):
        moving = samples[span.start : span.end_of_motion]
        away = moving[:, int(np.argmax(np.ptp(moving, axis=0)))]
        rest = float(np.median(samples[span.start : span.stop, int(np.argmax(np.ptp(moving, axis=0)))]))
        cycles = np.count_nonzero(np.diff(np.signbit(away - rest))) / 2
        count = int(np.clip(cycles / DECAY_LEAST_CYCLES, 1, DECAY_MOST_LEVELS))
        edges = np.linspace(span.start, span.end_of_motion, count + 1).astype(int)
        for start, stop in pairwise(edges.tolist()):
            found.append(
                Segment(start, stop, "free", float(np.abs(away[start - span.start : stop - span.start] - rest).max()))
            )
    return tuple(found)
