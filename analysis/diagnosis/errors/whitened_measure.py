"""Error measure with prewhitened residuals, and its whitening filter.

The whitened residual is the one-step prediction error of an AR(p) model, fitted by Yule-Walker (Yule 1927, Walker 1931)
to the residual that a re-tuned model leaves on reference recordings: each frequency is weighted by the inverse of that
residual's spectrum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import solve_toeplitz

from analysis.diagnosis.data.correlated_residuals import lagged_products
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.types import Mask
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

MOST_LAGS, SAMPLES_PER_LAG = 64, 50
"""Largest order of the autoregression, and least samples per lag."""
FLAT = 1e-4
"""White noise added to the power, as a share of it: bounds the weight of any frequency."""


@dataclass(frozen=True, slots=True, eq=False)
class WhiteningFilter:
    """A causal FIR filter per channel, which makes the reference residual white."""

    steps: FloatArray
    """(lags + 1, c): the whitening filter, the first row 1."""

    @property
    def lags(self) -> int:
        return len(self.steps) - 1

    def apply(self, left: FloatArray) -> FloatArray:
        """(n, c): residuals through the causal filter; unknown samples count as 0 and stay NaN."""
        known = np.isfinite(left)
        filled = np.where(known, left, 0.0)
        room = next_fast_len(len(left) + self.lags, True)
        passed = irfft(rfft(filled, room, axis=0) * rfft(self.steps, room, axis=0), room, axis=0)
        return np.where(known, passed[: len(left)], np.nan)

    def warm(self, left: FloatArray) -> Mask:
        """(n,): mask of the samples for which all samples that the filter uses are known."""
        unknown = np.concatenate([np.ones(self.lags), ~np.isfinite(left).all(axis=1)])
        until = np.concatenate([[0.0], np.cumsum(unknown)])
        return np.asarray(until[self.lags + 1 :] == until[: len(left)], dtype=np.bool_)


def whitening_filter(residuals: Sequence[FloatArray], least: FloatArray) -> WhiteningFilter:
    """Autoregression fitted to residuals by Yule-Walker. residuals: (n, c) each, NaN where not known. least: (c,), rms
    of white noise, which bounds the spectrum from below."""
    count = sum(int(np.isfinite(residual).all(axis=1).sum()) for residual in residuals)
    lags = int(np.clip(count // SAMPLES_PER_LAG, 1, MOST_LAGS))
    alike: FloatArray = np.sum([lagged_products(residual, lags) for residual in residuals], axis=0) / max(count, 1)
    alike[0] = alike[0] * (1 + FLAT) + least**2
    steps = np.zeros((lags + 1, len(least)))
    steps[0] = 1.0
    for c, row in enumerate(alike.T):
        steps[1:, c] = -solve_toeplitz(row[:-1], row[1:])
    return WhiteningFilter(steps)


@dataclass(frozen=True, slots=True, eq=False)
class WhitenedMeasure:
    """An error measure with whitened residuals; they count where all samples that the filter uses are known."""

    plain: ErrorMeasure
    whitening: WhiteningFilter
    unit: FloatArray
    noise: FloatArray
    """(c,): rms of the whitened residual of the reference recordings, in each channel's own unit."""
    least: float = 0.0
    """Least error in units of the noise: smaller ones are set to it; 1 with a floor."""

    @property
    def name(self) -> str:
        return self.plain.name

    @property
    def records(self) -> tuple[Observed, ...]:
        return self.plain.records

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        return replace(self, plain=self.plain.with_records(records))

    def with_floor(self, rms: FloatArray) -> Self:
        return replace(self, unit=np.hypot(self.unit, rms), noise=np.hypot(self.noise, rms), least=1.0)

    def shorten(self) -> Self:
        return replace(self, plain=self.plain.shorten())

    def can_observe(self, effect: Effect) -> bool:
        return self.plain.can_observe(effect)

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        left = self.plain.residuals(model, effects)
        return tuple(self.whitening.apply(residual * self.plain.unit) / self.unit for residual in left)

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Evidence from the residuals before whitening: estimators of starting values need time series."""
        return self.plain.evidence(model, effects, self.plain.residuals(model, effects))


def whiten_measure(plain: ErrorMeasure, whitening: WhiteningFilter, noise: FloatArray) -> WhitenedMeasure:
    """The measure with whitened residuals. noise: (c,), see `WhitenedMeasure`."""
    warm = [_leave_out_warm_up(record, whitening) for record in plain.records]
    return WhitenedMeasure(plain.with_records(tuple(warm)), whitening, noise, noise)


def _leave_out_warm_up(record: Observed, whitening: WhiteningFilter) -> Observed:
    warm = whitening.warm(record.measured)
    return replace(record, fit=record.fit & warm, choose=record.choose & warm, test=record.test & warm)
