"""Protocol of the error measures: residuals of a model with effects, sample by sample, in units of the noise.

Three measures, one per file: `free_simulation`, `windows`, `predicted_force`; `choose_measure` selects one.
"""

from collections.abc import Sequence
from typing import Protocol, Self

from analysis.diagnosis.data.observed import Observed
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


class ErrorMeasure(Protocol):
    """A comparison of measurements with simulated responses, with windows of them, or with predicted forces."""

    @property
    def name(self) -> str:
        """The measure's name in `diagnosis.json`."""

    @property
    def records(self) -> tuple[Observed, ...]:
        """The compared records. Their `measured` are the c channels: response and position, or forces."""

    @property
    def noise(self) -> FloatArray:
        """(c,): rms of the unpredictable part (noise), in each channel's own unit."""

    @property
    def unit(self) -> FloatArray:
        """(c,): unit of a residual, in each channel's own unit."""

    @property
    def least(self) -> float:
        """Least error in units of the noise: smaller errors are set to it."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """The measure on the same records with other sample roles."""

    def with_floor(self, rms: FloatArray) -> Self:
        """The measure with further noise added to its own (root sum of squares), and 1 as its least error. rms: (c,),
        in each channel's own unit."""

    def shorten(self) -> Self:
        """The measure on records cut after their last sample to fit or to choose by."""

    def can_observe(self, effect: Effect) -> bool:
        """Whether the effect changes the compared signals; an effect that does not is not a candidate."""

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Per record (n, c): measured less predicted, in units of `unit`. Forces raise numpy.linalg.LinAlgError where
        the model's outputs do not determine its motion."""

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Per record, the motion and missing force from which starting values are estimated; `residuals` are those of
        the same model and effects."""
