"""Test whether a recording was made in closed loop: commands depend on the responses (controller, virtual spring).

Where the excitation was recorded, its difference from the command is the feedback. Otherwise the test is that of
Granger (Econometrica 37 (1969), 424): whether past responses improve the prediction of the command from its own past.
"""

import numpy as np

from analysis.diagnosis.limits import FED_BACK_SHARE, PREDICTED_SHARE
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import FloatArray

PAST_SAMPLES = 6
"""Number of past samples of each signal from which the command is predicted. Set by hand."""
LEAST_ROWS = 200
"""Least number of rows with all samples known; with fewer, the test is not made and the loop counts as open. Set by
hand."""


def is_in_closed_loop(recording: Recording) -> bool:
    """Whether the recording was made under feedback: by the difference of command and recorded excitation, else by
    whether the responses up to each sample help to predict the command that is written just after (Granger 1969).
    Without excitation, False for other holds than zero-order: a command may then depend on the sample after it. Missing
    samples are left out."""
    command = recording.command.samples
    if recording.excitation is not None:
        feedback = command - recording.excitation.samples
        is_complete = np.isfinite(feedback).all(axis=1)
        if not is_complete.any():
            return False
        return bool(_compute_rms(feedback[is_complete]) > FED_BACK_SHARE * _compute_rms(command[is_complete]))
    if recording.hold is not Hold.ZERO_ORDER:
        return False
    return any(_is_predicted_by_responses(command[:, axis], recording) for axis in range(command.shape[1]))


def _is_predicted_by_responses(command: FloatArray, recording: Recording) -> bool:
    """Test Granger causality by the ratio of the rms residuals of two autoregressions. command: (n,), of one axis."""
    signals = [recording.response.samples]
    if recording.position is not None:
        signals.append(recording.position.samples)
    measured = np.hstack(signals)
    is_complete = np.isfinite(measured).all(axis=1) & np.isfinite(command)
    rows = np.arange(PAST_SAMPLES, len(command))
    rows = rows[np.all([is_complete[rows - lag] for lag in range(PAST_SAMPLES + 1)], axis=0)]
    if len(rows) < LEAST_ROWS:
        return False
    command_past = np.column_stack([command[rows - lag] for lag in range(1, PAST_SAMPLES + 1)] + [np.ones(len(rows))])
    response_past = np.column_stack([measured[rows - lag] for lag in range(PAST_SAMPLES)])
    command_past_rms, full_rms = (
        _compute_residual_rms(command[rows], command_past),
        _compute_residual_rms(command[rows], np.hstack([command_past, response_past])),
    )
    # A smooth command is predicted by its own past to within rounding, so that the test has no power.
    return bool(
        command_past_rms > 1e-6 * _compute_rms(command[:, None]) and full_rms < PREDICTED_SHARE * command_past_rms
    )


def _compute_residual_rms(target: FloatArray, regressors: FloatArray) -> float:
    """Compute the rms residual of the least-squares fit of `target` (n,) by the columns of `regressors` (n, k)."""
    scale = np.linalg.norm(regressors, axis=0)
    columns = regressors / np.where(scale > 0, scale, 1.0)
    coefficients = np.linalg.lstsq(columns, target, rcond=1e-12)[0]
    return float(np.sqrt(np.mean((target - columns @ coefficients) ** 2)))


def _compute_rms(samples: FloatArray) -> float:
    """Compute the root mean square over all samples and channels."""
    return float(np.sqrt(np.mean(samples**2)))
