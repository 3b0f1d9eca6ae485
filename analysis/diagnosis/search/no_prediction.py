"""Detects explanations without predictive power: an effect that stops the simulated device can fit better than a wrong
one."""

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import rms_over, signal_rms
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.settings import NO_PREDICTION_ERROR, NO_PREDICTION_SHARE
from analysis.diagnosis.types import Mask
from equalizer.effects.placing import place_of_effect
from equalizer.signals.signal import FloatArray

_TINY = 1e-300


def is_without_prediction(measure: ErrorMeasure, candidate: FittedCandidate) -> bool:
    """Whether the prediction is better than none in no channel, on the samples to fit and to choose by."""
    return bool((_residual_rms(measure, candidate.fitted) >= NO_PREDICTION_SHARE * _signal_rms(measure)).all())


def predicts_nothing(measure: ErrorMeasure, base: Fitted, fitted: Fitted) -> bool:
    """Whether the new effect leaves no predictive power, far above the noise, in the channel where it gains most or
    whose sensor it acts on: a low pass that passes nothing explains nothing, though it frees the model for others."""
    before, left = _residual_rms(measure, base), _residual_rms(measure, fitted)
    most = int(np.argmax(np.log(np.maximum(before, _TINY)) - np.log(np.maximum(left, _TINY))))
    claim = fitted.hypothesis.claims[-1]
    sensed = claim.sites if place_of_effect(claim.effect) == "sensor" else ()
    nothing = left >= np.maximum(NO_PREDICTION_SHARE * _signal_rms(measure), NO_PREDICTION_ERROR * measure.noise)
    return bool(nothing[most] or any(nothing[site] for site in sensed if site < len(nothing)))


def _residual_rms(measure: ErrorMeasure, fitted: Fitted) -> FloatArray:
    """(c,): rms"""
    return np.asarray(rms_over(measure.records, fitted.residuals, _decision_samples(measure)) * measure.unit)


def _signal_rms(measure: ErrorMeasure) -> FloatArray:
    """(c,): rms"""
    return signal_rms(measure.records, _decision_samples(measure))


def _decision_samples(measure: ErrorMeasure) -> list[Mask]:
    return [record.fit | record.choose for record in measure.records]
