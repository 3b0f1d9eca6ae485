"""Assign the given files to parts of the recording, or to loggers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from study.importing.map_format.import_map import ImportMap, PartMap
from study.importing.map_format.map_errors import ImportProblemError


@dataclass(frozen=True, slots=True)
class PartFiles:
    """Files of a part of the recording: a path for each clock of the map."""

    part: PartMap
    by_clock: Mapping[str, Path]

    @property
    def file(self) -> Path:
        """File of the first clock."""
        return next(iter(self.by_clock.values()))

    @property
    def label(self) -> str:
        """Name of the first clock's file, and the prefix of the part's arrays where it has one; for messages."""
        return self.file.name + (f" {self.part.prefix}*" if self.part.prefix else "")


def part_files(wanted: ImportMap, files: Sequence[Path]) -> tuple[PartFiles, ...]:
    """Parts in the order of the recording. Raises ImportProblemError for a superfluous or missing file."""
    ordered = _order_files(wanted, files)
    if wanted.separate and len(ordered) > 1:
        names = ", ".join(path.name for path in ordered)
        raise ImportProblemError(f"the map makes one recording of each file; import {names} one by one")
    beside = any(clock.file for clock in wanted.clock)
    parts = (_side_by_side(wanted, ordered),) if beside else tuple(_in_sequence(wanted, ordered))
    used = {path for part in parts for path in part.by_clock.values()}
    if left := [path.name for path in ordered if path not in used]:
        raise ImportProblemError(f"no part of the map takes the file {left[0]}; leave it out, or add a [[part]] for it")
    return parts


def _order_files(wanted: ImportMap, files: Sequence[Path]) -> list[Path]:
    """Files sorted by the map's patterns, then as given."""
    found = []
    for path in files:
        fits = [number for number, pattern in enumerate(wanted.files) if fnmatchcase(path.name, pattern)]
        if not fits:
            raise ImportProblemError(f"{path.name} is none of the files of this map ({', '.join(wanted.files)})")
        found.append((fits[0], path))
    return [path for _, path in sorted(found, key=lambda entry: entry[0])]


def _side_by_side(wanted: ImportMap, files: Sequence[Path]) -> PartFiles:
    by_clock = {}
    for clock in wanted.clock:
        (path,) = _exactly_one(clock.file or "*", files, f"clock '{clock.name}'")
        by_clock[clock.name] = path
    return PartFiles(PartMap(file=" + ".join(path.name for path in by_clock.values())), by_clock)


def _in_sequence(wanted: ImportMap, files: Sequence[Path]) -> Iterator[PartFiles]:
    for part in wanted.part or (PartMap(),):
        fitting = [path for path in files if fnmatchcase(path.name, part.file)]
        if not fitting:
            raise ImportProblemError(f"no file given fits the part '{part.file}'; given are {_names(files)}")
        for path in fitting:
            yield PartFiles(part, {clock.name: path for clock in wanted.clock})


def _exactly_one(pattern: str, files: Sequence[Path], what: str) -> list[Path]:
    fitting = [path for path in files if fnmatchcase(path.name, pattern)]
    if len(fitting) != 1:
        raise ImportProblemError(f"{what} is in the file '{pattern}', which fits {len(fitting)} of {_names(files)}")
    return fitting


def _names(files: Sequence[Path]) -> str:
    return ", ".join(path.name for path in files)
