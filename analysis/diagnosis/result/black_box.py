"""A correction without physics, fitted beside the named effects: where it is better, something is still missing.

A polynomial of the re-tuned model's own signals is added to each channel of its prediction, term by term as each takes
most of what is left (orthogonal least squares; Chen, Billings and Luo 1989), as many terms per channel as the physics
has numbers.
"""

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import rms_over
from analysis.diagnosis.result.findings import BlackBox
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

SEEN = 20_000
"""Samples that terms are chosen by, evenly taken from those to fit; all that are fitted to weigh in the end."""
_SEEN_AT_ALL = 1e-6
"""Rms of a term on the samples to fit; over all samples it is about 1."""
_TINY = np.finfo(np.float64).tiny


def black_box(measure: ErrorMeasure, retuned: FittedCandidate, numbers: int, physics: float | None) -> BlackBox | None:
    """physics: the named effects' error on the test samples, as `document.Errors`. None where nothing is sealed."""
    if physics is None or not any(record.test.any() for record in measure.records):
        return None
    fitted = [record.fit for record in measure.records]
    courses = [
        # Where nothing was measured, nothing is fitted or tested either.
        _courses(record.command, np.nan_to_num(record.measured - left * measure.unit))
        for record, left in zip(measure.records, retuned.fitted.residuals, strict=True)
    ]
    terms = [_terms(course) for course in _within_what_was_fitted(courses, fitted)]
    rows = np.vstack([term[mask] for term, mask in zip(terms, fitted, strict=True)])
    left = np.vstack([residual[mask] for residual, mask in zip(retuned.fitted.residuals, fitted, strict=True)])
    scale = _scale(rows)
    weights = np.stack([_chosen(rows / scale, left[:, c], numbers) for c in range(left.shape[1])], axis=1)
    corrected = tuple(
        residual - each / scale @ weights for residual, each in zip(retuned.fitted.residuals, terms, strict=True)
    )
    error = _normalised(measure, corrected, [record.test for record in measure.records])
    return BlackBox("polynomial of the model's signals", numbers * left.shape[1], error, physics)


def _scale(rows: FloatArray) -> FloatArray:
    """(terms,): rms; infinite for terms that are next to nothing where they are fitted, such as products of commands
    that are never played together: elsewhere they would be anything."""
    rms = np.sqrt(np.mean(rows**2, axis=0))
    return np.where(rms > _SEEN_AT_ALL, rms, np.inf)


def _within_what_was_fitted(courses: list[FloatArray], fitted: list[Mask]) -> list[FloatArray]:
    """Held at the ends of the range that was fitted to: beyond it, powers would be anything, and easy to beat."""
    seen = np.vstack([course[mask] for course, mask in zip(courses, fitted, strict=True)])
    return [np.clip(course, seen.min(axis=0), seen.max(axis=0)) for course in courses]


def _courses(command: FloatArray, predicted: FloatArray) -> FloatArray:
    """(n, 2 signals): commands and predictions, and their changes."""
    signals = np.hstack([command, predicted])
    signals = signals / np.maximum(np.sqrt(np.mean(signals**2, axis=0)), _TINY)
    before = np.vstack([signals[:1], signals[:-1]])
    base = np.hstack([before, signals - before])
    return np.asarray(base / np.maximum(np.sqrt(np.mean(base**2, axis=0)), _TINY))


def _terms(base: FloatArray) -> FloatArray:
    """(n, terms): powers and products."""
    half = base.shape[1] // 2
    products = [base[:, i] * base[:, j] for i in range(half) for j in range(i + 1, half)]
    return np.hstack([base, base**2, base * np.abs(base), base**3, np.stack(products, axis=1)])


def _chosen(rows: FloatArray, left: FloatArray, count: int) -> FloatArray:
    """(terms,): weights, all but `count` of them zero."""
    every = max(len(rows) // SEEN, 1)
    seen, wanted = rows[::every], left[::every]
    picked: list[int] = []
    rest = wanted
    power = np.sum(seen**2, axis=0)
    for _ in range(count):
        gain = (seen.T @ rest) ** 2 / np.maximum(power, _TINY)
        gain[picked] = -1.0
        picked.append(int(np.argmax(gain)))
        rest = wanted - seen[:, picked] @ np.linalg.lstsq(seen[:, picked], wanted, rcond=None)[0]
    weights = np.zeros(rows.shape[1])
    weights[picked] = np.linalg.lstsq(rows[:, picked], left, rcond=None)[0]
    return weights


def _normalised(measure: ErrorMeasure, residuals: tuple[FloatArray, ...], masks: list[Mask]) -> float:
    signals = tuple(record.measured - np.nanmean(record.measured, axis=0) for record in measure.records)
    size = np.maximum(rms_over(measure.records, signals, masks), _TINY)
    rms = rms_over(measure.records, residuals, masks) * measure.unit / size
    return float(np.sqrt(np.mean(rms**2)))
