"""Error measure with prewhitened residuals, and its whitening filter.

The whitened residual is the one-step prediction error of an AR(p) model of the residual r that a re-tuned model leaves
on reference recordings,

    w(t) = r(t) + a1 r(t-1) + ... + ap r(t-p),        R a = -[R(1) ... R(p)]        (Yule-Walker)

with a = (a1 ... ap), the autocovariance R(k) = E r(t) r(t-k) and its Toeplitz matrix R. The squared gain of the filter
is about proportional to the inverse of the residual's spectrum: frequencies at which the re-tuned model also errs on
the reference recordings get little weight, those at which it is accurate get much.

References: Yule, Phil. Trans. R. Soc. A 226 (1927), 267; Walker, Proc. R. Soc. A 131 (1931), 518; Ljung, System
Identification (1999), section 7.2 (prefiltering of prediction errors).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import solve_toeplitz

from analysis.diagnosis.data.correlated_residuals import compute_lagged_products
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.types import Mask
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

MOST_LAGS, SAMPLES_PER_LAG = 64, 50
"""Largest order p of the autoregression, and least samples per lag: with fewer, the coefficients are mostly noise. Both
were set by hand."""
WHITE_SHARE = 1e-4
"""White noise added to the residual before the fit, as a share of its power: it limits the weight of frequencies
without power, and keeps the Toeplitz matrix well conditioned."""


@dataclass(frozen=True, slots=True, eq=False)
class WhiteningFilter:
    """A causal FIR filter per channel, which makes the reference residual white."""

    coefficients: FloatArray
    """(p + 1, c): impulse response, 1 and then a1 ... ap."""

    @property
    def order(self) -> int:
        """Order p of the autoregression."""
        return len(self.coefficients) - 1

    def apply(self, residual: FloatArray) -> FloatArray:
        """Filter a residual (n, c): (n, c); unknown samples count as 0 in the filter, and are NaN in the result."""
        is_known = np.isfinite(residual)
        padded_residual = np.where(is_known, residual, 0.0)
        # Padded by the filter's length, so that the circular convolution of the FFT is a linear one.
        padded_length = next_fast_len(len(residual) + self.order, True)
        filtered = irfft(
            rfft(padded_residual, padded_length, axis=0) * rfft(self.coefficients, padded_length, axis=0),
            padded_length,
            axis=0,
        )
        return np.where(is_known, filtered[: len(residual)], np.nan)

    def mask_full_history(self, residual: FloatArray) -> Mask:
        """Mask (n,) the samples of a residual (n, c) for which all samples that the filter uses are known."""
        is_unknown = np.concatenate([np.ones(self.order), ~np.isfinite(residual).all(axis=1)])
        cumulative_unknown = np.concatenate([[0.0], np.cumsum(is_unknown)])
        return np.asarray(cumulative_unknown[self.order + 1 :] == cumulative_unknown[: len(residual)], dtype=np.bool_)


def fit_whitening_filter(residuals: Sequence[FloatArray], white_noise_rms: FloatArray) -> WhiteningFilter:
    """Fit an autoregression to residuals by the Yule-Walker equations, channel by channel. residuals: (n, c) each, NaN
    where not known. white_noise_rms: (c,), rms of white noise in the residuals' unit, which bounds the spectrum from
    below."""
    sample_count = sum(int(np.isfinite(residual).all(axis=1).sum()) for residual in residuals)
    order = int(np.clip(sample_count // SAMPLES_PER_LAG, 1, MOST_LAGS))
    autocovariance: FloatArray = np.sum(
        [compute_lagged_products(residual, order) for residual in residuals], axis=0
    ) / max(sample_count, 1)
    autocovariance[0] = autocovariance[0] * (1 + WHITE_SHARE) + white_noise_rms**2
    coefficients = np.zeros((order + 1, len(white_noise_rms)))
    coefficients[0] = 1.0
    for c, channel_autocovariance in enumerate(autocovariance.T):
        coefficients[1:, c] = -solve_toeplitz(channel_autocovariance[:-1], channel_autocovariance[1:])
    return WhiteningFilter(coefficients)


@dataclass(frozen=True, slots=True, eq=False)
class WhitenedMeasure:
    """An error measure (`ErrorMeasure`) of whitened residuals."""

    base_measure: ErrorMeasure
    whitening: WhiteningFilter
    unit: FloatArray
    """(c,): divisor of the whitened residuals, in each channel's own unit: the noise, with a floor added in
    quadrature."""
    noise: FloatArray
    """(c,): rms of the whitened residual of the reference recordings, scaled with the signal, in each channel's own
    unit, with the same floor."""
    least_error: float = 0.0
    """Least error in units of the noise: smaller errors are set to it; 1 with a floor."""

    @property
    def name(self) -> str:
        """Name of the measure whose residuals are whitened."""
        return self.base_measure.name

    @property
    def records(self) -> tuple[Observed, ...]:
        """The compared records. After `whiten_measure`, samples without full history of the filter have no role."""
        return self.base_measure.records

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """Return the measure on other records, with the same filter. Their sample roles are kept, also where the filter
        has no full history."""
        return replace(self, base_measure=self.base_measure.with_records(records))

    def with_floor(self, rms: FloatArray) -> Self:
        """Return the measure with noise of this rms (c,) added in power, and 1 as its least error."""
        return replace(self, unit=np.hypot(self.unit, rms), noise=np.hypot(self.noise, rms), least_error=1.0)

    def shorten(self) -> Self:
        """Return the measure without the samples after the last to fit or to choose by, as in the base measure."""
        return replace(self, base_measure=self.base_measure.shorten())

    def can_observe(self, effect: Effect) -> bool:
        """Whether the effect changes the compared signals: as in the base measure."""
        return self.base_measure.can_observe(effect)

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Compute, per record, (n, c): residuals of the base measure through the filter, in `unit`; NaN where
        missing."""
        base_residuals = self.base_measure.residuals(model, effects)
        # The filter was fitted to residuals in the channels' units, without the division by `unit`.
        return tuple(self.whitening.apply(residual * self.base_measure.unit) / self.unit for residual in base_residuals)

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Gather the evidence from the residuals before whitening, because estimators of starting values need time
        series of motions. residuals: not used."""
        return self.base_measure.evidence(model, effects, self.base_measure.residuals(model, effects))


def whiten_measure(base_measure: ErrorMeasure, whitening: WhiteningFilter, noise: FloatArray) -> WhitenedMeasure:
    """Whiten the residuals of a measure; samples without full history of the filter lose their roles. noise: (c,), see
    `WhitenedMeasure`."""
    records = tuple(_leave_out_warm_up(record, whitening) for record in base_measure.records)
    return WhitenedMeasure(base_measure.with_records(records), whitening, noise, noise)


def _leave_out_warm_up(record: Observed, whitening: WhiteningFilter) -> Observed:
    """Remove the roles of the samples whose filter output depends on unknown samples."""
    has_history = whitening.mask_full_history(record.measured)
    return replace(
        record, fit=record.fit & has_history, choose=record.choose & has_history, test=record.test & has_history
    )
