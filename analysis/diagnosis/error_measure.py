"""How far a model with effects is from what was observed, sample by sample, in units of the noise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from analysis.diagnosis.observed import Observed
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulator import Played, Seen, simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


class ErrorMeasure(Protocol):
    """Port. What is compared: whole simulated courses, windows of them, or forces."""

    @property
    def name(self) -> str:
        """As `diagnosis.json` says it."""

    @property
    def records(self) -> tuple[Observed, ...]: ...

    @property
    def noise(self) -> FloatArray:
        """(c,): rms of what no model can predict, in each channel's own unit."""

    @property
    def unit(self) -> FloatArray:
        """(c,): what 1 in a residual is in each channel's own unit."""

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Per record (n, c): measured less predicted, in units of the noise."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeSimulation:
    """From rest at the first sample, by the commands alone."""

    records: tuple[Observed, ...]
    unit: FloatArray
    noise: FloatArray
    """(c,): rms"""
    name: str = "free simulation"

    def shortened(self) -> "FreeSimulation":
        """Without the samples behind the last that decisions may see."""
        return replace(self, records=tuple(one.shortened() for one in self.records))

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        return tuple(
            (one.measured - channels(self.played(model, effects, one), one.measured.shape[1])) / self.unit
            for one in self.records
        )

    def played(self, model: MechanicalModel, effects: Sequence[PlacedEffect], record: Observed) -> Played:
        signals, p = record.recording, model.outputs
        position = record.measured[:, p:] if record.measured.shape[1] == 2 * p else None
        seen = Seen(record.measured[:, :p], self.noise[:p], position)
        return simulate_mechanism(model, record.command, signals.sample_rate_hz, effects, signals.hold, seen)


def channels(played: Played, count: int) -> FloatArray:
    """(n, c): the response and, where there are so many channels, the position."""
    return np.hstack([played.response, played.position])[:, :count]
