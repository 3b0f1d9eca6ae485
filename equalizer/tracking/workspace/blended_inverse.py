"""Interpolation between places by the weighted sum of the forces of several models (blending). It needs no matching of
modes and is the default.

Forces are blended, not responses: where the frequency of a resonance changes with the place, the mean of two responses
has two smaller resonances, and its inverse two notches.
"""

from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.place_weights import compute_place_weights
from equalizer.tracking.workspace.workspace_models import Place, WorkspaceModels


def blend_at(workspace: WorkspaceModels, place_m: Place) -> ModelsAtPlace:
    """Weight all models by linear interpolation at a place (m); no weight is negative, their sum is 1. A single model
    without a place is used everywhere, with a remark; a place outside the hull of the models also gets a remark."""
    if len(workspace) == 1 and workspace.models[0].place_m is None:
        return ModelsAtPlace(
            place_m, workspace.models, (1.0,), ("the only model does not say where it was identified",)
        )
    weights = compute_place_weights(workspace.places_m, place_m)
    remarks = (weights.remark,) if weights.remark else ()
    return ModelsAtPlace(place_m, workspace.models, tuple(float(weight) for weight in weights.linear), remarks)
