"""Import recordings of other programs: read their files and write a recording of hapteq.

An import map states which columns are commands and responses, and their units. It is given, found with the files or
among the shipped maps, or derived from the header of a table; recordings in hapteq's own format need none. The result
states files, map and notes, so that its origin can be traced. `read_foreign` imports in memory, without writing.
"""

import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import accumulate
from pathlib import Path
from typing import Any

from equalizer.signals.joining import join_recordings, list_dropped_signals
from equalizer.signals.recording import Recording, find_parts
from equalizer.signals.recording_checks import find_duplicates
from study.errors import WrongUseError
from study.importing.arrays.read_arrays import Arrays
from study.importing.build_recording import build_recording
from study.importing.header_map import (
    describe_header_choices,
    describe_header_problems,
    make_header_map,
    read_without_map,
)
from study.importing.map_format.import_map import ImportMap
from study.importing.map_format.map_errors import (
    NOTHING_WRITTEN,
    ImportProblemError,
    ImportRefusedError,
    MapNeededError,
)
from study.importing.map_library import (
    MapFile,
    find_map_for_files,
    find_maps_for_folder,
    list_data_files,
    make_map_from_headers,
    read_map,
)
from study.importing.map_skeleton import make_map_skeleton
from study.store.disk.hdf5_file import is_hdf5, read_format
from study.store.disk.provenance import gather_provenance
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.recording_layout import FORMAT
from study.workflows.output_paths import require_new_outputs

ProgressCallback = Callable[[float], None]
"""Called with the share of the work that is done, 0 to 1."""


@dataclass(frozen=True, slots=True)
class ImportPlan:
    """Files to import, the map to use, and the file to write."""

    files: tuple[Path, ...]
    """Files, or a single folder in which data and a map are searched; with `map`, folders may be among the files."""
    map: str | None
    """Name of a shipped map, or path of a map; None to find a map, or to derive one from headers."""
    out: Path
    """Recording to write; must not exist."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedRecording:
    """A recording that was imported and written to `path`."""

    path: Path
    recording: Recording
    map: str
    """Name of the map; "header" if derived from one, "recording" for hapteq's own format."""
    notes: tuple[str, ...]
    """What was assumed, changed or left out, as sentences."""


def require_new_output(out_path: Path) -> None:
    """Raise StudyError if `out_path` exists already, or its folder does not."""
    require_new_outputs(out_path, title="Nothing was imported", kind="recordings")


def import_recording(plan: ImportPlan, on_progress: ProgressCallback = lambda share: None) -> ImportedRecording:
    """Import a recording and write it to `plan.out`, with the files' hashes and the map's name and hash in its
    metadata. on_progress: share done, 0 to 1. Raises StudyError; nothing is written then."""
    require_new_output(plan.out)
    foreign_recording = read_foreign(plan.files, plan.map, on_progress)
    provenance = gather_provenance(parents=foreign_recording.files).as_dict()
    import_metadata: dict[str, Any] = {"map": foreign_recording.map, "notes": list(foreign_recording.notes)}
    if foreign_recording.map_hash:
        import_metadata["map_sha256"] = foreign_recording.map_hash
    meta = {**foreign_recording.recording.meta, "import": import_metadata, "provenance": provenance}
    recording = replace(foreign_recording.recording, meta=meta)
    write_recording(plan.out, recording)
    return ImportedRecording(plan.out, recording, foreign_recording.map, foreign_recording.notes)


@dataclass(frozen=True, slots=True, eq=False)
class ForeignRecording:
    """Recording of other files, imported in memory and not written; fields as in `ImportedRecording`."""

    recording: Recording
    files: tuple[Path, ...]
    """Files that were read, without folders."""
    map: str
    map_hash: str
    """SHA-256 of the map's text; empty without a map."""
    notes: tuple[str, ...]


def read_foreign(
    files: Sequence[Path], map_name: str | None, on_progress: ProgressCallback = lambda share: None
) -> ForeignRecording:
    """Import files into a single recording in memory; nothing is written. map_name: as `ImportPlan.map`. Raises
    StudyError, and MapNeededError where no map is found and headers do not suffice."""
    if not files:
        raise WrongUseError(
            "There is nothing to import",
            "No file was given.",
            "Give files, or a folder of them.",
            saved=NOTHING_WRITTEN,
        )
    map_file = None if map_name is None else read_map(map_name)
    files = files if map_file is None else _expand_folders(files, map_file.map)
    _require_distinct(files)
    if map_file is not None:
        return _import_by_map(map_file, files, on_progress)
    if len(files) == 1 and files[0].is_dir():
        return _import_by_found_map(files[0], on_progress)
    if all(is_hdf5(path) and read_format(path) == FORMAT for path in files):
        return _read_hapteq_recordings(files)
    return _import_by_header(files, on_progress)


def _require_distinct(files: Sequence[Path]) -> None:
    """Raise WrongUseError where a file is given twice: its samples would count twice."""
    seen: set[str] = set()
    for path in files:
        real_path = os.path.realpath(path)  # Path.resolve raises RuntimeError for a link to itself
        if real_path in seen:
            raise WrongUseError(
                "A file is given twice",
                f"{path} is there more than once, and would count as two recordings.",
                "Give each file once.",
                saved=NOTHING_WRITTEN,
            )
        seen.add(real_path)


