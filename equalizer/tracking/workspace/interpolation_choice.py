"""Choice of the interpolation by cross-validation on places that were identified and are left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.periodic_inverse import WEIGHT
from equalizer.tracking.feedforward.quality import Quality, measure_quality
from equalizer.tracking.workspace.blended_inverse import blend_at
from equalizer.tracking.workspace.modal_interpolation import ModalInterpolation, modal_interpolation
from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.place_weights import OUTSIDE_M, place_weights
from equalizer.tracking.workspace.workspace_models import Place, WorkspaceError, WorkspaceModels

Interpolation = Literal["blended forces", "modal"]
LINES = 300
"""Lines on which interpolations are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldOutPlace:
    """The device's response, as well as it is known, at a place without a model."""

    place_m: Place
    frequency_hz: FloatArray
    """(lines,), within the models' band."""
    response: ComplexArray
    """(lines, p, m)"""


@dataclass(frozen=True, slots=True)
class PlaceCheck:
    """Errors of both interpolations at a held-out place, against the response that is known there."""

    place_m: Place
    blended: Quality
    modal: Quality | None
    """None where resonances could not be matched without this place."""
    blended_error: float
    """Root mean square over the lines of the largest singular value of delivered minus wanted; 0.01 = 1 %. Not the
    worst line: where a resonance is missed at all, that is equally bad for everything."""
    modal_error: float | None


@dataclass(frozen=True, slots=True, eq=False)
class InterpolationChoice:
    """The chosen interpolation between places, ready for use by `at`, and the checks that decided it."""

    interpolation: Interpolation
    reason: str
    """A sentence for the user."""
    checks: tuple[PlaceCheck, ...]
    workspace: WorkspaceModels
    modal: ModalInterpolation | None
    """Interpolation by the modes of all models; None where it is not used."""

    def at(self, place_m: Place) -> ModelsAtPlace:
        """Models and weights for a place by the chosen interpolation. A place outside the models' hull gets those of
        the nearest place inside, with a remark."""
        return self.modal.at(place_m) if self.modal else blend_at(self.workspace, place_m)


def held_out_model(model: IdentifiedModel, band_hz: tuple[float, float]) -> HeldOutPlace:
    """A model of a place, taken as the truth there. Raises ValueError without a place."""
    if model.place_m is None:
        raise ValueError("the model that is held out does not say where it was identified; identify it with its place")
    frequency_hz = np.geomspace(*band_hz, LINES)
    return HeldOutPlace(model.place_m, frequency_hz, model_response(model, frequency_hz))


def choose_interpolation(
    workspace: WorkspaceModels, held_out: Sequence[HeldOutPlace] = (), weight: float = WEIGHT
) -> InterpolationChoice:
    """Choose between modal and blended interpolation: by the models of `held_out` places, else by holding out in turn
    each model that lies between the others, which judges a coarser grid than the one that is used. Blended forces where
    nothing can be checked, or modes do not match. Raises WorkspaceError for a held-out place where one of the models
    was identified: it would judge nothing."""
    _check_apart(workspace, held_out)
    try:
        modal = modal_interpolation(workspace) if len(workspace) > 1 else None
    except ModesDoNotMatchError as error:
        return InterpolationChoice("blended forces", f"forces are blended, because {error}", (), workspace, None)
    if modal is None:
        return InterpolationChoice("blended forces", "there is only one model", (), workspace, None)
    checks = tuple(
        [_check_place(workspace, modal, place, weight) for place in held_out]
        if held_out
        else [_check_place(*left, weight) for left in _leave_one_out(workspace)]
    )
    return _choose_by_checks(workspace, modal, checks)


def _choose_by_checks(
    workspace: WorkspaceModels, modal: ModalInterpolation, checks: tuple[PlaceCheck, ...]
) -> InterpolationChoice:
    if not checks:
        reason = "forces are blended, because no model lies between the others to check anything better by"
        return InterpolationChoice("blended forces", reason, checks, workspace, None)
    blended = max(check.blended_error for check in checks)
    modal_errors = [check.modal_error for check in checks if check.modal_error is not None]
    if len(modal_errors) < len(checks):
        reason = "forces are blended, because resonances could not be matched with a check place left out"
        return InterpolationChoice("blended forces", reason, checks, workspace, None)
    worst = max(modal_errors)
    places = f"{len(checks)} place{'s' * (len(checks) > 1)} held out"
    numbers = f"error at {places}: {100 * worst:.1f} % modal, {100 * blended:.1f} % blended"
    if worst < blended:
        return InterpolationChoice("modal", f"resonances are interpolated ({numbers})", checks, workspace, modal)
    return InterpolationChoice("blended forces", f"forces are blended ({numbers})", checks, workspace, None)


def _check_apart(workspace: WorkspaceModels, held_out: Sequence[HeldOutPlace]) -> None:
    for place in held_out:
        apart = np.linalg.norm(workspace.places_m - np.array(place.place_m), axis=1)
        if apart.min() < OUTSIDE_M:
            raise WorkspaceError(
                f"the place held out is that of model {int(apart.argmin()) + 1}; hold out one between the models"
            )


def _leave_one_out(workspace: WorkspaceModels) -> list[tuple[WorkspaceModels, ModalInterpolation | None, HeldOutPlace]]:
    found: list[tuple[WorkspaceModels, ModalInterpolation | None, HeldOutPlace]] = []
    for index, model in enumerate(workspace.models):
        if len(workspace) < 3:
            break
        rest = workspace.without(index)
        if place_weights(rest.places_m, workspace.places_m[index]).outside_m > OUTSIDE_M:
            continue
        try:
            modal: ModalInterpolation | None = modal_interpolation(rest)
        except ModesDoNotMatchError:
            modal = None
        found.append((rest, modal, held_out_model(model, workspace.band_hz)))
    return found


def _check_place(
    workspace: WorkspaceModels, modal: ModalInterpolation | None, place: HeldOutPlace, weight: float
) -> PlaceCheck:
    blended = _compute_equalized_response(blend_at(workspace, place.place_m), place, weight)
    if modal is None:
        return PlaceCheck(place.place_m, measure_quality(blended), None, _rms_error(blended), None)
    moved = _compute_equalized_response(modal.at(place.place_m), place, weight)
    return PlaceCheck(
        place.place_m, measure_quality(blended), measure_quality(moved), _rms_error(blended), _rms_error(moved)
    )


def _compute_equalized_response(at: ModelsAtPlace, place: HeldOutPlace, weight: float) -> ComplexArray:
    return np.asarray(place.response @ at.inverse(place.frequency_hz, weight))


def _rms_error(delivered: ComplexArray) -> float:
    largest = np.linalg.norm(delivered - np.eye(delivered.shape[1]), ord=2, axis=(1, 2))
    return float(np.sqrt((largest**2).mean()))
