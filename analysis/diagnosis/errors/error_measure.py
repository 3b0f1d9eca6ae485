"""Protocol of the error measures of a diagnosis: residuals of a model with effects, sample by sample, scaled by the
noise.

`choose_measure` selects one of three: `free_simulation`, `windows` and `forces.predicted_force`. `whitened_measure`
wraps any of them with a whitening filter that was learned from reference recordings.
"""

from collections.abc import Sequence
from typing import Protocol, Self

from analysis.diagnosis.data.observed import Observed
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


class ErrorMeasure(Protocol):
    """A comparison of measured signals with predictions of a model: responses simulated over the whole record or over
    short windows, or the forces that the measured motion requires."""

    @property
    def name(self) -> str:
        """The measure's name in `diagnosis.json`."""

    @property
    def records(self) -> tuple[Observed, ...]:
        """The n samples of each compared record. `measured` has the c channels: response and position, or forces."""

    @property
    def noise(self) -> FloatArray:
        """(c,): rms of the noise, the part that no model predicts, in each channel's physical unit."""

    @property
    def unit(self) -> FloatArray:
        """(c,): divisor that scales the residuals, in each channel's physical unit; usually the rms noise."""

    @property
    def least_error(self) -> float:
        """Lower limit of rms errors relative to the noise: smaller errors are set to it."""

    def with_records(self, records: tuple[Observed, ...]) -> Self:
        """Return the measure on other records, which usually differ in sample roles alone; some implementations require
        equal number and lengths."""

    def with_floor(self, rms: FloatArray) -> Self:
        """Return the measure with an error floor: further noise, added to its own as a root sum of squares, and 1 as
        its least error. rms: (c,), of the further noise, in each channel's physical unit."""

    def shorten(self) -> Self:
        """Return the measure on records without the samples after the last fit or validation sample, to save time."""

    def can_observe(self, effect: Effect) -> bool:
        """Whether the effect changes the compared signals; an effect that does not is not a candidate."""

    def residuals(self, model: MechanicalModel, effects: Sequence[PlacedEffect]) -> tuple[FloatArray, ...]:
        """Compute, per record, (n, c): measured minus predicted, divided by `unit`. With predicted forces, raises
        numpy.linalg.LinAlgError where the model's outputs do not determine its motion."""

    def evidence(
        self, model: MechanicalModel, effects: Sequence[PlacedEffect], residuals: tuple[FloatArray, ...]
    ) -> tuple[Evidence, ...]:
        """Gather, per record, the motion and the missing force from which starting values of further effects are
        estimated. residuals: those of the same model and effects."""
