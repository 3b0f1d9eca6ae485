"""A black-box correction as a reference for the named effects: where it predicts better, an effect may be missing.

The residual of the re-tuned model is fitted by a polynomial of the commands and of the model's prediction, channel by
channel, with as many terms as the named effects have parameters, at least 1. Terms are selected by orthogonal matching
pursuit: the term with the largest projection of the residual, then a least-squares fit of all selected terms (Pati,
Rezaiifar and Krishnaprasad 1993; a variant of the orthogonal least squares of Chen, Billings and Luo 1989).
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import compute_signal_rms
from analysis.diagnosis.result.error_table import find_resting_channels
from analysis.diagnosis.result.findings import BlackBox
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

SELECTION_SAMPLES = 20_000
"""Least number of samples for the selection of terms, where there are as many; up to twice as many are used, evenly
spaced among the fit samples, to limit the computing time. The final fit uses all. Chosen by hand."""
_LEAST_RMS = 1e-6
"""Rms of a term on the samples for the selection (of a regressor over all samples: 1) up to which the term is not used.
Chosen by hand."""
_TINY = np.finfo(np.float64).tiny
"""Lower limit of a divisor, so that a signal of zeros gives zeros."""


def fit_black_box(
    measure: ErrorMeasure, retuned: FittedCandidate, term_count: int, physics_error: float | None
) -> BlackBox | None:
    """Fit the black box with `term_count` terms per channel to the fit samples, and compute its error on the test
    samples. physics_error: error of the model with the named effects on the test samples, relative to the signal
    (`document.Errors.after`). Returns None where it is None or no sample is held out."""
    if physics_error is None or not any(record.test.any() for record in measure.records):
        return None
    fit_masks = [record.fit for record in measure.records]
    regressors = [
        # Missing samples are neither fitted nor tested, so their value does not matter.
        _make_regressors(record.command, np.nan_to_num(record.measured - residuals * measure.unit))
        for record, residuals in zip(measure.records, retuned.fitted.residuals, strict=True)
    ]
    regressors = _clip_to_fitted_range(regressors, fit_masks)
    fit_regressors = np.vstack(
        [record_regressors[mask] for record_regressors, mask in zip(regressors, fit_masks, strict=True)]
    )
    residuals = np.vstack([residual[mask] for residual, mask in zip(retuned.fitted.residuals, fit_masks, strict=True)])
    stride = max(len(fit_regressors) // SELECTION_SAMPLES, 1)
    selection_terms = _compute_terms(fit_regressors[::stride], range(_count_terms(fit_regressors)))
    term_rms = _compute_term_rms(selection_terms)
    channel_terms = [_select_terms(selection_terms / term_rms, target, term_count) for target in residuals[::stride].T]
    used_terms = sorted({term_number for term_numbers in channel_terms for term_number in term_numbers})
    terms_matrix = _compute_terms(fit_regressors, used_terms) / term_rms[used_terms]
    weights = np.zeros((len(used_terms), residuals.shape[1]))
    for channel, term_numbers in enumerate(channel_terms):
        columns = [used_terms.index(term_number) for term_number in term_numbers]
        weights[columns, channel] = np.linalg.lstsq(terms_matrix[:, columns], residuals[:, channel], rcond=None)[0]
    test_errors = [
        residual[record.test]
        - _compute_terms(record_regressors[record.test], used_terms) / term_rms[used_terms] @ weights
        for record, residual, record_regressors in zip(
            measure.records, retuned.fitted.residuals, regressors, strict=True
        )
    ]
    return BlackBox(
        "polynomial of the model's signals",
        term_count * residuals.shape[1],
        _normalise_error(measure, np.vstack(test_errors)),
        physics_error,
    )


def _compute_term_rms(term_values: FloatArray) -> FloatArray:
    """Compute the rms of each term (terms,); infinite up to `_LEAST_RMS`, so that a term that vanishes on the fit
    samples, such as the product of two commands that are never played together, is 0 on all samples."""
    rms = np.sqrt(np.mean(term_values**2, axis=0))
    return np.where(rms > _LEAST_RMS, rms, np.inf)


def _clip_to_fitted_range(regressors: list[FloatArray], fit_masks: list[Mask]) -> list[FloatArray]:
    """Clip the regressors to their range on the fit samples, because a polynomial extrapolates badly."""
    fitted_regressors = np.vstack(
        [record_regressors[mask] for record_regressors, mask in zip(regressors, fit_masks, strict=True)]
    )
    return [
        np.clip(record_regressors, fitted_regressors.min(axis=0), fitted_regressors.max(axis=0))
        for record_regressors in regressors
    ]


def _make_regressors(command: FloatArray, predicted: FloatArray) -> FloatArray:
    """Make the regressors (n, 2 signals): commands and predictions at the previous sample, and their changes from it to
    the present one; each has an rms of 1, or is 0 throughout."""
    signals = np.hstack([command, predicted])
    signals = signals / np.maximum(np.sqrt(np.mean(signals**2, axis=0)), _TINY)
    previous_signals = np.vstack([signals[:1], signals[:-1]])
    regressors = np.hstack([previous_signals, signals - previous_signals])
    return np.asarray(regressors / np.maximum(np.sqrt(np.mean(regressors**2, axis=0)), _TINY))


def _count_terms(regressors: FloatArray) -> int:
    """Count the terms of `_compute_terms`: four functions of each regressor, and products of two signals."""
    regressor_count: int = regressors.shape[1]
    return 4 * regressor_count + len(list(combinations(range(regressor_count // 2), 2)))


def _compute_terms(regressors: FloatArray, term_numbers: Sequence[int]) -> FloatArray:
    """Compute the terms of these numbers, (n, terms). regressors: (n, 2 signals). Numbers count the regressors s, then
    s², then s |s|, then s³, and then the products of two different signals at the previous sample."""
    regressor_count = regressors.shape[1]
    products = list(combinations(range(regressor_count // 2), 2))
    term_values = np.empty((len(regressors), len(term_numbers)))
    for column, term_number in enumerate(term_numbers):
        form_index, regressor_index = divmod(term_number, regressor_count)
        if form_index < 4:
            signal = regressors[:, regressor_index]
            term_values[:, column] = signal * (1.0, signal, np.abs(signal), signal**2)[form_index]
        else:
            first_signal, second_signal = products[term_number - 4 * regressor_count]
            term_values[:, column] = regressors[:, first_signal] * regressors[:, second_signal]
    return term_values


def _select_terms(candidate_terms: FloatArray, target: FloatArray, term_count: int) -> list[int]:
    """Select terms by orthogonal matching pursuit: each time the one most correlated with the residual of the
    least-squares fit. candidate_terms: (n, terms); target: (n,). Returns indices in the order of selection."""
    selected_terms: list[int] = []
    residual = target
    term_power = np.sum(candidate_terms**2, axis=0)
    for _ in range(term_count):
        error_reduction = (candidate_terms.T @ residual) ** 2 / np.maximum(term_power, _TINY)
        error_reduction[selected_terms] = -1.0
        selected_terms.append(int(np.argmax(error_reduction)))
        residual = (
            target
            - candidate_terms[:, selected_terms]
            @ np.linalg.lstsq(candidate_terms[:, selected_terms], target, rcond=None)[0]
        )
    return selected_terms


def _normalise_error(measure: ErrorMeasure, errors: FloatArray) -> float:
    """Compute rms error over rms signal on the test samples, root mean square over the channels that move there, as in
    `error_table`. errors: (test samples, c), in units of `measure.unit`."""
    signal_rms = np.maximum(compute_signal_rms(measure.records, [record.test for record in measure.records]), _TINY)
    relative_rms = np.sqrt(np.mean(errors**2, axis=0)) * measure.unit / signal_rms
    is_resting = find_resting_channels(measure.records, measure.noise)
    return float(np.sqrt(np.mean(relative_rms[~is_resting] ** 2)))
