"""A black-box correction as a reference for the named effects: where it predicts better, physics is still missing.

A polynomial of the re-tuned model's own signals is added to each channel of its prediction, term by term, each time the
one that explains most of the residual (orthogonal least squares; Chen, Billings and Luo 1989), as many terms per
channel as the physics has parameters.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import signal_rms
from analysis.diagnosis.result.findings import BlackBox
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

SELECTION_SAMPLES = 20_000
"""Most samples for the selection of terms, evenly spaced among the fit samples; the final fit uses all."""
_LEAST_RMS = 1e-6
"""Least rms of a term on the samples for the selection; over all samples it is about 1."""
_TINY = np.finfo(np.float64).tiny


def black_box(measure: ErrorMeasure, retuned: FittedCandidate, terms: int, physics: float | None) -> BlackBox | None:
    """The black box with that number of terms per channel and its error on the test samples. physics: the named
    effects' error there, as in `document.Errors`. None where nothing is held out."""
    if physics is None or not any(record.test.any() for record in measure.records):
        return None
    fitted = [record.fit for record in measure.records]
    signals = [
        # Missing samples are neither fitted nor tested, so their value does not matter.
        _signals_and_changes(record.command, np.nan_to_num(record.measured - residuals * measure.unit))
        for record, residuals in zip(measure.records, retuned.fitted.residuals, strict=True)
    ]
    signals = _clip_to_fitted_range(signals, fitted)
    rows = np.vstack([signal[mask] for signal, mask in zip(signals, fitted, strict=True)])
    residuals = np.vstack([residual[mask] for residual, mask in zip(retuned.fitted.residuals, fitted, strict=True)])
    stride = max(len(rows) // SELECTION_SAMPLES, 1)
    selection_terms = _terms(rows[::stride], range(_term_count(rows)))
    scale = _scale(selection_terms)
    selected = [_select_terms(selection_terms / scale, target, terms) for target in residuals[::stride].T]
    used_terms = sorted({number for numbers in selected for number in numbers})
    terms_matrix, weights = (
        _terms(rows, used_terms) / scale[used_terms],
        np.zeros((len(used_terms), residuals.shape[1])),
    )
    for channel, numbers in enumerate(selected):
        columns = [used_terms.index(number) for number in numbers]
        weights[columns, channel] = np.linalg.lstsq(terms_matrix[:, columns], residuals[:, channel], rcond=None)[0]
    corrected = [
        residual[record.test] - _terms(signal[record.test], used_terms) / scale[used_terms] @ weights
        for record, residual, signal in zip(measure.records, retuned.fitted.residuals, signals, strict=True)
    ]
    return BlackBox(
        "polynomial of the model's signals",
        terms * residuals.shape[1],
        _normalise_error(measure, np.vstack(corrected)),
        physics,
    )


def _scale(rows: FloatArray) -> FloatArray:
    """(terms,): rms; infinite for terms that vanish where they are fitted, such as products of commands that are never
    played together, so that they are not used elsewhere."""
    rms = np.sqrt(np.mean(rows**2, axis=0))
    return np.where(rms > _LEAST_RMS, rms, np.inf)


def _clip_to_fitted_range(signals: list[FloatArray], fitted: list[Mask]) -> list[FloatArray]:
    """The signals clipped to the range that was fitted to: beyond it, a polynomial extrapolates badly."""
    fitted_signals = np.vstack([signal[mask] for signal, mask in zip(signals, fitted, strict=True)])
    return [np.clip(signal, fitted_signals.min(axis=0), fitted_signals.max(axis=0)) for signal in signals]


def _signals_and_changes(command: FloatArray, predicted: FloatArray) -> FloatArray:
    """(n, 2 signals): commands and predictions, one sample before, and their changes; each with an rms of 1."""
    signals = np.hstack([command, predicted])
    signals = signals / np.maximum(np.sqrt(np.mean(signals**2, axis=0)), _TINY)
    previous = np.vstack([signals[:1], signals[:-1]])
    base = np.hstack([previous, signals - previous])
    return np.asarray(base / np.maximum(np.sqrt(np.mean(base**2, axis=0)), _TINY))


def _term_count(base: FloatArray) -> int:
    """Number of terms: powers, and products of two signals."""
    width: int = base.shape[1]
    return 4 * width + len(list(combinations(range(width // 2), 2)))


def _terms(base: FloatArray, numbers: Sequence[int]) -> FloatArray:
    """(n, terms): the terms of these numbers. base: (n, 2 signals). With s a signal, number = power (2 signals) +
    index: s, s², s |s| and s³ for powers 0 to 3; then the products of two signals."""
    width = base.shape[1]
    products = list(combinations(range(width // 2), 2))
    values = np.empty((len(base), len(numbers)))
    for column, number in enumerate(numbers):
        power, index = divmod(number, width)
        if power < 4:
            signal = base[:, index]
            values[:, column] = signal * (1.0, signal, np.abs(signal), signal**2)[power]
        else:
            first_signal, second_signal = products[number - 4 * width]
            values[:, column] = base[:, first_signal] * base[:, second_signal]
    return values


def _select_terms(candidate_terms: FloatArray, target: FloatArray, count: int) -> list[int]:
    """Indices of the terms selected by orthogonal least squares, one after the other."""
    selected: list[int] = []
    residual = target
    power = np.sum(candidate_terms**2, axis=0)
    for _ in range(count):
        gain = (candidate_terms.T @ residual) ** 2 / np.maximum(power, _TINY)
        gain[selected] = -1.0
        selected.append(int(np.argmax(gain)))
        residual = (
            target - candidate_terms[:, selected] @ np.linalg.lstsq(candidate_terms[:, selected], target, rcond=None)[0]
        )
    return selected


def _normalise_error(measure: ErrorMeasure, errors: FloatArray) -> float:
    """Rms error over the rms signal, root mean square over channels. errors: (test samples, c), in units of the
    measure."""
    size = np.maximum(signal_rms(measure.records, [record.test for record in measure.records]), _TINY)
    rms = np.sqrt(np.mean(errors**2, axis=0)) * measure.unit / size
    return float(np.sqrt(np.mean(rms**2)))
