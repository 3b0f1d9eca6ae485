"""Feedforward forces at a place of the workspace, by a single model or by the weighted sum of several models' forces.

The models and weights come from an interpolation between places (`interpolation_choice`).
"""

from dataclasses import replace

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.feedforward import (
    NO_CAP_N,
    Feedforward,
    FeedforwardSettings,
    compute_feedforward_forces,
)
from equalizer.tracking.learning.iteration import InverseOperator
from equalizer.tracking.learning.model_inverse import InverseOfLength, make_inverse_operator
from equalizer.tracking.lqr.limits import require_under_cap
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace


def compute_feedforward_at_place(
    place_models: ModelsAtPlace, reference: Signal, settings: FeedforwardSettings
) -> Feedforward:
    """Compute feedforward forces at a place: the weighted sum of the forces of all models with a weight above zero.
    Error and loss are the largest of any model's forces, predicted by that model; `peaks` are those of the sum;
    `predicted` and the other fields are those of the model with the largest weight. reference: (N, p), m/s². Raises
    ForceLimitError where the sum exceeds the cap, and the errors of `compute_feedforward_forces`."""
    used_models = select_used_models(place_models)
    if len(used_models) == 1:
        return compute_feedforward_forces(used_models[0][1], reference, settings)
    # The sum may be under the cap where the forces of one model are not, so that the cap is checked on the sum. With
    # `constrain`, each model's forces are limited, and so is their convex combination.
    model_settings = settings if settings.constrain else replace(settings, cap_n=NO_CAP_N)
    weighted_results = [
        (force_weight, compute_feedforward_forces(model, reference, model_settings))
        for force_weight, model in used_models
    ]
    forces = np.asarray(
        sum(force_weight * result.forces.samples for force_weight, result in weighted_results), dtype=np.float64
    )
    main_result = max(weighted_results, key=lambda weighted_result: weighted_result[0])[1]
    cap_losses = [result.loss for _, result in weighted_results if result.loss is not None]
    return replace(
        main_result,
        forces=replace(main_result.forces, samples=forces),
        error=max(result.error for _, result in weighted_results),
        peaks=require_under_cap(forces, settings.cap_n, reference.sample_rate_hz),
        loss=max(cap_losses, key=lambda loss: loss.error_capped, default=None),
    )


def select_used_models(place_models: ModelsAtPlace) -> tuple[tuple[float, IdentifiedModel], ...]:
    """Select the weights above zero and their models, with the band of each restricted to the band common to all of
    them."""
    weighted_models = [
        (force_weight, model)
        for force_weight, model in zip(place_models.weights, place_models.models, strict=True)
        if force_weight > 0
    ]
    band_hz = (
        max(model.band_hz[0] for _, model in weighted_models),
        min(model.band_hz[1] for _, model in weighted_models),
    )
    return tuple((force_weight, replace(model, band_hz=band_hz)) for force_weight, model in weighted_models)


def make_inverse_at_place(place_models: ModelsAtPlace, weight: float) -> InverseOfLength:
    """Make the weighted sum of the inverse operators of all models at a place, for iterative learning control. weight:
    R = weight I, of |u|², (m/s² per N)²."""
    weighted_inverses = [
        (force_weight, make_inverse_operator(model, weight)) for force_weight, model in select_used_models(place_models)
    ]

    def make_inverse_of_length(row_count: int) -> InverseOperator:
        """Make the inverse operator for records of `row_count` samples."""
        inverses = [(force_weight, inverse(row_count)) for force_weight, inverse in weighted_inverses]
        return lambda reference: np.asarray(
            sum(force_weight * invert(reference) for force_weight, invert in inverses), dtype=np.float64
        )

    return make_inverse_of_length
