"""Check mechanical models against recordings: the effects of a model against the channels of each recording.

An effect may name the axes and channels on which it acts; a recording without these contradicts the model.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording
from study.workflows.files.validate import Validation


def check_model_channels(validations: Sequence[Validation]) -> tuple[Validation, ...]:
    """Check the mechanical models against the recordings: returns the validations, in the same order, with further
    problems of each model whose effects do not fit a recording. Files with problems are not compared, nor is a model
    with a recording of another number of commands or responses."""
    recordings = [
        (validation.path, read_recording(validation.path)) for validation in _select_valid(validations, "recording, ")
    ]
    if not recordings:
        return tuple(validations)
    models = {
        validation.path: read_mechanical_model(validation.path)
        for validation in _select_valid(validations, "mechanical model ")
    }
    return tuple(
        replace(
            validation, problems=(*validation.problems, *_find_channel_problems(models[validation.path], recordings))
        )
        if validation.path in models
        else validation
        for validation in validations
    )


def _select_valid(validations: Sequence[Validation], kind_prefix: str) -> Iterator[Validation]:
    """Select the validations without problems whose kind begins with `kind_prefix`."""
    return (
        validation for validation in validations if validation.kind.startswith(kind_prefix) and not validation.problems
    )


def _find_channel_problems(model: MechanicalModel, recordings: Sequence[tuple[Path, Recording]]) -> Iterator[str]:
    """Find effects that cannot be placed on the axes and channels of a recording; yields a sentence on the first such
    effect of each compared recording."""
    # Imported here: loading the catalogue of effects takes longer than checking most files.
    from equalizer.effects.placing import PlacingError, place_recorded_effects

    for path, recording in recordings:
        command_names, response_names = recording.command.channels, recording.response.channels
        if (len(command_names), len(response_names)) != (model.inputs, model.outputs):
            continue
        try:
            place_recorded_effects(model, recording)
        except PlacingError as error:
            yield f"With {path.name}: {error}"
