"""Find the import map for recorded files: by its name or path, in the files' folder, or from the headers of the files.

A map in the folder comes first, then shipped maps (`maps/`) that match file names and arrays
(`find_maps_for_folder`), then a map from headers (`make_map_from_headers`).
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
from study.importing.header_map import describe_header_problems, make_header_map, read_without_map
from study.importing.map_format.import_map import ImportMap
from study.importing.map_format.map_errors import NOTHING_WRITTEN, ImportProblemError, MapNeededError, suggest_name
from study.importing.map_format.map_files import assign_files
from study.importing.map_format.map_toml import KIND, is_map, parse_map
from study.importing.map_skeleton import make_map_skeleton
from study.store.disk.hdf5_file import is_hdf5, read_format
from study.store.disk.text_file import read_toml_text
from study.store.formats.recording_layout import FORMAT

NON_DATA_SUFFIXES = (".toml", ".md")
"""Suffixes of files in a folder of recordings that hold no data."""
_NUMBER = re.compile(r"\d+")
"""A number in a file name: files whose names differ only by their numbers are parts of one recording."""
_MAX_NAMED_FILES = 4
"""Largest number of files that a message names. Chosen: a message remains a few lines long."""


@dataclass(frozen=True, slots=True)
class MapFile:
    """An import map, its name, its text, and its origin."""

    name: str
    map: ImportMap
    text: str
    """TOML text; empty for a map that was made from headers."""
    path: Path
    """File of the map; the folder of the data for a map that was made from headers."""


@dataclass(frozen=True, slots=True)
class FoundMap:
    """A map, and the files that it combines into one recording: in the order of its patterns or, for a map that was
    made from headers, of the numbers in their names."""

    source: MapFile
    files: tuple[Path, ...]

    @property
    def name(self) -> str:
        """Name of the recording: the name of the map, followed by that of the file if each file is a separate
        recording."""
        return f"{self.source.name}_{self.files[0].stem}" if self.source.map.separate else self.source.name


def list_shipped_maps() -> tuple[str, ...]:
    """List the names of the maps that come with hapteq, sorted."""
    entries = resources("study.importing").joinpath("maps").iterdir()
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml")))


def read_map(name: str) -> MapFile:
    """Read a shipped map by its name, or any map by its path. Raises WrongUseError for an unknown name, CannotReadError
    for a file that cannot be read, UnusableFileError for an invalid map."""
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


def list_data_files(folder: Path) -> list[Path]:
    """List the files of a folder that may hold data, sorted by name: not maps, notes, nor hidden ones, which file
    managers write (`.DS_Store`, `._run1.csv`). Raises OSError where the folder cannot be listed."""
    return sorted(
        path
        for path in folder.iterdir()
        if path.is_file() and path.suffix.lower() not in NON_DATA_SUFFIXES and not path.name.startswith(".")
    )


def find_maps_for_folder(folder: Path) -> tuple[FoundMap, ...]:
    """Find the maps for the recordings in a folder: those in the folder or, without any, shipped maps that match file
    names and arrays; empty if none matches. A TOML file that cannot be read counts as no map. Raises UnusableFileError
    for an invalid map, OSError where the folder cannot be listed."""
    paths = list_data_files(folder)
    map_paths = sorted(path for path in folder.glob("*.toml") if path.is_file() and _is_map_file(path))
    if map_paths:
        folder_maps = [read_map(str(path)) for path in map_paths]
        return tuple(found_map for map_file in folder_maps for found_map in _match_recordings(map_file, paths))
    shipped_maps = (read_map(name) for name in list_shipped_maps())
    return tuple(
        found_map
        for map_file in shipped_maps
        for found_map in _match_recordings(map_file, paths)
        if _has_required_arrays(found_map)
    )


def find_map_for_files(paths: Sequence[Path]) -> MapFile | None:
    """Find the only shipped map that combines exactly these files into one recording; None without any, or if there are
    several."""
    fitting_maps = [
        found_map.source
        for name in list_shipped_maps()
        for found_map in _match_recordings(read_map(name), paths)
        if set(found_map.files) == set(paths) and _has_required_arrays(found_map)
    ]
    return fitting_maps[0] if len(fitting_maps) == 1 else None


def make_map_from_headers(folder: Path) -> FoundMap:
    """Make a map from headers, for a folder without a map. Raises WrongUseError for no files, for hapteq recordings, or
    for file names that differ by more than numbers; MapNeededError where the header of the first file does not
    suffice; CannotReadError and ImportRefusedError as `read_without_map`; OSError where the folder cannot be listed."""
    data_paths = sorted(list_data_files(folder), key=_make_natural_sort_key)
    no_map_text = f"No map is for the files of the folder {folder.name}: there is none in it, and no shipped map fits"
    if not data_paths:
        raise _make_ambiguity_error(f"{no_map_text}.", "Give the files.")
    if any(is_hdf5(path) and read_format(path) == FORMAT for path in data_paths):
        raise _make_ambiguity_error(
            f"{no_map_text}; it has hapteq recordings.", "Give these recordings, to hapteq import, look or diagnose."
        )
    if len({_NUMBER.sub("#", path.name) for path in data_paths}) > 1:
        names = ", ".join(path.name for path in data_paths[:_MAX_NAMED_FILES])
        raise _make_ambiguity_error(
            f"{no_map_text}; nor are they parts of one recording by their names "
            f"({names}{', ...' if data_paths[_MAX_NAMED_FILES:] else ''}).",
            "Give the files that belong together, in their order; or a map with --map.",
        )
    arrays = read_without_map(data_paths[0])
    import_map = make_header_map(arrays)
    if import_map is None:
        raise MapNeededError(
            folder.name, f"{no_map_text}; {describe_header_problems(arrays)}", make_map_skeleton(arrays)
        )
    return FoundMap(MapFile(folder.name, import_map, "", folder), tuple(data_paths))


def _make_ambiguity_error(cause: str, remedy: str) -> WrongUseError:
    """Make the error that asks which recording is meant. cause, remedy: sentences."""
    return WrongUseError("Which recording is meant?", cause, remedy, saved=NOTHING_WRITTEN)


def _make_natural_sort_key(path: Path) -> tuple[tuple[bool, int, str], ...]:
    """Make a sort key by which rec_2 precedes rec_10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((part.isdecimal(), int(part) if part.isdecimal() else 0, part) for part in parts)


