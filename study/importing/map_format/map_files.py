"""Assigns the files of an import to the parts of the recording, or to the clocks (loggers) that wrote them.

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


def part_files(import_map: ImportMap, files: Sequence[Path]) -> tuple[PartFiles, ...]:
    """Parts in the order of the recording, with their files. Raises ImportProblemError for a superfluous or missing
    file, and for several files where the map makes a recording of each."""
    ordered = _order_files(import_map, files)
    if import_map.separate and len(ordered) > 1:
        names = ", ".join(path.name for path in ordered)
        raise ImportProblemError(f"the map makes one recording of each file; import {names} one by one")
    is_parallel = any(clock.file for clock in import_map.clock)
    parts = (_assign_parallel(import_map, ordered),) if is_parallel else tuple(_assign_sequential(import_map, ordered))
    used = {path for part in parts for path in part.by_clock.values()}
    if unused := [path.name for path in ordered if path not in used]:
        raise ImportProblemError(
            f"no part of the map takes the file {unused[0]}; leave it out, or add a [[part]] for it"
        )
    return parts


def _order_files(import_map: ImportMap, files: Sequence[Path]) -> list[Path]:
    """Files in the order of the map's patterns; those of one pattern in the given order. Raises ImportProblemError for
    a file that fits no pattern."""
    ranked = []
    for path in files:
        fitting = [number for number, pattern in enumerate(import_map.files) if fnmatchcase(path.name, pattern)]
        if not fitting:
            raise ImportProblemError(f"{path.name} is none of the files of this map ({', '.join(import_map.files)})")
        ranked.append((fitting[0], path))
    return [path for _, path in sorted(ranked, key=lambda entry: entry[0])]


def _assign_parallel(import_map: ImportMap, files: Sequence[Path]) -> PartFiles:
    """A single part with a file for each clock, recorded in parallel."""
    by_clock = {}
    for clock in import_map.clock:
        (path,) = _exactly_one(clock.file or "*", files, f"clock '{clock.name}'")
        by_clock[clock.name] = path
    return PartFiles(PartMap(file=" + ".join(path.name for path in by_clock.values())), by_clock)


def _assign_sequential(import_map: ImportMap, files: Sequence[Path]) -> Iterator[PartFiles]:
    """A part for each file, in the order of the map's parts; all clocks are in the same file."""
    for part in import_map.part or (PartMap(),):
        fitting = [path for path in files if fnmatchcase(path.name, part.file)]
        if not fitting:
            raise ImportProblemError(f"no file given fits the part '{part.file}'; given are {_names(files)}")
        for path in fitting:
            yield PartFiles(part, {clock.name: path for clock in import_map.clock})


def _exactly_one(pattern: str, files: Sequence[Path], subject: str) -> list[Path]:
    """List with the single file that fits a pattern. Raises ImportProblemError where none or several fit."""
    fitting = [path for path in files if fnmatchcase(path.name, pattern)]
    if len(fitting) != 1:
        raise ImportProblemError(f"{subject} is in the file '{pattern}', which fits {len(fitting)} of {_names(files)}")
    return fitting


def _names(files: Sequence[Path]) -> str:
    return ", ".join(path.name for path in files)
