"""Import foreign recordings: files of other programs become a recording of hapteq.

An import map states which columns are commands and responses, and their units. It is given, found with the files or
among the shipped maps, or derived from the header of a table; recordings in hapteq's own format need none. The result
records files, map and notes, so that its origin can be traced.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from equalizer.signals.joining import join, signals_left_out
from equalizer.signals.recording import Recording
from study.errors import WrongUseError
from study.importing.arrays.read_arrays import Arrays
from study.importing.build_recording import build_recording
from study.importing.header_map import describe_header_choices, find_header_problems, make_header_map, read_without_map
from study.importing.map_format.import_map import ImportMap
from study.importing.map_format.map_errors import (
    NOTHING_WRITTEN,
    ImportProblemError,
    ImportRefusedError,
    MapNeededError,
)
from study.importing.map_library import (
    NO_DATA,
    MapFile,
    find_map_for_files,
    find_maps_for_folder,
    make_map_from_headers,
    read_map,
)
from study.importing.map_skeleton import make_map_skeleton
from study.store.disk.hdf5_file import is_hdf5, read_format
from study.store.disk.provenance import gather_provenance
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.recording_layout import FORMAT
from study.workflows.output_paths import require_new_outputs

Progress = Callable[[float], None]
"""Called with the share of the work that is done, 0 to 1."""


@dataclass(frozen=True, slots=True)
class ImportPlan:
    """Files to import, the map to use, and the file to write."""

    files: tuple[Path, ...]
    """Files, or a single folder in which data and a map are searched."""
    map: str | None
    """Name of a shipped map, or path of a map; None to find a map, or to derive one from headers."""
    out: Path


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """A recording that was imported and written to `path`."""

    path: Path
    recording: Recording
    map: str
    """Name of the map; "header" if derived from one, "recording" for hapteq's own format."""
    notes: tuple[str, ...]
    """What was assumed, changed or left out, as sentences."""


def check_free(out_path: Path) -> None:
    """Raise StudyError if `out_path` exists already, or its folder does not."""
    require_new_outputs(out_path, title="Nothing was imported", kind="recordings")


def import_recording(plan: ImportPlan, on_progress: Progress = lambda share: None) -> Imported:
    """Import a recording and write it to `plan.out`, with the files' hashes and the map in its metadata. on_progress:
    share done, 0 to 1. Raises StudyError; nothing is written then."""
    check_free(plan.out)
    read = read_foreign(plan.files, plan.map, on_progress)
    provenance = gather_provenance(parents=read.files).as_dict()
    origin: dict[str, Any] = {"map": read.map, "notes": list(read.notes)}
    if read.map_hash:
        origin["map_sha256"] = read.map_hash
    meta = {**read.recording.meta, "import": origin, "provenance": provenance}
    recording = replace(read.recording, meta=meta)
    write_recording(plan.out, recording)
    return Imported(plan.out, recording, read.map, read.notes)


@dataclass(frozen=True, slots=True, eq=False)
class Foreign:
    """An imported recording that is not written yet; see `Imported`."""

    recording: Recording
    files: tuple[Path, ...]
    map: str
    map_hash: str
    """SHA-256 of the map's text; empty without a map."""
    notes: tuple[str, ...]


def read_foreign(files: Sequence[Path], map_name: str | None, on_progress: Progress = lambda share: None) -> Foreign:
    """Import files into a single recording in memory; nothing is written. map_name: as `ImportPlan.map`. Raises
    StudyError, and MapNeededError where no map is found and headers do not suffice."""
    if map_name is not None:
        source = read_map(map_name)
        return _import_by_map(source, _expand_folders(files, source.map), on_progress)
    if len(files) == 1 and files[0].is_dir():
        return _import_by_found_map(files[0], on_progress)
    if all(is_hdf5(path) and read_format(path) == FORMAT for path in files):
        return _read_hapteq_recordings(files)
    return _import_by_header(files, on_progress)


