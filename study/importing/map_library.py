"""Find the map for files: by its name or path, in a folder of recordings, or from the headers of the files.

A map in the folder comes first, then shipped maps (`maps/`) that fit file names and arrays, then `map_by_header`.
"""

import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from importlib.resources import files as resources
from pathlib import Path

from study.errors import StudyError, WrongUseError
from study.importing.arrays.read_arrays import read_arrays
from study.importing.expressions.budget import Budget
from study.importing.expressions.expression import find_names
from study.importing.expressions.namespace import make_namespace
from study.importing.header_map import find_header_problems, make_header_map, read_without_map
from study.importing.map_format.import_map import ImportMap
from study.importing.map_format.map_errors import NOTHING_WRITTEN, ImportProblemError, MapNeededError, suggest_name
from study.importing.map_format.map_files import assign_files
from study.importing.map_format.map_toml import KIND, is_map, parse_map
from study.importing.map_skeleton import make_map_skeleton
from study.store.disk.hdf5_file import is_hdf5, read_format
from study.store.disk.text_file import read_toml_text
from study.store.formats.recording_layout import FORMAT

NO_DATA = (".toml", ".md")
"""Endings of files in a folder of recordings that hold no data."""
_NUMBER = re.compile(r"\d+")
"""A number in a file name: files whose names differ only by their numbers are parts of one recording."""
_MAX_SHOWN = 4
"""Most files that a message names."""


@dataclass(frozen=True, slots=True)
class MapFile:
    """A map, its text, and its origin."""

    name: str
    map: ImportMap
    text: str
    """TOML text; empty for a map that was made from headers."""
    path: Path
    """File of the map; the folder of the data for a map that was made from headers."""


@dataclass(frozen=True, slots=True)
class FoundMap:
    """A map, and the files of a folder that make one recording by it."""

    source: MapFile
    files: tuple[Path, ...]

    @property
    def name(self) -> str:
        """Name of the recording: the name of the map, followed by that of the file if each file is a separate
        recording."""
        return f"{self.source.name}_{self.files[0].stem}" if self.source.map.separate else self.source.name


def list_shipped_maps() -> tuple[str, ...]:
    """Names of the maps that come with hapteq, sorted."""
    entries = resources("study.importing").joinpath("maps").iterdir()
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml")))


def read_map(name: str) -> MapFile:
    """A shipped map by its name, or any map by its path. Raises WrongUseError, CannotReadError, UnusableFileError."""
    if name in list_shipped_maps():
        shipped = resources("study.importing").joinpath("maps").joinpath(f"{name}.toml")
        text = shipped.read_text("utf-8")
        return MapFile(name, parse_map(text, Path(f"{name}.toml")), text, Path(str(shipped)))
    path = Path(name)
    if path.suffix != ".toml" and not path.exists():
        raise WrongUseError(
            "There is no such map",
            f"'{name}' is neither a file nor a map that comes with hapteq{suggest_name(name, list_shipped_maps())}; "
            f"these are {', '.join(list_shipped_maps())}.",
            "Give the name of one of them, or the path of a map of yours.",
        )
    text = read_toml_text(path, KIND)
    return MapFile(path.stem, parse_map(text, path), text, path)


def find_map(folder: Path) -> tuple[FoundMap, ...]:
    """Maps for the recordings in a folder: maps in the folder, otherwise shipped maps that fit file names and arrays.
    Raises CannotReadError; UnusableFileError for an invalid map."""
    paths = sorted(path for path in folder.iterdir() if path.is_file())
    own_maps = [path for path in paths if path.suffix == ".toml" and _is_map_file(path)]
    if own_maps:
        candidates = [read_map(str(path)) for path in own_maps]
        return tuple(found_map for source in candidates for found_map in _find_recordings(source, paths))
    shipped = (read_map(name) for name in list_shipped_maps())
    return tuple(found_map for source in shipped for found_map in _find_recordings(source, paths) if _fits(found_map))


