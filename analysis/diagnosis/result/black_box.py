"""A correction without physics, fitted beside the named effects: where it is better, something is still missing.

A polynomial of the re-tuned model's own signals is added to each channel of its prediction, term by term as each takes
most of what is left (orthogonal least squares; Chen, Billings and Luo 1989), as many terms per channel as the physics
has numbers.
"""

from collections.abc import Sequence
from itertools import combinations

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
"""Rms of a term on the samples that terms are chosen by; over all samples it is about 1."""
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
    courses = _within_what_was_fitted(courses, fitted)
    rows = np.vstack([course[mask] for course, mask in zip(courses, fitted, strict=True)])
    left = np.vstack([residual[mask] for residual, mask in zip(retuned.fitted.residuals, fitted, strict=True)])
    every = max(len(rows) // SEEN, 1)
    seen = _terms(rows[::every], range(_count(rows)))
    scale = _scale(seen)
    chosen = [_chosen(seen / scale, wanted, numbers) for wanted in left[::every].T]
    picked = sorted({number for each in chosen for number in each})
    whole, weights = _terms(rows, picked) / scale[picked], np.zeros((len(picked), left.shape[1]))
    for channel, each in enumerate(chosen):
        its = [picked.index(number) for number in each]
        weights[its, channel] = np.linalg.lstsq(whole[:, its], left[:, channel], rcond=None)[0]
    corrected = [
        residual[record.test] - _terms(course[record.test], picked) / scale[picked] @ weights
        for record, residual, course in zip(measure.records, retuned.fitted.residuals, courses, strict=True)
    ]
    return BlackBox(
        "polynomial of the model's signals",
        numbers * left.shape[1],
        _normalised(measure, np.vstack(corrected)),
        physics,
    )


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


def _count(base: FloatArray) -> int:
    """Of the terms: powers, and products of two courses."""
    width: int = base.shape[1]
    return 4 * width + len(list(combinations(range(width // 2), 2)))


def _terms(base: FloatArray, numbers: Sequence[int]) -> FloatArray:
    """(n, numbers): some of the terms. base: (n, 2 signals)."""
    width = base.shape[1]
    products = list(combinations(range(width // 2), 2))
    found = np.empty((len(base), len(numbers)))
    for place, number in enumerate(numbers):
        power, at = divmod(number, width)
        if power < 4:
            course = base[:, at]
            found[:, place] = course * (1.0, course, np.abs(course), course**2)[power]
        else:
            first, other = products[number - 4 * width]
            found[:, place] = base[:, first] * base[:, other]
    return found


def _chosen(seen: FloatArray, wanted: FloatArray, count: int) -> list[int]:
    """Numbers of the terms that take most, one after the other."""
    picked: list[int] = []
    rest = wanted
    power = np.sum(seen**2, axis=0)
    for _ in range(count):
        gain = (seen.T @ rest) ** 2 / np.maximum(power, _TINY)
        gain[picked] = -1.0
        picked.append(int(np.argmax(gain)))
        rest = wanted - seen[:, picked] @ np.linalg.lstsq(seen[:, picked], wanted, rcond=None)[0]
    return picked


def _normalised(measure: ErrorMeasure, left: FloatArray) -> float:
    """left: (samples to test, c), in units of the measure."""
    signals = tuple(record.measured - np.nanmean(record.measured, axis=0) for record in measure.records)
    size = np.maximum(rms_over(measure.records, signals, [record.test for record in measure.records]), _TINY)
    rms = np.sqrt(np.mean(left**2, axis=0)) * measure.unit / size
    return float(np.sqrt(np.mean(rms**2)))
