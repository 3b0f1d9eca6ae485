"""Reproduction of the paper's figure 5: playback on the simulated device with and without equalization.

One row per combination of driver, place in the workspace, target signal and device: the rows are listed, played one by
one (`reproduce_playback`), and split into those of the figure and those of the table only. Begin at `play_equalized`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from analysis.evaluation.reproduction.equalized_findings import EqualizedRows
from analysis.evaluation.reproduction.played_response import PlayedResponse, normalise_gain
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.periodic_inverse import compute_periodic_command
from equalizer.tracking.workspace.blended_inverse import blend_at
from equalizer.tracking.workspace.modal_interpolation import build_modal_interpolation
from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.workspace_models import WorkspaceModels
from study.devices.opening import FRICTIONLESS
from study.evaluation.reproduction.reproduce_playback import Driver, PlaybackRow, drive_without_equalizer, play_row
from study.evaluation.reproduction.reproduction_plan import EDGE, ReproductionPlan


@dataclass(frozen=True, slots=True)
class PlacedModels:
    """Identified models by place and condition; all include the spring that acts during playback."""

    centre: IdentifiedModel
    """Model at the centre of the workspace."""
    intermediate: tuple[IdentifiedModel, ...]
    """Models identified at `INTERMEDIATE_PLACES`, none of which is the edge."""
    frictionless: IdentifiedModel
    """Model at the centre, of the simulated device without friction."""
    hand: IdentifiedModel
    """Model at the centre, with a simulated hand on the handle."""

    @property
    def workspace(self) -> WorkspaceModels:
        """Models at the centre and at the intermediate places, for interpolation."""
        return WorkspaceModels((self.centre, *self.intermediate))


@dataclass(frozen=True, slots=True, eq=False)
class EqualizedPlayback:
    """Responses measured with and without equalization, for the figure and its table."""

    rows: EqualizedRows
    """Rows of the figure."""
    table_rows: tuple[PlayedResponse, ...]
    """Rows of the table only."""
    remarks: tuple[str, ...]
    """Sentences on places outside the models, modes that do not match, and clipped forces."""


def play_equalized(
    plan: ReproductionPlan, models: PlacedModels, on_progress: Callable[[float], None]
) -> EqualizedPlayback:
    """Play all rows on the simulated device. on_progress: called after each row with the completed fraction, 0 to 1.
    Raises DeviceError and StudyError as `play_row`."""
    blended_models = blend_at(models.workspace, EDGE)
    modal_rows, modal_remarks = _interpolate_modes(models.workspace)
    rows = _list_rows(models, blended_models) | modal_rows
    responses: dict[str, PlayedResponse] = {}
    for number, (key, row) in enumerate(rows.items(), start=1):
        response = play_row(plan, row)
        # Without an equalizer the level is arbitrary: only the shape of the response is compared.
        is_unequalized = row.driver is drive_without_equalizer
        responses[key] = replace(response, response=normalise_gain(response.response)) if is_unequalized else response
        on_progress(number / len(rows))
    return _split_rows(responses, (*blended_models.remarks, *modal_remarks, *_describe_clipping(responses)))


def make_blending_driver(models: ModelsAtPlace) -> Driver:
    """Make the driver that plays the weighted sum of the forces of all models (`ModelsAtPlace.compute_forces`)."""

    def compute_drive_forces(target: Signal) -> FloatArray:
        """Compute the forces (samples, axes), N, for a target signal."""
        return models.compute_forces(lambda model: compute_periodic_command(model, target).samples)

    return compute_drive_forces


def _list_rows(models: PlacedModels, blended_models: ModelsAtPlace) -> dict[str, PlaybackRow]:
    """List the rows to play by key: the fields of `EqualizedRows`, and further rows of the table."""
    centre_driver = make_single_model_driver(models.centre)
    frictionless_driver = make_single_model_driver(models.frictionless)
    return {
        "unequalized": PlaybackRow("Not equalized, centre", drive_without_equalizer),
        "equalized": PlaybackRow("Equalized, centre", centre_driver),
        "edge_unequalized": PlaybackRow("Not equalized, edge", drive_without_equalizer, EDGE),
        "edge": PlaybackRow("Edge, model of the centre", centre_driver, EDGE),
        "edge_blended": PlaybackRow("Edge, models blended (ours)", make_blending_driver(blended_models), EDGE),
        "multisine_unequalized": PlaybackRow(
            "Not equalized, centre, all frequencies", drive_without_equalizer, signal="multisine"
        ),
        "multisine": PlaybackRow("Equalized, centre, all frequencies", centre_driver, signal="multisine"),
        "edge_multisine": PlaybackRow(
            "Edge, models blended (ours), all frequencies",
            make_blending_driver(blended_models),
            EDGE,
            signal="multisine",
        ),
        "frictionless_unequalized": PlaybackRow(
            "Not equalized, centre, without friction", drive_without_equalizer, device=FRICTIONLESS
        ),
        "frictionless_equalized": PlaybackRow(
            "Equalized, centre, without friction", frictionless_driver, device=FRICTIONLESS
        ),
        "frictionless": PlaybackRow(
            "Equalized, centre, all frequencies, without friction",
            frictionless_driver,
            device=FRICTIONLESS,
            signal="multisine",
        ),
    }


def make_single_model_driver(model: IdentifiedModel) -> Driver:
    """Make the driver that plays the forces of a single model, by its periodic inverse."""
    return lambda target: compute_periodic_command(model, target).samples


def _interpolate_modes(workspace: WorkspaceModels) -> tuple[dict[str, PlaybackRow], tuple[str, ...]]:
    """Make the row with modal interpolation and its remarks; no row and a remark where the modes do not match."""
    try:
        edge_models = build_modal_interpolation(workspace).interpolate_at(EDGE)
    except ModesDoNotMatchError as mismatch:
        return {}, (f"No modes were interpolated: {mismatch}.",)
    row = PlaybackRow("Edge, modes interpolated (ours)", make_blending_driver(edge_models), EDGE)
    return {"edge_modal": row}, edge_models.remarks


def _describe_clipping(responses: Mapping[str, PlayedResponse]) -> Sequence[str]:
    """Make a remark for each row whose force was clipped."""
    return [
        f"{row.name} ({row.signal}): a cap cut the force off at {row.clipped_ticks} ticks."
        for row in responses.values()
        if row.clipped_ticks
    ]


def _split_rows(responses: Mapping[str, PlayedResponse], remarks: tuple[str, ...]) -> EqualizedPlayback:
    """Split the responses into rows of the figure and rows of the table only."""
    figure_names = EqualizedRows.__dataclass_fields__
    rows = EqualizedRows(**{name: responses[name] for name in figure_names})
    return EqualizedPlayback(rows, tuple(row for name, row in responses.items() if name not in figure_names), remarks)
