"""Mechanical models as TOML files."""

from pathlib import Path

from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.plant.mechanical_model_toml import mechanical_model_toml, parse_mechanical_model
from study.store.file_errors import UnusableFileError
from study.store.text_file import read_text, write_text


def read_mechanical_model(path: Path) -> MechanicalModel:
    """Raises CannotReadError, UnusableFileError."""
    try:
        return parse_mechanical_model(read_text(path))
    except MechanicalModelError as error:
        raise UnusableFileError(path, "mechanical model", error.problems) from error


def write_mechanical_model(path: Path, model: MechanicalModel, *, overwrite: bool = False) -> None:
    """Raises AlreadyThereError, CannotWriteError."""
    write_text(path, mechanical_model_toml(model), overwrite=overwrite)
