"""Scores of a fit: rms error over rms noise per channel, on the samples to fit, to choose and to test by.

`FitScore.mean_log_error` is the criterion by which fits are compared; the functions below compute rms errors and the
rms of the measured signals that errors are normalised by.
"""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.types import Mask
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import FloatArray

_LEAST_ERROR = 1e-6
"""Lower limit of an error in `mean_log_error`, relative to the noise, so that its logarithm is finite."""


@dataclass(frozen=True, slots=True, eq=False)
class FitScore:
    """Rms error of each channel, (c,) each, on the samples to fit, to choose and to test by, relative to the rms noise;
    1 = only noise, NaN without samples."""

    fit: FloatArray
    choose: FloatArray
    test: FloatArray

    @property
    def worst_channel(self) -> float:
        """Error of the worst channel, on the samples to fit and to choose by."""
        return float(max(self.fit.max(), self.choose.max()))

    @property
    def mean_log_error(self) -> float:
        """Mean log error power: mean over channels of ln(fit * choose); 0 = only noise. Up to constants this is the
        negative log-likelihood with a free error variance per channel, so that no channel dominates the others."""
        return float(
            np.mean(np.log(np.maximum(self.fit, _LEAST_ERROR))) + np.mean(np.log(np.maximum(self.choose, _LEAST_ERROR)))
        )

    def scale_errors(self, factors: FloatArray) -> "FitScore":
        """Multiply the errors by `factors`, (c,)."""
        return FitScore(self.fit * factors, self.choose * factors, self.test * factors)


def compute_fit_score(measure: ErrorMeasure, residuals: tuple[FloatArray, ...]) -> FitScore:
    """Compute the score of residuals, per record (n, c), in units of `measure.unit`; errors are at least
    `measure.least_error`."""
    unit_per_noise = measure.unit / measure.noise
    return FitScore(
        *(
            np.maximum(
                compute_residual_rms(residuals, [getattr(record, role) for record in measure.records]) * unit_per_noise,
                measure.least_error,
            )
            for role in ("fit", "choose", "test")
        )
    )


def compute_signal_rms(records: tuple[Observed, ...], masks: list[Mask]) -> FloatArray:
    """Compute (c,): standard deviation of the measured signals over the masked samples of all records, by which errors
    are normalised. Positions are taken relative to the mean of each record, because encoders start anywhere; forces,
    speeds and accelerations relative to the mean of all records, because recordings at different constant speeds differ
    only in their means. masks: (n,) per record. NaN where all masks are empty."""
    used_records = [(record, mask) for record, mask in zip(records, masks, strict=True) if mask.any()]
    if not used_records:
        return np.full(records[0].measured.shape[1], np.nan)
    signals = (records[0].recording.response, records[0].recording.position)
    quantities = [quantity for signal in signals if signal is not None for quantity in signal.quantities]
    is_position = [
        quantity != "voltage" and DERIVATIVE_OF_QUANTITY.get(quantity) == 0
        for quantity in quantities[: records[0].measured.shape[1]]
    ]
    common_mean = np.nanmean(np.concatenate([record.measured[mask] for record, mask in used_records]), axis=0)
    deviations = [
        record.measured[mask] - np.where(is_position, np.nanmean(record.measured[mask], axis=0), common_mean)
        for record, mask in used_records
    ]
    return np.asarray(np.sqrt(np.mean(np.concatenate(deviations) ** 2, axis=0)))


def compute_residual_rms(residuals: tuple[FloatArray, ...], masks: list[Mask]) -> FloatArray:
    """Compute (c,): rms residual over the masked samples of all records; NaN where the masks are empty."""
    sum_of_squares = sum(
        np.einsum("nc,nc->c", residual[mask], residual[mask]) for residual, mask in zip(residuals, masks, strict=True)
    )
    sample_count = sum(int(mask.sum()) for mask in masks)
    return (
        np.asarray(np.sqrt(sum_of_squares / sample_count)) if sample_count else np.full(residuals[0].shape[1], np.nan)
    )
