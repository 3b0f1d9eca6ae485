"""The identified models that can be chosen: those that lie with the data. Reads only."""

from pathlib import Path

from equalizer.plant.model_quality import quality_brief
from study.errors import StudyError
from study.store.formats.identified_model_file import is_identified_model, read_identified_model


def model_files(data: Path) -> tuple[str, ...]:
    """In the data folder and beside it, latest first."""
    places = dict.fromkeys((data.absolute(), data.absolute().parent))
    found = [path for place in places for path in _hdf5_files(place)]
    return tuple(str(path) for path in sorted(found, key=_changed, reverse=True) if _is_model(path))


def model_words(path: str) -> str:
    """How good it is, in a few words."""
    try:
        return quality_brief(read_identified_model(Path(path)).quality)
    except StudyError as problem:
        return f"cannot be used: {problem.title}"


def _hdf5_files(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.glob("*.h5") if path.is_file()]
    except OSError:
        return []


def _changed(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _is_model(path: Path) -> bool:
    try:
        return is_identified_model(path)
    except StudyError:  # a recording, or no file of ours
        return False
