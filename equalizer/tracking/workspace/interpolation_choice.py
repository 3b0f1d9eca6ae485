"""Choice between blended and modal interpolation by cross-validation at held-out places.

At each held-out place, the response that was identified there is equalized by the interpolation from the other places.
Modal interpolation is chosen if its largest error over the places is smaller than that of blended forces; blended
forces where nothing can be checked.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.periodic_inverse import FORCE_WEIGHT
from equalizer.tracking.feedforward.quality import ResponseQuality, measure_quality
from equalizer.tracking.workspace.blended_inverse import blend_at
from equalizer.tracking.workspace.modal_interpolation import ModalInterpolation, build_modal_interpolation
from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.place_weights import HULL_TOLERANCE_M, compute_place_weights
from equalizer.tracking.workspace.workspace_models import Place, WorkspaceError, WorkspaceModels

Interpolation = Literal["blended forces", "modal"]
LINE_COUNT = 300
"""Number of logarithmically spaced frequencies over the band on which interpolations are compared. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldOutPlace:
    """Reference response of the device at a place that is held out from the interpolation."""

    place_m: Place
    frequency_hz: FloatArray
    """(lines,), within the models' band."""
    response: ComplexArray
    """(lines, p, m), m/s² per N."""


@dataclass(frozen=True, slots=True)
class PlaceCheck:
    """Errors of both interpolations at a held-out place, by the reference response there."""

    place_m: Place
    blended: ResponseQuality
    """Quality of the equalized response with blended forces."""
    modal: ResponseQuality | None
    """Quality with modal interpolation; None where resonances could not be matched between the other places."""
    blended_error: float
    """Error with blended forces: rms over the lines of the largest singular value of T - I, with T from target to
    delivered acceleration; 0.01 = 1 %. Not the largest over the lines, because at a resonance that no method models all
    methods have about the same error."""
    modal_error: float | None
    """The same for modal interpolation; None as `modal`."""


@dataclass(frozen=True, slots=True, eq=False)
class InterpolationChoice:
    """The chosen interpolation between places, used by `find_models_at`, and the checks that decided it. Made by
    `choose_interpolation`."""

    interpolation: Interpolation
    reason: str
    """Reason for the choice, as a clause for the user."""
    checks: tuple[PlaceCheck, ...]
    """One per held-out place; empty where nothing was checked."""
    workspace: WorkspaceModels
    modal: ModalInterpolation | None
    """Interpolation by the modes of all models; None where it is not used."""

    def find_models_at(self, place_m: Place) -> ModelsAtPlace:
        """Find the models and weights for a place (m) by the chosen interpolation. Outside the convex hull of the
        models they are those of the nearest place inside."""
        return self.modal.interpolate_at(place_m) if self.modal else blend_at(self.workspace, place_m)


def make_held_out_place(model: IdentifiedModel, band_hz: tuple[float, float]) -> HeldOutPlace:
    """Take a model's response over a band (Hz) as the reference at its own place. Raises ValueError for a model without
    a place."""
    if model.place_m is None:
        raise ValueError("the model that is held out does not say where it was identified; identify it with its place")
    frequency_hz = np.geomspace(*band_hz, LINE_COUNT)
    return HeldOutPlace(model.place_m, frequency_hz, compute_model_response(model, frequency_hz))


def choose_interpolation(
    workspace: WorkspaceModels, held_out_places: Sequence[HeldOutPlace] = (), weight: float = FORCE_WEIGHT
) -> InterpolationChoice:
    """Choose between modal and blended interpolation: by the responses at `held_out_places`; without any, by leaving
    out in turn each model that lies between the others, which tests a coarser grid than the grid in use. Blended forces
    where nothing can be checked, with a single model, or where modes do not match. weight: of |force|², (m/s² per N)².
    Raises WorkspaceError for a held-out place at which one of the models was identified, because it would test
    nothing."""
    _check_distances(workspace, held_out_places)
    try:
        modal = build_modal_interpolation(workspace) if len(workspace) > 1 else None
    except ModesDoNotMatchError as error:
        return InterpolationChoice("blended forces", f"forces are blended, because {error}", (), workspace, None)
    if modal is None:
        return InterpolationChoice("blended forces", "there is only one model", (), workspace, None)
    checks = tuple(
        [_check_place(workspace, modal, place, weight) for place in held_out_places]
        if held_out_places
        else [_check_place(*fold, weight) for fold in _list_leave_one_out_folds(workspace)]
    )
    return _choose_by_checks(workspace, modal, checks)