def _expand_folders(files: Sequence[Path], import_map: ImportMap) -> tuple[Path, ...]:
    """Replace a folder by the data files in it that the map applies to; files and folders without data are kept. Raises
    ImportRefusedError where none is left."""
    data_files: list[Path] = []
    for path in files:
        folder_files = list_data_files(path) if path.is_dir() else []
        matching_files = [
            file for file in folder_files if any(fnmatchcase(file.name, pattern) for pattern in import_map.files)
        ]
        data_files += matching_files if folder_files else [path]
    if not data_files:
        raise ImportRefusedError(
            files[0].name,
            f"none of its files is one of {', '.join(import_map.files)}",
            "Give the files, or another map.",
        )
    return tuple(data_files)


def _import_by_map(map_file: MapFile, files: Sequence[Path], on_progress: ProgressCallback) -> ForeignRecording:
    """Import files by a map."""
    built_recording = build_recording(map_file.map, files, on_progress)
    map_hash = hashlib.sha256(map_file.text.encode()).hexdigest()
    return ForeignRecording(built_recording.recording, tuple(files), map_file.name, map_hash, built_recording.notes)


def _import_by_found_map(folder: Path, on_progress: ProgressCallback) -> ForeignRecording:
    """Import a folder by the only map that fits it; without a fitting map, by the headers of its files. Raises
    WrongUseError where its maps make several recordings, or a link in it leads to another of its files."""
    matching_maps = find_maps_for_folder(folder)
    if len(matching_maps) == 1:
        _require_distinct(matching_maps[0].files)
        return _import_by_map(matching_maps[0].source, matching_maps[0].files, on_progress)
    if not matching_maps:
        header_map = make_map_from_headers(folder)
        _require_distinct(header_map.files)
        arrays = read_without_map(header_map.files[0])
        return _import_by_header_map(header_map.source.map, arrays, header_map.files, on_progress)
    maps_text = "; ".join(
        f"{matching_map.source.name} for {', '.join(path.name for path in matching_map.files)}"
        for matching_map in matching_maps
    )
    raise WrongUseError(
        "Which recording is meant?",
        f"The folder {folder.name} makes {len(matching_maps)} recordings: {maps_text}.",
        "Give the files, and the map with --map.",
        saved=NOTHING_WRITTEN,
    )


def _read_hapteq_recordings(files: Sequence[Path]) -> ForeignRecording:
    """Read recordings in hapteq's own format; several are joined one after another. Raises ImportRefusedError where
    their device, sample rate, hold, channels or units differ."""
    recordings = [read_recording(path) for path in files]
    if len(recordings) == 1:
        return ForeignRecording(recordings[0], tuple(files), "recording", "", ())
    starts = accumulate(map(len, recordings[:-1]), initial=0)
    parts = [part for triple in zip(files, recordings, starts, strict=True) for part in _list_parts(*triple)]
    try:
        joined_recording = join_recordings(recordings, {"parts": parts})
    except ValueError as error:
        raise ImportRefusedError(
            files[0].name, str(error), "Import recordings of one device, rate and hold."
        ) from error
    notes = [f"{len(files)} recordings were put one after another; time stamps were left out."]
    if dropped_signals := list_dropped_signals(recordings):
        notes.append(f"Left out, because not every recording has it: {', '.join(dropped_signals)}.")
    samples = [(recording.command.samples, recording.response.samples) for recording in recordings]
    notes += [f"{duplicate}." for duplicate in find_duplicates(samples, [path.name for path in files])]
    return ForeignRecording(joined_recording, tuple(files), "recording", "", tuple(notes))


def _list_parts(path: Path, recording: Recording, offset: int) -> Iterator[dict[str, Any]]:
    """List the parts of a recording that is put `offset` samples after the beginning of another, for the metadata: its
    own parts or, without any, the whole; each with the metadata of the recording."""
    stated_parts = recording.meta.get("parts")
    facts_by_range = {
        (part.get("start"), part.get("stop")): part
        for part in (stated_parts if isinstance(stated_parts, list | tuple) else ())
        if isinstance(part, dict)
    }
    metadata = {key: value for key, value in recording.meta.items() if key != "parts"}
    for start, stop in find_parts(recording):
        facts = facts_by_range.get((start, stop), {})
        yield {"file": path.name, **metadata, **facts, "start": offset + start, "stop": offset + stop}


def _import_by_header(files: Sequence[Path], on_progress: ProgressCallback) -> ForeignRecording:
    """Import files by the header of the first file, else by the only shipped map that fits them. Raises MapNeededError
    with a draft of a map where neither suffices."""
    arrays = read_without_map(files[0])
    import_map = make_header_map(arrays)
    if import_map is None and (shipped_map := find_map_for_files(files)) is not None:
        foreign_recording = _import_by_map(shipped_map, files, on_progress)
        return replace(
            foreign_recording,
            notes=(f"Imported by our map '{shipped_map.name}', which fits these files.", *foreign_recording.notes),
        )
    if import_map is None:
        raise MapNeededError(files[0].name, describe_header_problems(arrays), make_map_skeleton(arrays))
    return _import_by_header_map(import_map, arrays, files, on_progress)


def _import_by_header_map(
    import_map: ImportMap, arrays: Arrays, files: Sequence[Path], on_progress: ProgressCallback
) -> ForeignRecording:
    """Import files by a map derived from headers. arrays: those of the first file. Raises MapNeededError, with a draft
    of a map, for a problem that only a written map can solve."""
    try:
        built_recording = build_recording(import_map, files, on_progress)
    except ImportRefusedError as refusal:
        if not isinstance(refusal.__cause__, ImportProblemError):
            raise
        raise MapNeededError(files[0].name, refusal.happened, make_map_skeleton(arrays)) from refusal
    notes = (*describe_header_choices(arrays, import_map), *built_recording.notes)
    return ForeignRecording(built_recording.recording, tuple(files), "header", "", notes)
