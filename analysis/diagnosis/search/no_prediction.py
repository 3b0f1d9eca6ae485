"""Detect explanations without predictive power: their prediction is hardly better than a constant.

An effect that stops the simulated device, or a low-pass filter that passes nothing, leaves the whole signal as
residual. That can be a smaller error than that of a wrong prediction, although it explains nothing.
"""

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import compute_residual_rms, compute_signal_rms
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.limits import NO_PREDICTION_ERROR, NO_PREDICTION_SHARE
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.types import Mask
from equalizer.effects.placing import find_device_part
from equalizer.signals.signal import FloatArray

_LEAST_RMS = 1e-300
"""Lower limit of an rms, so that its logarithm is finite."""


def has_no_predictive_power(measure: ErrorMeasure, candidate: FittedCandidate) -> bool:
    """Whether in every channel the rms residual is at least `NO_PREDICTION_SHARE` of the rms of the signal without its
    mean, on the samples to fit and to choose by; false where a residual is NaN."""
    return bool(
        (_compute_residual_rms(measure, candidate.fitted) >= NO_PREDICTION_SHARE * _compute_signal_rms(measure)).all()
    )


def has_unpredicted_channel(measure: ErrorMeasure, base: Fitted, fitted: Fitted) -> bool:
    """Whether the channel in which the newest effect reduces the error most, or one whose sensor the effect acts on, is
    not predicted: its rms residual is at least `NO_PREDICTION_SHARE` of the signal and at least `NO_PREDICTION_ERROR`
    times the noise. Such an effect only enables the model to fit the other channels better. base: fit without it."""
    base_rms, fitted_rms = _compute_residual_rms(measure, base), _compute_residual_rms(measure, fitted)
    most_improved_channel = int(
        np.argmax(np.log(np.maximum(base_rms, _LEAST_RMS)) - np.log(np.maximum(fitted_rms, _LEAST_RMS)))
    )
    claim = fitted.hypothesis.claims[-1]
    sensor_sites = claim.sites if find_device_part(claim.effect) == "sensor" else ()
    is_unpredicted = fitted_rms >= np.maximum(
        NO_PREDICTION_SHARE * _compute_signal_rms(measure), NO_PREDICTION_ERROR * measure.noise
    )
    return bool(
        is_unpredicted[most_improved_channel]
        or any(is_unpredicted[site] for site in sensor_sites if site < len(is_unpredicted))
    )


def _compute_residual_rms(measure: ErrorMeasure, fitted: Fitted) -> FloatArray:
    """Compute (c,): rms residual, in each channel's own unit."""
    return np.asarray(compute_residual_rms(fitted.residuals, _select_decision_samples(measure)) * measure.unit)


def _compute_signal_rms(measure: ErrorMeasure) -> FloatArray:
    """Compute (c,): rms of the measured signal without its mean, in each channel's own unit."""
    return compute_signal_rms(measure.records, _select_decision_samples(measure))


def _select_decision_samples(measure: ErrorMeasure) -> list[Mask]:
    """Select, per record, the mask of the samples to fit and to choose by."""
    return [record.fit | record.choose for record in measure.records]