def _is_map_file(path: Path) -> bool:
    """Whether a TOML file declares that it is a map; False for a file that cannot be read."""
    try:
        return is_map(tomllib.loads(read_toml_text(path, KIND)))
    except (StudyError, ValueError, RecursionError):
        return False


def _match_recordings(map_file: MapFile, paths: Sequence[Path]) -> Iterator[FoundMap]:
    """Match the files to the patterns of a map and yield its recordings: with `separate` one per matching file,
    otherwise one of all matching files, if every pattern matches at least one file."""
    paths_by_pattern = [[path for path in paths if fnmatchcase(path.name, pattern)] for pattern in map_file.map.files]
    matching_paths = tuple(dict.fromkeys(path for pattern_matches in paths_by_pattern for path in pattern_matches))
    if map_file.map.separate:
        yield from (FoundMap(map_file, (path,)) for path in matching_paths)
    elif all(paths_by_pattern):
        yield FoundMap(map_file, matching_paths)


def _has_required_arrays(found_map: FoundMap) -> bool:
    """Whether the files of a recording's first part have all names in the map's expressions of channels and of the time
    or rate of clocks (alignments and computed channels are not checked); False where a file cannot be read."""
    import_map = found_map.source.map
    try:
        part = assign_files(import_map, found_map.files)[0]
        definitions = {**import_map.let, **part.part.let}
        budget = Budget()
        namespaces = {
            clock: make_namespace(read_arrays(path, import_map.csv), definitions, part.part.prefix, budget)
            for clock, path in part.by_clock.items()
        }
        first_clock = import_map.clock[0].name
        required_expressions = [(channel.clock or first_clock, channel.value) for channel in import_map.channel]
        required_expressions += [
            (clock.name, expression)
            for clock in import_map.clock
            for expression in (clock.time, clock.rate)
            if expression
        ]
        return all(
            expression in namespaces[clock].arrays
            or all(namespaces[clock].has_name(name) for name in find_names(expression))
            for clock, expression in required_expressions
        )
    except (ImportProblemError, StudyError):
        return False
