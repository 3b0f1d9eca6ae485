"""Read identified models from files and combine them for playback.

Three cases: a single model; models of several places, between which the forces or the models are interpolated
(`equalizer.tracking.workspace`); a narrow and a wide model of the same place (`equalizer.tracking.bands`). Models that
cannot play a table of accelerations are refused.
"""

import hashlib
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.wording import format_sentence, typeset
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_quality import ModelQuality, find_worst_quality
from equalizer.plant.model_response import compute_model_response
from equalizer.tracking.bands.narrow_and_wide_models import TwoModels
from equalizer.tracking.feedforward.trajectory import FORCES, TRAJECTORY
from equalizer.tracking.workspace.feedforward_at_place import select_used_models
from equalizer.tracking.workspace.interpolation_choice import InterpolationChoice, PlaceCheck, choose_interpolation
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.place_weights import compute_place_weights
from equalizer.tracking.workspace.workspace_models import WorkspaceError, WorkspaceModels
from study.errors import StudyError, WrongUseError
from study.store.disk.provenance import compute_sha256
from study.store.formats.identified_model_file import read_identified_model

SAME_PLACE_M = 0.001
"""Largest distance (m) of two places that count as the same: files of the same place may differ by rounding. Chosen."""
GAIN_FREQUENCY_COUNT = 100
"""Number of frequencies in the band, in a geometric series, at which the largest gain is searched. Chosen."""
MAX_PLAUSIBLE_GAIN = 1e6
"""Largest plausible gain (m/s^2 per N): that of a mass of 1 mg, less than any handle has."""
WARNING_DISTANCE_M = 0.005
"""Distance (m) between the place of playback and that of a single model beyond which the user is warned. Chosen."""

