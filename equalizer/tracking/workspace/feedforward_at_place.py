"""Feedforward forces at a place of the workspace, by a single model or by the weighted sum of several models' forces.

The models and weights come from an interpolation between places (`interpolation_choice`).
"""

from dataclasses import replace

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.feedforward import NO_CAP_N, Feedforward, FeedforwardSettings, feedforward
from equalizer.tracking.learning.iteration import Invert
from equalizer.tracking.learning.model_inverse import InverseOfLength, inverse_operator
from equalizer.tracking.lqr.limits import require_under_cap
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace


def feedforward_at(at: ModelsAtPlace, reference: Signal, settings: FeedforwardSettings) -> Feedforward:
    """Feedforward at a place: the weighted sum of the forces of all models with a weight. Error and loss are the
    largest of any model's forces, predicted by that model; `predicted` and the other fields are those of the model with
    the largest weight. reference: (N, p), m/s². Raises what `feedforward` raises."""
    used = select_used_models(at)
    if len(used) == 1:
        return feedforward(used[0][1], reference, settings)
    # The sum may be under the cap where the forces of a model are not. Weights are not negative and add up to 1, so the
    # sum is under the cap where those of all models are.
    model_settings = settings if settings.constrain else replace(settings, cap_n=NO_CAP_N)
    parts = [(weight, feedforward(model, reference, model_settings)) for weight, model in used]
    samples = np.asarray(sum(weight * part.forces.samples for weight, part in parts), dtype=np.float64)
    largest = max(parts, key=lambda part: part[0])[1]
    losses = [part.loss for _, part in parts if part.loss is not None]
    return replace(
        largest,
        forces=replace(largest.forces, samples=samples),
        error=max(part.error for _, part in parts),
        peaks=require_under_cap(samples, settings.cap_n, reference.sample_rate_hz),
        loss=max(losses, key=lambda loss: loss.error_capped, default=None),
    )


def select_used_models(at: ModelsAtPlace) -> tuple[tuple[float, IdentifiedModel], ...]:
    """Weights above zero and their models, with the band restricted to the band that all these models cover."""
    used = [(weight, model) for weight, model in zip(at.weights, at.models, strict=True) if weight > 0]
    band_hz = max(model.band_hz[0] for _, model in used), min(model.band_hz[1] for _, model in used)
    return tuple((weight, replace(model, band_hz=band_hz)) for weight, model in used)


def inverse_at(at: ModelsAtPlace, weight: float) -> InverseOfLength:
    """Weighted sum of the inverse operators of all models at a place. weight: R = weight I, of |u|², (m/s² per N)²."""
    parts = [(share, inverse_operator(model, weight)) for share, model in select_used_models(at)]

    def of_length(rows: int) -> Invert:
        """Inverse operator for records of `rows` rows."""
        inverses = [(share, inverse(rows)) for share, inverse in parts]
        return lambda reference: np.asarray(
            sum(share * invert(reference) for share, invert in inverses), dtype=np.float64
        )

    return of_length
