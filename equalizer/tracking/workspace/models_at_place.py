"""Models with weights for a place of the workspace: the forces there are the weighted sum of the models' forces.

Result of an interpolation between places: a single model by `modal_interpolation`, models with weights by
`blended_inverse`, chosen by `interpolation_choice`. Sizes: m inputs, p outputs of a model.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.periodic_inverse import FORCE_WEIGHT, compute_regularised_inverse
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.workspace.workspace_models import Place


@dataclass(frozen=True, slots=True, eq=False)
class ModelsAtPlace:
    """Models for a place, with the weights by which their inverses and forces are summed."""

    place_m: Place
    """The place, m."""
    models: tuple[IdentifiedModel, ...]
    """At least one; the same inputs, outputs and sample rate."""
    weights: tuple[float, ...]
    """One per model, none negative, sum 1: weights of the forces, never of models or responses."""
    remarks: tuple[str, ...] = ()
    """Sentences for the user, for example that the place is outside the identified places."""

    def compute_inverse(
        self, frequency_hz: FloatArray, weight: float = FORCE_WEIGHT, spring: VirtualSpring = NO_SPRING
    ) -> ComplexArray:
        """Compute the weighted sum of the models' regularised inverses (`compute_regularised_inverse`), (lines, m, p),
        N per m/s², at frequency_hz (lines,). weight: of |force|², (m/s² per N)²; spring: virtual spring whose force is
        subtracted."""
        weighted_inverses = [
            force_weight * compute_regularised_inverse(model, frequency_hz, weight, spring)
            for force_weight, model in self._select_used_models()
        ]
        return np.asarray(sum(weighted_inverses), dtype=np.complex128)

    def compute_forces(self, track: Callable[[IdentifiedModel], FloatArray]) -> FloatArray:
        """Compute the weighted sum of the forces (samples, m), in newtons, that `track` returns for a model."""
        return np.asarray(
            sum(force_weight * track(model) for force_weight, model in self._select_used_models()),
            dtype=np.float64,
        )

    def _select_used_models(self) -> list[tuple[float, IdentifiedModel]]:
        """Select the weights above zero with their models; the others need not be evaluated."""
        return [
            (force_weight, model)
            for force_weight, model in zip(self.weights, self.models, strict=True)
            if force_weight > 0
        ]