Vector = tuple[float, float, float]
"""Components x, y, z; in metres for a place."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaybackModels:
    """Identified models read from files and combined for a place in the workspace."""

    all_models: tuple[IdentifiedModel, ...]
    """The models as read, in the order of the files."""
    at_place: ModelsAtPlace
    """Models and weights at the place of playback; for two bands the narrow model only."""
    two_bands: TwoModels | None
    """The narrow and the wide model of two bands; None otherwise."""
    choice: InterpolationChoice | None
    """How models of several places are interpolated; None for models of a single place."""
    remarks: tuple[str, ...]
    """Sentences for the user, such as a place far from that of the model."""
    held_out_remarks: tuple[str, ...]
    """Sentences on the errors at places that were left out and interpolated from the others (cross-validation)."""
    sha256: str
    """SHA-256 of all files, and of the place where it affects the forces (several places)."""

    @property
    def quality(self) -> ModelQuality | None:
        """Quality of the model with the largest error; None if a model states none."""
        return find_worst_quality(tuple(model.quality for model in self.all_models))

    @property
    def nearest(self) -> IdentifiedModel:
        """The given model nearest to the place; for two bands the narrow one."""
        if self.two_bands is not None:
            return self.two_bands.narrow
        place_m = self.at_place.place_m
        return min(self.all_models, key=lambda model: math.dist(model.place_m or place_m, place_m))

    @property
    def band_hz(self) -> tuple[float, float]:
        """Band (Hz) for which an error is predicted: that common to the models of `at_place` with a weight above 0."""
        return select_used_models(self.at_place)[0][1].band_hz

    @property
    def most_weighted(self) -> IdentifiedModel:
        """The model with the largest weight at the place."""
        return self.at_place.models[int(np.argmax(self.at_place.weights))]


def read_playback_models(paths: tuple[Path, ...], at_m: Vector | None, weight: float) -> PlaybackModels:
    """Read and combine the models of at least one file. at_m: place of playback (m), needed for models of several
    places. weight: of the forces in the cost of the LQR. Raises StudyError for files that are not models, that cannot
    play a table of accelerations, or that do not fit together; WrongUseError for a place that is missing or not
    finite."""
    if at_m is not None and not all(map(math.isfinite, at_m)):
        raise WrongUseError(
            "There is no such place",
            f"--at is {', '.join(f'{coordinate_m:g}' for coordinate_m in at_m)}; a place is three numbers, in metres.",
            "Such as --at 0.02 0 0.",
            saved="Nothing was written.",
        )
    models = tuple(_read_checked_model(path) for path in paths)
    if len(models) == 1:
        return _combine_single_model(paths, models[0], at_m)
    if _are_at_same_place(models):
        return _combine_two_bands(paths, models, at_m)
    try:
        return _combine_places(paths, WorkspaceModels(models), at_m, weight)
    except WorkspaceError as problem:
        numbered_files = ", ".join(f"{number}: {path.name}" for number, path in enumerate(paths, start=1))
        raise _make_unfit_error(
            f"{format_sentence(str(problem))} Models are {numbered_files}.", "Give models that belong together."
        ) from problem


def _combine_single_model(paths: tuple[Path, ...], model: IdentifiedModel, at_m: Vector | None) -> PlaybackModels:
    """Make the playback models of one file. The place of playback defaults to that of the model, then to the origin."""
    models_at_place = ModelsAtPlace(at_m or model.place_m or (0.0, 0.0, 0.0), (model,), (1.0,))
    return PlaybackModels(
        (model,), models_at_place, None, None, _warn_of_distance(paths[0], model, at_m), (), _compute_sha256(paths)
    )


def _combine_two_bands(
    paths: tuple[Path, ...], models: tuple[IdentifiedModel, ...], at_m: Vector | None
) -> PlaybackModels:
    """Combine a narrow and a wide model of the same place; the wide one has the higher upper band edge.
    Raises StudyError for more than two models, different sample rates, or models that do not fit together."""
    if len(models) > 2:
        raise _make_unfit_error(
            f"{len(models)} models are of one place.", "Give one of them, or a narrow and a wide one for bands."
        )
    narrow, wide = sorted(models, key=lambda model: model.band_hz[1])
    if narrow.sample_rate_hz != wide.sample_rate_hz:
        raise _make_unfit_error(
            f"They run at {narrow.sample_rate_hz:g} and {wide.sample_rate_hz:g} Hz.", "Identify both at one rate."
        )
    try:
        two_bands = TwoModels(narrow, wide)
    except ValueError as problem:
        raise _make_unfit_error(
            f"Both models are of one place, but {problem}.",
            "Give one of them, or identify both alike (with or without --with-spring), such as --band 5 35 and "
            "--band 5 400 --order 40.",
        ) from problem
    models_at_place = ModelsAtPlace(at_m or narrow.place_m or (0.0, 0.0, 0.0), (narrow,), (1.0,))
    return PlaybackModels(
        models,
        models_at_place,
        two_bands,
        None,
        _warn_of_distance(paths[0] if models[0] is narrow else paths[1], narrow, at_m),
        (),
        _compute_sha256(paths),
    )


def _combine_places(
    paths: tuple[Path, ...], workspace: WorkspaceModels, at_m: Vector | None, weight: float
) -> PlaybackModels:
    """Combine models of several places: whether forces or models are interpolated is chosen by cross-validation. Raises
    WrongUseError without a place of playback, WorkspaceError for models that do not fit together."""
    if at_m is None:
        places_text = "; ".join(
            f"{path.name} {_format_place_mm(model.place_m)}"
            for path, model in zip(paths, workspace.models, strict=True)
        )
        raise WrongUseError(
            "At which place shall it be played?",
            f"The models are of several places: {places_text}.",
            "Say where with --at X Y Z, in metres.",
            saved="Nothing was written.",
        )
    if len({model.provenance.get("input", "command") for model in workspace.models}) > 1:
        raise WorkspaceError("some models include the spring they were recorded under and some do not")
    choice = choose_interpolation(workspace, weight=weight)
    models_at_place = choice.find_models_at(at_m)
    remarks = [format_sentence(choice.reason)]
    outside_remark = compute_place_weights(workspace.places_m, at_m).remark
    remarks += [
        format_sentence(remark)
        for remark in dict.fromkeys((*models_at_place.remarks, *([outside_remark] if outside_remark else [])))
    ]
    if not choice.checks:
        remarks.append("No place could be held out: what the error is between the models' places is not known.")
    held_out_remarks = tuple(_describe_held_out_error(check) for check in choice.checks)
    return PlaybackModels(
        workspace.models, models_at_place, None, choice, tuple(remarks), held_out_remarks, _compute_sha256(paths, at_m)
    )


def _describe_held_out_error(check: PlaceCheck) -> str:
    """Describe the errors at a place whose model was left out, with interpolated forces and with interpolated modes."""
    modal_error_text = "not possible" if check.modal_error is None else f"{100 * check.modal_error:.1f} %"
    return (
        f"Held out {_format_place_mm(check.place_m)}: error {100 * check.blended_error:.1f} % (rms over lines) with "
        f"blended forces, {modal_error_text} with resonances interpolated."
    )


def _read_checked_model(path: Path) -> IdentifiedModel:
    """Read a model from fx, fy, fz (N) to ax, ay, az (m/s²) and give its channels these names; files may use others
    (`_are_axes_in_order`). Raises StudyError for other channels or units, an unstable model, or a gain above
    `MAX_PLAUSIBLE_GAIN`."""
    model = read_identified_model(path)
    has_axis_order = all(_are_axes_in_order(names) for names in (model.input_channels, model.output_channels))
    if not has_axis_order or (model.input_unit, model.output_unit) != (FORCES.unit, TRAJECTORY.unit):
        raise _make_unfit_error(
            f"{path.name} goes from {', '.join(model.input_channels)} in {model.input_unit} to "
            f"{', '.join(model.output_channels)} in {model.output_unit}; a table needs a model from fx, fy, fz in N to "
            "ax, ay, az in m/s^2, in this order.",
            "Identify one from recordings of all three axes, with channel names that end in x, y and z.",
        )
    if model.spectral_radius >= 1:
        raise _make_unfit_error(
            f"The model in {path.name} is not stable (slowest pole {model.spectral_radius:.5f}).",
            "Identify it again with hapteq identify, which makes stable ones only.",
        )
    if not (peak_gain := compute_peak_gain(model)) <= MAX_PLAUSIBLE_GAIN:
        raise _make_unfit_error(
            f"By {path.name} 1 N accelerates the handle with up to {peak_gain:.2g} m/s^2; models up to "
            f"{MAX_PLAUSIBLE_GAIN:g} m/s^2 are accepted.",
            "Check the units of the recording that it was made from, and identify it again.",
        )
    return replace(model, input_channels=FORCES.header[1:], output_channels=TRAJECTORY.header[1:])


def _are_axes_in_order(names: tuple[str, ...]) -> bool:
    """Whether there are three names that end in x, y, z in this order, or three names none of which ends in x, y or
    z."""
    last_letters = [name[-1:].lower() for name in names]
    return len(names) == 3 and (last_letters == ["x", "y", "z"] or not set(last_letters) & set("xyz"))


def compute_peak_gain(model: IdentifiedModel) -> float:
    """Compute the largest magnitude of the response of any output to any input (m/s² per N), over
    `GAIN_FREQUENCY_COUNT` frequencies of the band; NaN or infinity where the response overflows."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.abs(compute_model_response(model, np.geomspace(*model.band_hz, GAIN_FREQUENCY_COUNT))).max())


