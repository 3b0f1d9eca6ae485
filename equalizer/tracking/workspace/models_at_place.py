"""Models that compute forces at a place: a single one, or several whose forces are added."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.periodic_inverse import WEIGHT, inverse_response
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.workspace.workspace_models import Place


@dataclass(frozen=True, slots=True, eq=False)
class ModelsAtPlace:
    """Models for a place with their weights; the forces there are the weighted sum of those of each model."""

    place_m: Place
    models: tuple[IdentifiedModel, ...]
    weights: tuple[float, ...]
    """One per model, none negative, sum 1: forces are added with them, never models or responses."""
    remarks: tuple[str, ...] = ()
    """What the user should know, in sentences."""

    def inverse(
        self, frequency_hz: FloatArray, weight: float = WEIGHT, spring: VirtualSpring = NO_SPRING
    ) -> ComplexArray:
        """Steady-state forces per wanted output, (lines, m, p)."""
        parts = [w * inverse_response(model, frequency_hz, weight, spring) for w, model in self._select_used_models()]
        return np.asarray(sum(parts), dtype=np.complex128)

    def forces(self, track: Callable[[IdentifiedModel], FloatArray]) -> FloatArray:
        """Forces of a trajectory: the weighted sum of what `track` returns for each model."""
        return np.asarray(sum(w * track(model) for w, model in self._select_used_models()), dtype=np.float64)

    def _select_used_models(self) -> list[tuple[float, IdentifiedModel]]:
        return [(w, model) for w, model in zip(self.weights, self.models, strict=True) if w > 0]
