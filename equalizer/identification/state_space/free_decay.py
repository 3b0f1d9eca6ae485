"""Subtraction of the free decay of slow poles from periodic recordings, which are then in the steady state.

A period of N samples that begins in the state x_0 and ends in x_N contains, in addition to the periodic response, the
free decay C A^t (I - A^N)^-1 (x_0 - x_N), t = 0 ... N - 1. Before about ten time constants have passed, it would bias
the estimate of the frequency response. The states are simulated from rest. Called by `identify_recordings`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.state_space.identify import IdentificationResult
from equalizer.identification.state_space.relaxed_poles import is_at_bound
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal


@dataclass(frozen=True, slots=True, eq=False)
class SlowModes:
    """State-space model of the slowly decaying modes alone, in modal form: x[k+1] = A x[k] + B u[k], y[k] = C x[k]."""

    A: FloatArray
    """(n, n)"""
    B: FloatArray
    """(n, m)"""
    C: FloatArray
    """(p, n)"""


def extract_slow_modes(identified: IdentificationResult, least_magnitude: float) -> SlowModes | None:
    """Extract the 2 x 2 blocks with a pole of magnitude above `least_magnitude`; None where there are none, or where no
    pole was relaxed (`relaxed_poles`). A block with a pole at its bound is left out, because its decay is not known."""
    fitted = identified.chosen.fitted
    pole_magnitudes = np.abs(fitted.form.poles).reshape(2, -1).max(axis=0)
    is_slow = (pole_magnitudes > least_magnitude) & ~is_at_bound(fitted, identified.chosen.radius)
    state_indices = np.flatnonzero(np.repeat(is_slow, 2))
    if not len(state_indices) or not identified.relaxed:
        return None
    return SlowModes(
        fitted.form.state_matrix[np.ix_(state_indices, state_indices)],
        fitted.B[state_indices],
        fitted.form.C[:, state_indices],
    )


def subtract_free_decay(recordings: Sequence[Recording], slow_modes: SlowModes) -> tuple[Recording, ...]:
    """Subtract the free decay of the slow modes from every period of the periodic segments. Periods that end after the
    first missing command sample of a recording are not changed, because the state is unknown."""
    return tuple(_subtract_from_periods(recording, slow_modes) for recording in recordings)


def _subtract_from_periods(recording: Recording, slow_modes: SlowModes) -> Recording:
    """Subtract the free decay from every period of a recording, as `subtract_free_decay` states."""
    command_samples, response_samples = recording.command.samples, np.array(recording.response.samples)
    states: dict[int, FloatArray] = {}
    periods = [
        (start, start + segment.period)
        for segment in recording.segments
        if segment.period > 0
        for start in range(segment.start, segment.stop - segment.period + 1, segment.period)
    ]
    period_edges = {edge for period in periods for edge in period}
    x = np.zeros(len(slow_modes.A))
    for k in range(max(period_edges, default=-1) + 1):
        if k in period_edges:
            states[k] = x
        if k < len(command_samples):
            x = slow_modes.A @ x + slow_modes.B @ command_samples[k]
    for start, stop in periods:
        if np.isfinite(states[stop]).all():
            response_samples[start:stop] -= _compute_free_decay(slow_modes, states[start], states[stop], stop - start)
    response = recording.response
    return replace(
        recording,
        response=Signal(response_samples, response.sample_rate_hz, response.quantity, response.unit, response.channels),
    )


def _compute_free_decay(
    slow_modes: SlowModes, start_state: FloatArray, end_state: FloatArray, sample_count: int
) -> FloatArray:
    """Compute the free decay (sample_count, p) within a period that starts and ends in the given states, (n,) each."""
    period_transition = np.linalg.matrix_power(slow_modes.A, sample_count)
    x = np.linalg.solve(np.eye(len(slow_modes.A)) - period_transition, start_state - end_state)
    decay = np.empty((sample_count, len(slow_modes.C)))
    for k in range(sample_count):
        decay[k] = slow_modes.C @ x
        x = slow_modes.A @ x
    return decay
