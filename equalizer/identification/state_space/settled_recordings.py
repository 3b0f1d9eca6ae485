"""Recordings as if they had been made in the steady state: what slow poles still ring of a start is taken off.

A period that begins in another state than it ends in holds, beside the periodic answer, the free decay from the
difference: C A^t (I - A^N)^-1 (x_0 - x_N). A period that is shorter than some ten time constants is full of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.state_space.identify import Identified
from equalizer.identification.state_space.relaxed_poles import at_the_bound
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal


@dataclass(frozen=True, slots=True, eq=False)
class SlowPart:
    """The blocks of a model that ring longest."""

    A: FloatArray
    B: FloatArray
    C: FloatArray


def slow_part(identified: Identified, radius: float) -> SlowPart | None:
    """Of the relaxed poles beyond the radius; None where there are none. A pole at the limit of what the lines tell is
    left out, for its decay is not known."""
    fitted = identified.chosen.fitted
    sizes = np.abs(fitted.form.poles).reshape(2, -1).max(axis=0)
    beyond = (sizes > radius) & ~at_the_bound(fitted, identified.chosen.radius)
    states = np.flatnonzero(np.repeat(beyond, 2))
    if not len(states) or not identified.relaxed:
        return None
    return SlowPart(fitted.form.state_matrix[np.ix_(states, states)], fitted.B[states], fitted.form.C[:, states])


def settled(recordings: Sequence[Recording], slow: SlowPart) -> tuple[Recording, ...]:
    """Every period of every periodic segment without the free decay of the slow part. Segments with missing samples,
    and what comes after them, stay as they are."""
    return tuple(_settled(recording, slow) for recording in recordings)


def _settled(recording: Recording, slow: SlowPart) -> Recording:
    commands, samples = recording.command.samples, np.array(recording.response.samples)
    states: dict[int, FloatArray] = {}
    periods = [
        (start, start + segment.period)
        for segment in recording.segments
        if segment.period > 0
        for start in range(segment.start, segment.stop - segment.period + 1, segment.period)
    ]
    wanted = {edge for period in periods for edge in period}
    x = np.zeros(len(slow.A))
    for k in range(max(wanted, default=-1) + 1):
        if k in wanted:
            states[k] = x
        if k < len(commands):
            x = slow.A @ x + slow.B @ commands[k]
    for start, stop in periods:
        if np.isfinite(states[stop]).all():
            samples[start:stop] -= _free_decay(slow, states[start], states[stop], stop - start)
    response = recording.response
    return replace(
        recording,
        response=Signal(samples, response.sample_rate_hz, response.quantity, response.unit, response.channels),
    )


def _free_decay(slow: SlowPart, first: FloatArray, last: FloatArray, samples: int) -> FloatArray:
    """(samples, p)"""
    once = np.linalg.matrix_power(slow.A, samples)
    x = np.linalg.solve(np.eye(len(slow.A)) - once, first - last)
    rows = np.empty((samples, len(slow.C)))
    for k in range(samples):
        rows[k] = slow.C @ x
        x = slow.A @ x
    return rows