def _choose_by_checks(
    workspace: WorkspaceModels, modal: ModalInterpolation, checks: tuple[PlaceCheck, ...]
) -> InterpolationChoice:
    """Choose modal interpolation where its largest error over all checks is smaller than that of blended forces;
    blended forces without checks, or where a check has no modal error."""
    if not checks:
        reason = (
            "forces are blended, because no model lies between the others with which a better method could be tested"
        )
        return InterpolationChoice("blended forces", reason, checks, workspace, None)
    blended_error = max(check.blended_error for check in checks)
    modal_errors = [check.modal_error for check in checks if check.modal_error is not None]
    if len(modal_errors) < len(checks):
        reason = "forces are blended, because resonances could not be matched with a check place left out"
        return InterpolationChoice("blended forces", reason, checks, workspace, None)
    modal_error = max(modal_errors)
    places_text = f"{len(checks)} place{'s' * (len(checks) > 1)} held out"
    error_text = f"error at {places_text}: {100 * modal_error:.1f} % modal, {100 * blended_error:.1f} % blended"
    if modal_error < blended_error:
        return InterpolationChoice("modal", f"resonances are interpolated ({error_text})", checks, workspace, modal)
    return InterpolationChoice("blended forces", f"forces are blended ({error_text})", checks, workspace, None)


def _check_distances(workspace: WorkspaceModels, held_out_places: Sequence[HeldOutPlace]) -> None:
    """Raise WorkspaceError for a held-out place within `HULL_TOLERANCE_M` (m) of a model's place."""
    if workspace.models[0].place_m is None:  # a single model that is used everywhere
        return
    for place in held_out_places:
        distances_m = np.linalg.norm(workspace.places_m - np.array(place.place_m), axis=1)
        if distances_m.min() < HULL_TOLERANCE_M:
            raise WorkspaceError(
                f"the place held out is that of model {int(distances_m.argmin()) + 1}; hold out one between the models"
            )


def _list_leave_one_out_folds(
    workspace: WorkspaceModels,
) -> list[tuple[WorkspaceModels, ModalInterpolation | None, HeldOutPlace]]:
    """List the folds of the cross-validation, one per model inside the convex hull of the others: the others, their
    modal interpolation (None where modes do not match), and the model as reference. Empty for fewer than three
    models."""
    folds: list[tuple[WorkspaceModels, ModalInterpolation | None, HeldOutPlace]] = []
    for index, model in enumerate(workspace.models):
        if len(workspace) < 3:
            break
        other_models = workspace.without_model(index)
        if compute_place_weights(other_models.places_m, workspace.places_m[index]).outside_m > HULL_TOLERANCE_M:
            continue
        try:
            modal: ModalInterpolation | None = build_modal_interpolation(other_models)
        except ModesDoNotMatchError:
            modal = None
        folds.append((other_models, modal, make_held_out_place(model, workspace.band_hz)))
    return folds


def _check_place(
    workspace: WorkspaceModels, modal: ModalInterpolation | None, place: HeldOutPlace, weight: float
) -> PlaceCheck:
    """Compute quality and error of both interpolations at a held-out place; without modal ones where `modal` is
    None."""
    blended_response = _compute_equalized_response(blend_at(workspace, place.place_m), place, weight)
    if modal is None:
        return PlaceCheck(
            place.place_m, measure_quality(blended_response), None, _compute_rms_error(blended_response), None
        )
    modal_response = _compute_equalized_response(modal.interpolate_at(place.place_m), place, weight)
    return PlaceCheck(
        place.place_m,
        measure_quality(blended_response),
        measure_quality(modal_response),
        _compute_rms_error(blended_response),
        _compute_rms_error(modal_response),
    )


def _compute_equalized_response(place_models: ModelsAtPlace, place: HeldOutPlace, weight: float) -> ComplexArray:
    """Compute T (lines, p, p), from target to delivered acceleration: reference response times interpolated inverse."""
    return np.asarray(place.response @ place_models.compute_inverse(place.frequency_hz, weight))


def _compute_rms_error(equalized_response: ComplexArray) -> float:
    """Compute the rms over the lines of the largest singular value of T - I. equalized_response: T, (lines, p, p)."""
    largest_singular_values = np.linalg.norm(
        equalized_response - np.eye(equalized_response.shape[1]), ord=2, axis=(1, 2)
    )
    return float(np.sqrt((largest_singular_values**2).mean()))