def _are_at_same_place(models: tuple[IdentifiedModel, ...]) -> bool:
    """Whether all models are within `SAME_PLACE_M` of the place of the first; also True where no model states its
    place, False where only some do."""
    places = [model.place_m for model in models]
    if all(place is None for place in places):
        return True
    known_places = [place for place in places if place is not None]
    return len(known_places) == len(places) and all(
        math.dist(known_places[0], place) <= SAME_PLACE_M for place in known_places
    )


def _warn_of_distance(path: Path, model: IdentifiedModel, at_m: Vector | None) -> tuple[str, ...]:
    """Warn where the place of playback is further than `WARNING_DISTANCE_M` from that of the model, or the model states
    no place; empty otherwise, and without a place of playback."""
    if at_m is None:
        return ()
    if model.place_m is None:
        return (f"{path.name} does not say where it was identified; it is used as if it were at the place.",)
    distance_m = math.dist(model.place_m, at_m)
    if distance_m <= WARNING_DISTANCE_M:
        return ()
    return (
        f"{path.name} was identified {1e3 * distance_m:.0f} mm from the place: the coupling between axes that remains "
        "after equalization increases with the distance. Models of several places on both sides of it can be "
        "interpolated.",
    )


def _compute_sha256(paths: tuple[Path, ...], at_m: Vector | None = None) -> str:
    """Compute the SHA-256, as hexadecimal text, of the files in any order and of the place of playback. For a single
    file it is the hash of the file alone, so that it can be compared with the output of other programs."""
    digests = [compute_sha256(path) for path in paths]
    if len(digests) == 1:
        return digests[0]
    return hashlib.sha256(" ".join([*sorted(digests), repr(at_m)]).encode()).hexdigest()


def _format_place_mm(place_m: Vector | None) -> str:
    """Format the place in millimetres: "(20, 0, 0) mm"; "(place not known)" for None."""
    return (
        "(place not known)"
        if place_m is None
        else f"({', '.join(typeset(f'{1e3 * coordinate_m:g}') for coordinate_m in place_m)}) mm"
    )


def _make_unfit_error(explanation: str, advice: str) -> StudyError:
    """Make the error for models that cannot be used for the table of accelerations."""
    return StudyError("These models cannot equalize the table", explanation, advice, saved="Nothing was written.")
