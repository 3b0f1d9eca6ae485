"""Check files against each other: a model's effects against the axes of the recordings."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording
from study.workflows.files.validate import Validation


def check_together(found: Sequence[Validation]) -> tuple[Validation, ...]:
    """Valid files with problems between them; a model is compared with recordings of as many commands and responses."""
    recordings = [(each.path, read_recording(each.path)) for each in _valid_of_kind(found, "recording, ")]
    if not recordings:
        return tuple(found)
    models = {each.path: read_mechanical_model(each.path) for each in _valid_of_kind(found, "mechanical model ")}
    return tuple(
        replace(each, problems=(*each.problems, *_problems(models[each.path], recordings)))
        if each.path in models
        else each
        for each in found
    )


def _valid_of_kind(found: Sequence[Validation], kind: str) -> Iterator[Validation]:
    return (each for each in found if each.kind.startswith(kind) and not each.problems)


def _problems(model: MechanicalModel, recordings: Sequence[tuple[Path, Recording]]) -> Iterator[str]:
    # Imported here: the catalogue of effects takes longer to load than most files to check.
    from equalizer.effects.placing import PlacingError, place_recorded_effects

    for path, recording in recordings:
        commands, responses = recording.command.channels, recording.response.channels
        if (len(commands), len(responses)) != (model.inputs, model.outputs):
            continue
        try:
            place_recorded_effects(model, recording)
        except PlacingError as error:
            yield f"With {path.name}: {error}"
