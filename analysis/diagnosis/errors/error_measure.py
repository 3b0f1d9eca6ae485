"""Protocol of the error measures: residuals of a model with effects, sample by sample, in units of the noise.

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
    """What is compared: whole simulated responses, windows of them, or forces."""

    @property
    def name(self) -> str:
        """The measure's name in `diagnosis.json`."""

    @property
    def records(self) -> tuple[Observed, ...]:
        """What is compared: their `measured`, with the channels of their recording's response and position."""

    @property
    def noise(self) -> FloatArray:
        """(c,): rms of what no model can predict, in each channel's own unit."""

    @property
    def unit(self) -> FloatArray:
        """(c,): unit of a residual, in each channel's own unit."""

    @property
    def least(self) -> float:
        """Least error in units of the noise: smaller ones count as this."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """The measure on the same records with other sample roles."""

    def with_floor(self, rms: FloatArray) -> Self:
        """The measure with more noise, and no error below it. rms: (c,), in each channel's own unit."""

    def shorten(self) -> Self:
        """The measure without the samples after the last to fit or to choose by."""

    def can_observe(self, effect: Effect) -> bool:
        """Whether the effect changes what is compared; other effects are not considered."""

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Per record (n, c): measured less predicted, in units of `unit`."""

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Per record, the motion and missing force from which starting values are estimated; `residuals` are those of
        the same model and effects."""
