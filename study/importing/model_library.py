"""Find the file of a mechanical model by name: a file next to an import map, or a model that comes with hapteq
(`study/importing/models`)."""

from importlib.resources import files as resources
from pathlib import Path

from study.errors import WrongUseError
from study.importing.map_format.map_errors import suggest_name


def list_shipped_models() -> tuple[str, ...]:
    """List the names of the models that come with hapteq, sorted; without the ending .toml."""
    entries = resources("study.importing").joinpath("models").iterdir()
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml")))


def find_model_path(name: str, folder: Path) -> Path:
    """Find the path of a model: a file of this name in the folder of the map, otherwise a shipped model. Raises
    WrongUseError where neither exists."""
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
