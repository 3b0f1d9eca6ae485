"""Interpolation by blending the forces of several models. Needs no matching of modes: the safe default.

Always better than blending responses and inverting the blend: where a resonance moves, the mean of two responses has
two small resonances, and its inverse two notches.
"""

from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.place_weights import place_weights
from equalizer.tracking.workspace.workspace_models import Place, WorkspaceModels


def blend_at(workspace: WorkspaceModels, place_m: Place) -> ModelsAtPlace:
    """All models with the weights of linear interpolation at a place, none negative. A single model without a place is
    used everywhere, with a remark."""
    if len(workspace) == 1 and workspace.models[0].place_m is None:
        return ModelsAtPlace(
            place_m, workspace.models, (1.0,), ("the only model does not say where it was identified",)
        )
    weights = place_weights(workspace.places_m, place_m)
    remarks = (weights.remark,) if weights.remark else ()
    return ModelsAtPlace(place_m, workspace.models, tuple(float(w) for w in weights.linear), remarks)
