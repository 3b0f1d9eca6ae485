"""Errors of a fit over the noise, on the samples to fit, to choose and to test by."""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

_TINY = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class FitScore:
    """(c,) each: rms error over rms noise, 1 = noise alone."""

    fit: FloatArray
    choose: FloatArray
    test: FloatArray

    @property
    def worst_channel(self) -> float:
        """The worst channel, on the samples to fit and to choose by."""
        return float(max(self.fit.max(), self.choose.max()))

    @property
    def mean_log_error(self) -> float:
        """Criterion of comparisons: the mean over channels of the logarithm of the error power, 0 = noise.

        The likelihood where each channel's error is as strong as it is: no channel drowns the others.
        """
        return float(np.mean(np.log(np.maximum(self.fit, _TINY))) + np.mean(np.log(np.maximum(self.choose, _TINY))))

    def larger(self, times: FloatArray) -> "FitScore":
        """times: (c,)"""
        return FitScore(self.fit * times, self.choose * times, self.test * times)


def fit_score(measure: ErrorMeasure, residuals: tuple[FloatArray, ...]) -> FitScore:
    """residuals: per record (n, c), in units of `measure.unit`."""
    scale = measure.unit / measure.noise
    return FitScore(
        *(
            np.maximum(
                rms_over(measure.records, residuals, [getattr(record, part) for record in measure.records]) * scale,
                measure.least,
            )
            for part in ("fit", "choose", "test")
        )
    )


def rms_over(records: tuple[Observed, ...], residuals: tuple[FloatArray, ...], masks: list[Mask]) -> FloatArray:
    """(c,): rms residual over the masked samples of all records; NaN where no sample counts."""
    squares = sum(np.einsum("nc,nc->c", each[mask], each[mask]) for each, mask in zip(residuals, masks, strict=True))
    count = sum(int(mask.sum()) for mask in masks)
    return np.asarray(np.sqrt(squares / count)) if count else np.full(residuals[0].shape[1], np.nan)
