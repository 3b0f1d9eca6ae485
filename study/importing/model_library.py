"""Find a mechanical model by name: a shipped model (`models/`) of a device of the shipped maps, or a file next to a
map."""

from importlib.resources import files as resources
from pathlib import Path

from study.errors import WrongUseError
from study.importing.map_format.map_errors import suggest_name


def list_shipped_models() -> tuple[str, ...]:
    """Names of the models that come with hapteq, sorted."""
    entries = resources("study.importing").joinpath("models").iterdir()
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml")))


def model_for(name: str, folder: Path) -> Path:
    """Path of a model: a file in the folder of the map, otherwise a shipped model. Raises WrongUseError where neither
    exists."""
    if (local_path := folder / name).is_file():
        return local_path
    if name in list_shipped_models():
        return Path(str(resources("study.importing").joinpath("models").joinpath(f"{name}.toml")))
    raise WrongUseError(
        "There is no such model",
        f"'{name}' is neither a file in {folder.name} nor a model that comes with hapteq"
        f"{suggest_name(name, list_shipped_models())}; these are {', '.join(list_shipped_models())}.",
        "Correct `model` in the map's [diagnosis], or leave it out: then a linear one is fitted.",
    )
