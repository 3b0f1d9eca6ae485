"""Standard errors of a fit that hold where residuals are neither white nor of the assumed variance.

Noise: sandwich estimate of Huber (1967) and White (1980), with scores summed over stretches longer than the residuals'
correlation time. Systematic errors: no law is exact, so that another level or axis would give other numbers; delete-one
jackknife over segments (Efron and Stein, Ann. Stat. 9:586, 1981), each estimate by one Gauss-Newton step,

    theta_g - theta = -(A - A_g)^-1 b_g,   A = sum of A_g + prior,   A_g = X_g X_g',   b_g = X_g r_g.
"""

from collections.abc import Iterator
from itertools import pairwise

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
    scores = _stretches(measure, known, own, errors)
    middle = scores @ scores.T
    t, across = len(fitted.deviations), known.on(own)
    information = np.block([[known.squares, across], [across.T, own @ own.T]])
    # The calibration is one more observation per parameter, with a standard deviation of one.
    information[:t, :t] += np.eye(t)
    middle[:t, :t] += np.eye(t)
    scale = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-12) / np.outer(scale, scale)
    return np.asarray(np.sqrt(np.maximum(np.diagonal(inverse @ middle @ inverse), 0.0)))


def segment_errors(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted, known: Sensitivity) -> FloatArray | None:
    """(t + numbers,): jackknife standard errors over segments; None where there is one segment."""
    errors = residuals_to_fit(measure, fitted.residuals)
    own = hypothesis_sensitivity(measure, tuning, fitted, errors) * ~_at_an_end(fitted.hypothesis)[:, None]
    products, scores = [], []
    for begin, end in _segments(measure):
        moves = np.vstack([known.over(begin, end), own[:, begin:end]])
        products.append(moves @ moves.T)
        scores.append(moves @ errors[begin:end])
    if len(products) < 2:
        return None
    whole, t = np.sum(products, axis=0), len(fitted.deviations)
    whole[:t, :t] += np.eye(t)
    scale = np.sqrt(np.maximum(np.diagonal(whole), np.finfo(float).tiny))
    left_out = []
    for part, rhs in zip(products, scores, strict=True):
        rest = (whole - part) / np.outer(scale, scale)
        left_out.append(np.linalg.pinv(rest, rcond=1e-12, hermitian=True) @ (rhs / scale) / scale)
    moved, count = np.array(left_out), len(left_out)
    return np.asarray(np.sqrt((count - 1) / count * np.sum((moved - moved.mean(axis=0)) ** 2, axis=0)))


def _segments(measure: ErrorMeasure) -> Iterator[tuple[int, int]]:
    """Ranges of the residuals to fit, one per segment with the rest after it, or per recording without segments."""
    first = 0
    for record in measure.records:
        width, samples = record.measured.shape[1], np.flatnonzero(record.fit)
        starts = np.sort([segment.start for segment in record.recording.segments[1:]])
        edges = [0, *np.searchsorted(samples, starts), len(samples)]
        yield from ((first + width * a, first + width * b) for a, b in pairwise(edges) if b > a)
        first += width * len(samples)


def _at_an_end(hypothesis: Hypothesis) -> Mask:
    ends = [number.bounds for number in hypothesis.numbers]
    held = [np.isclose(at, of, rtol=0.0, atol=AT_AN_END).any() for at, of in zip(hypothesis.point, ends, strict=True)]
    return np.array(held, dtype=np.bool_)


def _stretches(measure: ErrorMeasure, known: Sensitivity, own: FloatArray, errors: FloatArray) -> FloatArray:
    """(t + numbers, stretches): score of each number (column times residual), summed per stretch."""
    scores, first = [], 0
    for record in measure.records:
        width = record.measured.shape[1] * max(int(STRETCH_S * record.recording.sample_rate_hz), 1)
        last = first + int(record.fit.sum()) * record.measured.shape[1]
        for begin in range(first, last, width):
            end = min(begin + width, last)
            part = slice(begin, end)
            scores.append(np.concatenate([known.over(begin, end) @ errors[part], own[:, part] @ errors[part]]))
        first = last
    return np.array(scores).T.reshape(len(known.columns) + len(own), -1)