def _expand_folders(files: Sequence[Path], import_map: ImportMap) -> tuple[Path, ...]:
    """The files, with a folder replaced by the files in it that the map applies to, except maps and notes. Raises
    ImportRefusedError where none is left."""
    data_files: list[Path] = []
    for path in files:
        folder_files = sorted(path.iterdir()) if path.is_dir() else ()
        fitting = [
            file for file in folder_files if any(fnmatchcase(file.name, pattern) for pattern in import_map.files)
        ]
        data_files += (
            [file for file in fitting if file.is_file() and file.suffix not in NO_DATA] if folder_files else [path]
        )
    if not data_files:
        raise ImportRefusedError(
            files[0].name,
            f"none of its files is one of {', '.join(import_map.files)}",
            "Give the files, or another map.",
        )
    return tuple(data_files)


def _import_by_map(source: MapFile, files: Sequence[Path], on_progress: Progress) -> Foreign:
    """Import files by a map; its hash becomes part of the result."""
    built = build_recording(source.map, files, on_progress)
    digest = hashlib.sha256(source.text.encode()).hexdigest()
    return Foreign(built.recording, tuple(files), source.name, digest, built.notes)


def _import_by_found_map(folder: Path, on_progress: Progress) -> Foreign:
    """Import a folder: by the only map that fits it, else by the files' headers. Raises WrongUseError where its maps
    make several recordings."""
    matching_maps = find_maps_for_folder(folder)
    if len(matching_maps) == 1:
        return _import_by_map(matching_maps[0].source, matching_maps[0].files, on_progress)
    if not matching_maps:
        by_header = make_map_from_headers(folder)
        arrays = read_without_map(by_header.files[0])
        return _with_header(by_header.source.map, arrays, by_header.files, on_progress)
    listed = "; ".join(
        f"{entry.source.name} for {', '.join(path.name for path in entry.files)}" for entry in matching_maps
    )
    raise WrongUseError(
        "Which recording is meant?",
        f"The folder {folder.name} makes {len(matching_maps)} recordings: {listed}.",
        "Give the files, and the map with --map.",
        saved=NOTHING_WRITTEN,
    )


def _read_hapteq_recordings(files: Sequence[Path]) -> Foreign:
    """Read recordings in hapteq's own format; several are joined one after another. Raises ImportRefusedError where
    their device, sample rate or hold differ."""
    recordings = [read_recording(path) for path in files]
    if len(recordings) == 1:
        return Foreign(recordings[0], tuple(files), "recording", "", ())
    facts = [{"file": path.name, **recording.meta} for path, recording in zip(files, recordings, strict=True)]
    try:
        joined_recording = join(recordings, {"parts": facts})
    except ValueError as error:
        raise ImportRefusedError(
            files[0].name, str(error), "Import recordings of one device, rate and hold."
        ) from error
    notes = [f"{len(files)} recordings were put one after another; time stamps were left out."]
    if missing := signals_left_out(recordings):
        notes.append(f"Left out, because not every recording has it: {', '.join(missing)}.")
    return Foreign(joined_recording, tuple(files), "recording", "", tuple(notes))


def _import_by_header(files: Sequence[Path], on_progress: Progress) -> Foreign:
    """Import files by the header of the first file, else by the only shipped map that fits them. Raises MapNeededError
    with a draft of a map where neither suffices."""
    arrays = read_without_map(files[0])
    import_map = make_header_map(arrays)
    if import_map is None and (shipped := find_map_for_files(files)) is not None:
        imported = _import_by_map(shipped, files, on_progress)
        return replace(
            imported, notes=(f"Imported by our map '{shipped.name}', which fits these files.", *imported.notes)
        )
    if import_map is None:
        raise MapNeededError(files[0].name, "; ".join(find_header_problems(arrays)), make_map_skeleton(arrays))
    return _with_header(import_map, arrays, files, on_progress)


def _with_header(import_map: ImportMap, arrays: Arrays, files: Sequence[Path], on_progress: Progress) -> Foreign:
    """Import files by a map derived from headers. arrays: those of the first file. Raises MapNeededError, with a draft
    of a map, for a problem that only a written map can solve."""
    try:
        built = build_recording(import_map, files, on_progress)
    except ImportRefusedError as refused:
        if not isinstance(refused.__cause__, ImportProblemError):
            raise
        raise MapNeededError(files[0].name, refused.happened, make_map_skeleton(arrays)) from refused
    notes = (*describe_header_choices(arrays, import_map), *built.notes)
    return Foreign(built.recording, tuple(files), "header", "", notes)
