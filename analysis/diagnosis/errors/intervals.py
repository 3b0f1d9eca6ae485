"""Standard errors of a fit that hold where residuals are neither white nor of the assumed variance.

Sandwich estimate of Huber (1967) and White (1980), with scores summed over stretches longer than the residuals'
correlation time.
"""

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, hypothesis_sensitivity, residuals_to_fit
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

STRETCH_S = 0.5
"""Length of the stretches over which residuals are summed: longer than their correlation time."""
AT_AN_END = 1e-6
"""Distance of a coordinate from its bound up to which it counts as at the bound."""


def standard_errors(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted, known: Sensitivity) -> FloatArray:
    """(t + numbers,): standard errors of the deviations and of the hypothesis's point; 0 for numbers at a bound."""
    errors = residuals_to_fit(measure, fitted.residuals)
    own = hypothesis_sensitivity(measure, tuning, fitted, errors) * ~_at_an_end(fitted.hypothesis)[:, None]
    pulls = _stretches(measure, known, own, errors)
    middle = pulls @ pulls.T
    t, across = len(fitted.deviations), known.on(own)
    information = np.block([[known.squares, across], [across.T, own @ own.T]])
    # The calibration is one more observation per parameter, with a standard deviation of one.
    information[:t, :t] += np.eye(t)
    middle[:t, :t] += np.eye(t)
    scale = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-12) / np.outer(scale, scale)
    return np.asarray(np.sqrt(np.maximum(np.diagonal(inverse @ middle @ inverse), 0.0)))


def _at_an_end(hypothesis: Hypothesis) -> Mask:
    ends = [number.bounds for number in hypothesis.numbers]
    held = [np.isclose(at, of, rtol=0.0, atol=AT_AN_END).any() for at, of in zip(hypothesis.point, ends, strict=True)]
    return np.array(held, dtype=np.bool_)


def _stretches(measure: ErrorMeasure, known: Sensitivity, own: FloatArray, errors: FloatArray) -> FloatArray:
    """(t + numbers, stretches): score of each number (column times residual), summed per stretch."""
    pulls, first = [], 0
    for record in measure.records:
        width = record.measured.shape[1] * max(int(STRETCH_S * record.recording.sample_rate_hz), 1)
        last = first + int(record.fit.sum()) * record.measured.shape[1]
        for begin in range(first, last, width):
            end = min(begin + width, last)
            part = slice(begin, end)
            pulls.append(np.concatenate([known.over(begin, end) @ errors[part], own[:, part] @ errors[part]]))
        first = last
    return np.array(pulls).T.reshape(len(known.columns) + len(own), -1)
