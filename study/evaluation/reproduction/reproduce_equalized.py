"""Rows of figure 5: which model drives the device at which place."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from analysis.evaluation.reproduction.equalized_findings import EqualizedRows
from analysis.evaluation.reproduction.played_response import PlayedResponse, normalise_gain
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.periodic_inverse import periodic_command
from equalizer.tracking.workspace.blended_inverse import blend_at
from equalizer.tracking.workspace.modal_interpolation import modal_interpolation
from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.workspace_models import WorkspaceModels
from study.devices.opening import FRICTIONLESS
from study.evaluation.reproduction.reproduce_playback import Driver, PlaybackRow, not_equalized, play_row
from study.evaluation.reproduction.reproduction_plan import EDGE, ReproductionPlan


@dataclass(frozen=True, slots=True)
class PlacedModels:
    """Identified models by place; all include the spring that acts during playback."""

    centre: IdentifiedModel
    between: tuple[IdentifiedModel, ...]
    """Identified beside the centre, not at the edge."""
    frictionless: IdentifiedModel
    """Model at the centre, of the device without friction."""
    hand: IdentifiedModel
    """Model at the centre, in a hand."""

    @property
    def workspace(self) -> WorkspaceModels:
        """Models of the centre and of the places beside it, for interpolation."""
        return WorkspaceModels((self.centre, *self.between))


@dataclass(frozen=True, slots=True, eq=False)
class EqualizedPlayback:
    """Responses measured with and without equalization, for the figure and its table."""

    rows: EqualizedRows
    others: tuple[PlayedResponse, ...]
    """Rows of the table only."""
    remarks: tuple[str, ...]


def play_equalized(
    plan: ReproductionPlan, models: PlacedModels, on_share: Callable[[float], None]
) -> EqualizedPlayback:
    """Play all rows. on_share: progress, 0 to 1."""
    blended = blend_at(models.workspace, EDGE)
    interpolated, remarks = _interpolate_modes(models.workspace)
    rows = _rows_to_play(models, blended) | interpolated
    found: dict[str, PlayedResponse] = {}
    for number, (key, row) in enumerate(rows.items(), start=1):
        played = play_row(plan, row)
        # A static gain would correct its level: only the shape of the response is compared.
        unscaled = row.driver is not_equalized
        found[key] = replace(played, response=normalise_gain(played.response)) if unscaled else played
        on_share(number / len(rows))
    return _sort_rows(found, (*blended.remarks, *remarks, *_describe_clipping(found)))


def make_blending_driver(models: ModelsAtPlace) -> Driver:
    """Driver with the weighted sum of the forces that each model computes (`ModelsAtPlace.forces`)."""

    def drive(wanted: Signal) -> FloatArray:
        return models.forces(lambda model: periodic_command(model, wanted).samples)

    return drive


def _rows_to_play(models: PlacedModels, blended: ModelsAtPlace) -> dict[str, PlaybackRow]:
    """What is played for each row, by the row's key: driver, place, signal and device."""
    centre = make_single_model_driver(models.centre)
    frictionless = make_single_model_driver(models.frictionless)
    return {
        "plain": PlaybackRow("Not equalized, centre", not_equalized),
        "equalized": PlaybackRow("Equalized, centre", centre),
        "edge_plain": PlaybackRow("Not equalized, edge", not_equalized, EDGE),
        "edge": PlaybackRow("Edge, model of the centre", centre, EDGE),
        "edge_blended": PlaybackRow("Edge, models blended (ours)", make_blending_driver(blended), EDGE),
        "broad_plain": PlaybackRow("Not equalized, centre, all frequencies", not_equalized, signal="multisine"),
        "broad": PlaybackRow("Equalized, centre, all frequencies", centre, signal="multisine"),
        "edge_broad": PlaybackRow(
            "Edge, models blended (ours), all frequencies", make_blending_driver(blended), EDGE, signal="multisine"
        ),
        "slick_plain": PlaybackRow("Not equalized, centre, without friction", not_equalized, device=FRICTIONLESS),
        "slick": PlaybackRow("Equalized, centre, without friction", frictionless, device=FRICTIONLESS),
        "frictionless": PlaybackRow(
            "Equalized, centre, all frequencies, without friction",
            frictionless,
            device=FRICTIONLESS,
            signal="multisine",
        ),
    }


def make_single_model_driver(model: IdentifiedModel) -> Driver:
    """Driver by the periodic inverse of a single model."""
    return lambda wanted: periodic_command(model, wanted).samples


def _interpolate_modes(workspace: WorkspaceModels) -> tuple[dict[str, PlaybackRow], tuple[str, ...]]:
    """The row with modal interpolation, or a remark where the modes do not match."""
    try:
        at_edge = modal_interpolation(workspace).at(EDGE)
    except ModesDoNotMatchError as mismatch:
        return {}, (f"No modes were interpolated: {mismatch}.",)
    row = PlaybackRow("Edge, modes interpolated (ours)", make_blending_driver(at_edge), EDGE)
    return {"edge_modal": row}, at_edge.remarks


def _describe_clipping(found: Mapping[str, PlayedResponse]) -> Sequence[str]:
    return [
        f"{row.name} ({row.signal}): a cap cut the force off at {row.clipped_ticks} ticks."
        for row in found.values()
        if row.clipped_ticks
    ]


def _sort_rows(found: Mapping[str, PlayedResponse], remarks: tuple[str, ...]) -> EqualizedPlayback:
    named = EqualizedRows.__dataclass_fields__
    rows = EqualizedRows(**{name: found[name] for name in named})
    return EqualizedPlayback(rows, tuple(row for name, row in found.items() if name not in named), remarks)