def map_of_files(paths: Sequence[Path]) -> MapFile | None:
    """The only shipped map that makes one recording of exactly these files; None if there is none, or several."""
    sources = [
        entry.source
        for name in list_shipped_maps()
        for entry in _find_recordings(read_map(name), paths)
        if set(entry.files) == set(paths) and _fits(entry)
    ]
    return sources[0] if len(sources) == 1 else None


def map_by_header(folder: Path) -> FoundMap:
    """A map from headers, for a folder without a map; the names of its files may differ only by numbers. Raises
    WrongUseError, MapNeededError, CannotReadError, ImportRefusedError."""
    data = sorted(
        (path for path in folder.iterdir() if path.is_file() and path.suffix not in NO_DATA), key=_natural_sort_key
    )
    no_map_text = f"No map is for the files of the folder {folder.name}: there is none in it, and no shipped map fits"
    if not data:
        raise _ask_which_recording(f"{no_map_text}.", "Give the files.")
    if any(is_hdf5(path) and read_format(path) == FORMAT for path in data):
        raise _ask_which_recording(
            f"{no_map_text}; it has hapteq recordings.", "Give these recordings, to hapteq import, look or diagnose."
        )
    if len({_NUMBER.sub("#", path.name) for path in data}) > 1:
        names = ", ".join(path.name for path in data[:_MAX_SHOWN])
        raise _ask_which_recording(
            f"{no_map_text}; nor are they parts of one recording by their names "
            f"({names}{', ...' if data[_MAX_SHOWN:] else ''}).",
            "Give the files that belong together, in their order; or a map with --map.",
        )
    arrays = read_without_map(data[0])
    import_map = make_header_map(arrays)
    if import_map is None:
        raise MapNeededError(
            folder.name, f"{no_map_text}; {'; '.join(find_header_problems(arrays))}", make_map_skeleton(arrays)
        )
    return FoundMap(MapFile(folder.name, import_map, "", folder), tuple(data))


def _ask_which_recording(cause: str, remedy: str) -> WrongUseError:
    """The error that asks which recording is meant."""
    return WrongUseError("Which recording is meant?", cause, remedy, saved=NOTHING_WRITTEN)


def _natural_sort_key(path: Path) -> tuple[tuple[bool, int, str], ...]:
    """Sort key by which rec_2 precedes rec_10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((part.isdigit(), int(part) if part.isdigit() else 0, part) for part in parts)


def _is_map_file(path: Path) -> bool:
    """Whether a TOML file declares that it is a map; False for a damaged file."""
    try:
        return is_map(tomllib.loads(read_toml_text(path, KIND)))
    except (StudyError, ValueError, RecursionError):
        return False


def _find_recordings(source: MapFile, paths: Sequence[Path]) -> Iterator[FoundMap]:
    """Recordings that a map makes of the files. Without `separate`, every pattern of the map must match a file;
    otherwise the recording is incomplete and not given."""
    data = [path for path in paths if path.suffix not in NO_DATA]
    by_pattern = [[path for path in data if fnmatchcase(path.name, pattern)] for pattern in source.map.files]
    fitting = tuple(dict.fromkeys(path for matches in by_pattern for path in matches))
    if source.map.separate:
        yield from (FoundMap(source, (path,)) for path in fitting)
    elif all(by_pattern):
        yield FoundMap(source, fitting)


def _fits(found_map: FoundMap) -> bool:
    """Whether the first part of a recording has all arrays that the map names."""
    import_map = found_map.source.map
    try:
        part = assign_files(import_map, found_map.files)[0]
        definitions = {**import_map.let, **part.part.let}
        budget = Budget()
        namespaces = {
            clock: make_namespace(read_arrays(path, import_map.csv), definitions, part.part.prefix, budget)
            for clock, path in part.by_clock.items()
        }
        first = import_map.clock[0].name
        needs = [(channel.clock or first, channel.value) for channel in import_map.channel]
        needs += [(clock.name, text) for clock in import_map.clock for text in (clock.time, clock.rate) if text]
        return all(
            text in namespaces[clock].arrays or all(namespaces[clock].has_name(name) for name in find_names(text))
            for clock, text in needs
        )
    except (ImportProblemError, StudyError):
        return False
