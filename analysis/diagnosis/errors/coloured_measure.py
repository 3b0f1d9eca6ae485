"""Error measure with prewhitened residuals: its noise has the spectrum of the model error on reference recordings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.whitening_filter import WhiteningFilter
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ColouredMeasure:
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


def whiten_measure(plain: ErrorMeasure, whitening: WhiteningFilter, noise: FloatArray) -> ColouredMeasure:
    """The measure with whitened residuals. noise: (c,), see `ColouredMeasure`."""
    warm = [_leave_out_warm_up(record, whitening) for record in plain.records]
    return ColouredMeasure(plain.with_records(tuple(warm)), whitening, noise, noise)


def _leave_out_warm_up(record: Observed, whitening: WhiteningFilter) -> Observed:
    warm = whitening.warm(record.measured)
    return replace(record, fit=record.fit & warm, choose=record.choose & warm, test=record.test & warm)
