"""Prediction error of a model on a recording, without and with a fitted gain factor.

No parameter of the model is fitted. Which signals are compared, and how, is chosen by `choose_measure` as in a
diagnosis.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.types import Mask
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

PredictedSamples = Literal["all", "test"]
"""Samples on which errors are computed: all that the measure uses, or only the held-out ones (to test by)."""


@dataclass(frozen=True, slots=True)
class ChannelRms:
    """Standard deviation of the signal and rms error of one channel, in the unit of the recording."""

    name: str
    unit: str
    signal: float
    """Standard deviation of the measured signal."""
    error: float
    """Rms of the prediction error."""


@dataclass(frozen=True, slots=True, eq=False)
class PredictionError:
    """Normalised rms errors, dimensionless: sqrt(mean over channels of (rms error / standard deviation of signal)²).
    None where they are not finite or no sample is compared."""

    measure_name: str
    """Name of the error measure, as in `diagnosis.json`."""
    without_gain: float | None
    """The error of the model without any gain factor."""
    with_gain: float | None
    """The error with one gain factor for all channels, fitted to the samples that are not held out; to the compared
    samples where all are compared, or none is left to fit. None also where no gain can be fitted."""
    channels: tuple[ChannelRms, ...]
    """Errors of each response channel, without the gain factor; empty where they are not finite, no sample is compared,
    or forces are compared."""


def compute_prediction_error(
    recording: Recording, model: MechanicalModel, selection: PredictedSamples
) -> PredictionError:
    """Compute the error of a model, with the effects that it contains, on a recording. selection: samples on which the
    error is computed; with "test", the gain factor is fitted to the other samples, if there are any."""
    measure = make_measure((recording,), model).measure
    measured, predicted, test_masks, fit_masks = [], [], [], []
    for record, residual in zip(measure.records, measure.residuals(model, ()), strict=True):
        is_complete = np.isfinite(record.measured).all(axis=1)
        measured.append(record.measured)
        predicted.append(record.measured - residual * measure.unit)
        test_masks.append(
            (record.test if selection == "test" else record.test | record.fit | record.choose) & is_complete
        )
        fit_masks.append((record.fit | record.choose) & is_complete)
    # y: measured, f: predicted, (n, c) each.
    y, f = np.vstack(measured), np.vstack(predicted)
    test_mask, fit_mask = np.concatenate(test_masks), np.concatenate(fit_masks)
    gain = _fit_gain(y, f, fit_mask if selection == "test" and fit_mask.any() else test_mask)
    return PredictionError(
        measure.name,
        _compute_normalised_rms(y, f, test_mask),
        None if gain is None else _compute_normalised_rms(y, gain * f, test_mask),
        ()
        if measure.name == "predicted force"
        else tuple(_compute_channel_errors(recording, y[test_mask], f[test_mask])),
    )


def _compute_channel_errors(recording: Recording, y: FloatArray, f: FloatArray) -> Iterator[ChannelRms]:
    """Yield the errors of the response channels, which are the first compared signals; none without a sample, or where
    the prediction is not finite. y: measured, f: predicted, (n, c)."""
    signal = recording.response
    if not len(y) or not np.isfinite(f).all():
        return
    for c, (name, unit) in enumerate(zip(signal.channels, signal.units, strict=True)):
        yield ChannelRms(name, unit, float(np.std(y[:, c])), float(np.sqrt(np.mean((y - f)[:, c] ** 2))))


def _fit_gain(y: FloatArray, f: FloatArray, mask: Mask) -> float | None:
    """Fit the least-squares gain from prediction f to measurement y, (n, c) each, every channel in units of its rms;
    None where the prediction is zero or not finite."""
    channel_rms = np.maximum(np.sqrt(np.mean(y[mask] ** 2, axis=0)), np.finfo(float).tiny)
    predicted, measured = (f[mask] / channel_rms).ravel(), (y[mask] / channel_rms).ravel()
    predicted_power = float(predicted @ predicted)
    return (
        float(predicted @ measured) / predicted_power if np.isfinite(predicted_power) and predicted_power > 0 else None
    )


def _compute_normalised_rms(y: FloatArray, f: FloatArray, mask: Mask) -> float | None:
    """Compute the error of `PredictionError` of prediction f of y, (n, c) each. None where the mask is empty or the
    error is not finite."""
    if not mask.any():
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        channel_std = np.maximum(np.std(y[mask], axis=0), np.finfo(float).tiny)
        normalised_rms = float(np.sqrt(np.mean(np.mean((y - f)[mask] ** 2, axis=0) / channel_std**2)))
    return normalised_rms if np.isfinite(normalised_rms) else None
