"""Port of the error measures: residuals of a model with effects, sample by sample, in units of the noise.

Three ways of looking, one per file: `free_simulation`, `windows`, `predicted_force`; which one suits is said by
`choose_measure`.
"""

from collections.abc import Sequence
from typing import Protocol, Self

from analysis.diagnosis.data.observed import Observed
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


class ErrorMeasure(Protocol):
    """Port. What is compared: whole simulated courses, windows of them, or forces."""

    @property
    def name(self) -> str:
        """As `diagnosis.json` says it."""

    @property
    def records(self) -> tuple[Observed, ...]:
        """What is compared: their `measured`, with the channels of their recording's response and position."""

    @property
    def noise(self) -> FloatArray:
        """(c,): rms of what no model can predict, in each channel's own unit."""

    @property
    def unit(self) -> FloatArray:
        """(c,): what 1 in a residual is in each channel's own unit."""

    @property
    def least(self) -> float:
        """Times the noise: no error counts as less, for what lies below tells nothing."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """The same records, with samples that count for something else."""

    def with_floor(self, rms: FloatArray) -> Self:
        """rms: (c,), in each channel's own unit: so much more counts as noise, and no error as less than that."""

    def shorten(self) -> Self:
        """Without the samples behind the last that decisions may see."""

    def can_observe(self, effect: Effect) -> bool:
        """Whether it could see the effect at all; others are not to be considered."""

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Per record (n, c): measured less predicted, in units of `unit`."""

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Per record, what starting values are drawn from; `residuals` are those of the same model and effects."""
