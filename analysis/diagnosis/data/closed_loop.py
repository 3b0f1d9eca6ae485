"""Tests whether a recording was made in closed loop: commands depend on the responses (controller, virtual spring).

Where the excitation was recorded, its difference from the command shows the feedback. Otherwise the test is that of
Granger (1969): whether past responses improve the prediction of the command from its own past.
"""

import numpy as np

from analysis.diagnosis.settings import FED_BACK_SHARE, PREDICTED_SHARE
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import FloatArray

PAST = 6
"""Number of past samples of each signal from which the command is predicted. By hand."""
_LEAST = 200
"""Fewest known samples for the test."""


def is_in_closed_loop(recording: Recording) -> bool:
    """Whether the recording was made under feedback: by the difference of command and recorded excitation, else by
    whether the responses up to each sample help to predict the command that is written just after (Granger 1969)."""
    command = recording.command.samples
    if recording.excitation is not None:
        by_feedback = command - recording.excitation.samples
        return bool(_rms(by_feedback) > FED_BACK_SHARE * _rms(command))
    if recording.hold is not Hold.ZERO_ORDER:
        # The command written just before a sample may already depend on the sample after it.
        return False
    return any(_is_predicted_by_responses(command[:, axis], recording) for axis in range(command.shape[1]))


def _is_predicted_by_responses(command: FloatArray, recording: Recording) -> bool:
    """Whether past responses improve the prediction of the command from its own past: Granger causality, by the ratio
    of the rms residuals of two autoregressions."""
    signals = [recording.response.samples]
    if recording.position is not None:
        signals.append(recording.position.samples)
    measured = np.hstack(signals)
    known = np.isfinite(measured).all(axis=1) & np.isfinite(command)
    rows = np.arange(PAST, len(command))
    rows = rows[np.all([known[rows - back] for back in range(PAST + 1)], axis=0)]
    if len(rows) < _LEAST:
        return False
    own = np.column_stack([command[rows - back] for back in range(1, PAST + 1)] + [np.ones(len(rows))])
    others = np.column_stack([measured[rows - back] for back in range(PAST)])
    alone, helped = _residual_rms(command[rows], own), _residual_rms(command[rows], np.hstack([own, others]))
    # A smooth command is predicted by its own past alone, so that the test has no power.
    return bool(alone > 1e-6 * _rms(command[:, None]) and helped < PREDICTED_SHARE * alone)


def _residual_rms(aim: FloatArray, by: FloatArray) -> float:
    """Rms residual of the least-squares fit of `aim` (n,) by the columns of `by` (n, k)."""
    scale = np.linalg.norm(by, axis=0)
    columns = by / np.where(scale > 0, scale, 1.0)
    found = np.linalg.lstsq(columns, aim, rcond=1e-12)[0]
    return float(np.sqrt(np.mean((aim - columns @ found) ** 2)))


def _rms(samples: FloatArray) -> float:
    return float(np.sqrt(np.mean(samples**2)))
