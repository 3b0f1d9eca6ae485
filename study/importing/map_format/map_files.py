"""Assign the files of an import to the parts of the recording, or to the clocks (loggers) that wrote them.

A recording may be split over files in two ways: one after the other in time (parts), or in parallel, a file for each
logger with its own clock. The import map states file-name patterns for either way.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from study.importing.map_format.import_map import ImportMap, PartMap
from study.importing.map_format.map_errors import ImportProblemError


@dataclass(frozen=True, slots=True)
class PartFiles:
    """A part of the recording and its files: a path for each clock of the map, by the clock's name."""

    part: PartMap
    by_clock: Mapping[str, Path]

    @property
    def file(self) -> Path:
        """File of the first clock."""
        return next(iter(self.by_clock.values()))

    @property
    def label(self) -> str:
        """Label of the part in messages: name of the first clock's file, and the prefix of the part's arrays, if
        any."""
        return self.file.name + (f" {self.part.prefix}*" if self.part.prefix else "")


def assign_files(import_map: ImportMap, files: Sequence[Path]) -> tuple[PartFiles, ...]:
    """Assign the files to the parts, in the order of the recording. Raises ImportProblemError for a superfluous or
    missing file, and for several files where the map makes a recording of each."""
    ordered_paths = _order_files(import_map, files)
    if import_map.separate and len(ordered_paths) > 1:
        names = ", ".join(path.name for path in ordered_paths)
        raise ImportProblemError(f"the map makes one recording of each file; import {names} one by one")
    is_parallel = any(clock.file for clock in import_map.clock)
    parts = (
        (_assign_parallel(import_map, ordered_paths),)
        if is_parallel
        else tuple(_assign_sequential(import_map, ordered_paths))
    )
    used_paths = {path for part in parts for path in part.by_clock.values()}
    if unused_names := [path.name for path in ordered_paths if path not in used_paths]:
        subject, remedy = ("clock", "a [[clock]] with it") if is_parallel else ("part", "a [[part]] for it")
        raise ImportProblemError(
            f"no {subject} of the map takes the file {unused_names[0]}; leave it out, or add {remedy}"
        )
    return parts


def _order_files(import_map: ImportMap, files: Sequence[Path]) -> list[Path]:
    """Order the files by the map's patterns; those of one pattern in the given order. A file that fits several
    patterns counts for the first. Raises ImportProblemError for a file that fits no pattern."""
    ranked_paths = []
    for path in files:
        pattern_indices = [
            pattern_index for pattern_index, pattern in enumerate(import_map.files) if fnmatchcase(path.name, pattern)
        ]
        if not pattern_indices:
            raise ImportProblemError(f"{path.name} is none of the files of this map ({', '.join(import_map.files)})")
        ranked_paths.append((pattern_indices[0], path))
    return [path for _, path in sorted(ranked_paths, key=lambda entry: entry[0])]


def _assign_parallel(import_map: ImportMap, files: Sequence[Path]) -> PartFiles:
    """Make a single part with a file for each clock, recorded in parallel. Raises ImportProblemError where no file
    or several fit the pattern of a clock."""
    by_clock = {}
    for clock in import_map.clock:
        by_clock[clock.name] = _find_single_file(clock.file or "*", files, f"clock '{clock.name}'")
    return PartFiles(PartMap(file=" + ".join(path.name for path in by_clock.values())), by_clock)


def _assign_sequential(import_map: ImportMap, files: Sequence[Path]) -> Iterator[PartFiles]:
    """Make a part for each file that fits a part of the map, in the order of the map; all clocks are in the same file.
    Raises ImportProblemError where no file fits a part."""
    for part in import_map.part or (PartMap(),):
        matching_paths = [path for path in files if fnmatchcase(path.name, part.file)]
        if not matching_paths:
            raise ImportProblemError(f"no file given fits the part '{part.file}'; given are {_list_names(files)}")
        for path in matching_paths:
            yield PartFiles(part, {clock.name: path for clock in import_map.clock})


def _find_single_file(pattern: str, files: Sequence[Path], subject: str) -> Path:
    """Find the single file that fits a pattern. subject: what is in the file, for messages. Raises ImportProblemError
    where no file or several fit."""
    matching_paths = [path for path in files if fnmatchcase(path.name, pattern)]
    if len(matching_paths) != 1:
        raise ImportProblemError(
            f"{subject} is in the file '{pattern}', which fits {len(matching_paths)} of {_list_names(files)}"
        )
    return matching_paths[0]


def _list_names(files: Sequence[Path]) -> str:
    """List the names of the files, for messages."""
    return ", ".join(path.name for path in files)
