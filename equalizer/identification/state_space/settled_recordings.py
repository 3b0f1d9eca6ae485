"""Subtraction of the free decay of slow poles from recordings, so that they are in the steady state.

A period of N samples that begins in the state x_0 and ends in x_N contains, in addition to the periodic response, the
free decay C A^t (I - A^N)^-1 (x_0 - x_N), t = 0 ... N - 1. In periods shorter than about ten time constants it does not
die out, and would bias the estimate of the frequency response. The states follow by simulation from rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.state_space.identify import Identified
from equalizer.identification.state_space.relaxed_poles import is_at_bound
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal


@dataclass(frozen=True, slots=True, eq=False)
class SlowPart:
    """The slowly decaying blocks of a model in modal form."""

    A: FloatArray
    """(n, n)"""
    B: FloatArray
    """(n, m)"""
    C: FloatArray
    """(p, n)"""


def slow_part(identified: Identified, radius: float) -> SlowPart | None:
    """The relaxed blocks with a pole of magnitude above `radius`; None where there are none. A pole at its own bound,
    the limit of the lines' resolution, is left out, because its decay is not known."""
    fitted = identified.chosen.fitted
    sizes = np.abs(fitted.form.poles).reshape(2, -1).max(axis=0)
    is_slow = (sizes > radius) & ~is_at_bound(fitted, identified.chosen.radius)
    states = np.flatnonzero(np.repeat(is_slow, 2))
    if not len(states) or not identified.relaxed:
        return None
    return SlowPart(fitted.form.state_matrix[np.ix_(states, states)], fitted.B[states], fitted.form.C[:, states])


def subtract_free_decay(recordings: Sequence[Recording], slow: SlowPart) -> tuple[Recording, ...]:
    """The recordings without the slow part's free decay in every period of their periodic segments. From the first
    missing command sample on, periods are not changed, because the state is unknown."""
    return tuple(_settle_recording(recording, slow) for recording in recordings)


def _settle_recording(recording: Recording, slow: SlowPart) -> Recording:
    commands, samples = recording.command.samples, np.array(recording.response.samples)
    states: dict[int, FloatArray] = {}
    periods = [
        (start, start + segment.period)
        for segment in recording.segments
        if segment.period > 0
        for start in range(segment.start, segment.stop - segment.period + 1, segment.period)
    ]
    edges = {edge for period in periods for edge in period}
    x = np.zeros(len(slow.A))
    for k in range(max(edges, default=-1) + 1):
        if k in edges:
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
    """Response (samples, p) of the free decay. first, last: (n,), states at the start and the end of the period."""
    one_period = np.linalg.matrix_power(slow.A, samples)
    x = np.linalg.solve(np.eye(len(slow.A)) - one_period, first - last)
    rows = np.empty((samples, len(slow.C)))
    for k in range(samples):
        rows[k] = slow.C @ x
        x = slow.A @ x
    return rows
