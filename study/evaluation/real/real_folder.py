"""Inventory of a folder of real recordings: sub-folders of recordings with import maps, or headers in place of these.

A map may also state that a recording only tests the diagnosis of another one (`tests`), and that two were made before
and after a change of the device (`pair`); see `[diagnosis]` in docs/importing.md. Begin at `read_real_folder`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.reports.real_report import UnusableInput
from equalizer.plant.mechanical_model import MechanicalModel
from study.errors import StudyError
from study.importing.map_library import FoundMap, find_maps_for_folder, list_data_files, make_map_from_headers
from study.importing.model_library import find_model_path
from study.store.formats.mechanical_model_file import read_mechanical_model


@dataclass(frozen=True, slots=True)
class RealRecording:
    """One recording to diagnose, with the files that its map relates to it."""

    folder: Path
    """Sub-folder in which it lies."""
    found_map: FoundMap
    """Its files, and their import map."""
    tests: tuple[FoundMap, ...] = ()
    """Recordings of the same device that are only predicted."""
    reference: FoundMap | None = None
    """Recording of the same device before something was changed on it."""
    changed: str = ""
    """That change in words; empty without a reference."""

    @property
    def name(self) -> str:
        """Name of the recording, by its map."""
        return self.found_map.name

    def read_model(self) -> MechanicalModel | None:
        """Read the model that the map names; None where it names none and one is to be fitted. Raises StudyError."""
        path = self._find_model_path()
        return None if path is None else read_mechanical_model(path)

    @property
    def parents(self) -> tuple[Path, ...]:
        """Input files of the diagnosis: the recording, its reference, its map, and the model if the map names one that
        exists; those of `tests` are in `tested_on`."""
        reference_files = () if self.reference is None else self.reference.files
        try:
            model_path = self._find_model_path()
        except StudyError:
            model_path = None
        return (
            *self.found_map.files,
            *reference_files,
            *_list_map_files(self.found_map),
            *(() if model_path is None else (model_path,)),
        )

    @property
    def tested_on(self) -> tuple[Path, ...]:
        """Files of the recordings that are only predicted, and their maps."""
        return tuple(path for test in self.tests for path in (*test.files, *_list_map_files(test)))

    def _find_model_path(self) -> Path | None:
        """Find the path of the model that the map names; None where it names none. Raises StudyError for an unknown
        model."""
        model_name = self.found_map.source.map.diagnosis.model
        return find_model_path(model_name, self.folder) if model_name else None


def _list_map_files(found_map: FoundMap) -> tuple[Path, ...]:
    """List the file of a map; empty for a map that was made from headers, which has none."""
    return (found_map.source.path,) if found_map.source.text else ()


@dataclass(frozen=True, slots=True)
class RealFolder:
    """Recordings found in a folder, and the sub-folders that could not be used."""

    recordings: tuple[RealRecording, ...]
    """Recordings to diagnose."""
    troubles: tuple[UnusableInput, ...]
    """Sub-folders, and the folder itself where none of them has recordings, that could not be used, with the reason."""


def read_real_folder(folder: Path, results_folder: Path | None = None) -> RealFolder:
    """Find the recordings of the sub-folders in alphabetical order, or those of the folder itself where no sub-folder
    has any. Left out are names that begin with a dot, and `results_folder`, which may lie in the folder, with the
    folders in which it lies if these hold no files. Raises StudyError where there is no such folder."""
    if not folder.is_dir():
        raise StudyError(
            "There is no such folder",
            f"{folder} is no folder of recordings.",
            "Give a folder whose sub-folders hold recordings, as docs/real.md says.",
            saved="Nothing was written.",
        )
    if folder.name in ("", ".."):  # the folder has no name of its own; a link keeps that under which its results lie
        folder = folder.resolve()
    results_path = None if results_folder is None else results_folder.resolve()
    recordings: list[RealRecording] = []
    troubles: list[UnusableInput] = []
    for subfolder in sorted(folder.iterdir()):
        if subfolder.is_dir() and not subfolder.name.startswith(".") and not _holds_results(subfolder, results_path):
            _add_recordings(subfolder, recordings, troubles)
    # With sub-folders that are none of recordings, such as earlier results, its own recordings count all the same.
    if not recordings and (not troubles or list_data_files(folder)):
        _add_recordings(folder, recordings, troubles)
    return RealFolder(tuple(recordings), tuple(troubles))


def _holds_results(folder: Path, results_path: Path | None) -> bool:
    """Whether a folder is that of the results, or one without files in which that lies."""
    path = folder.resolve()
    return results_path is not None and (
        path == results_path or (path in results_path.parents and not list_data_files(folder))
    )


def _add_recordings(folder: Path, recordings: list[RealRecording], troubles: list[UnusableInput]) -> None:
    """Add the recordings of a folder to the list, or the reason why it cannot be used to `troubles`."""
    try:
        found_maps = find_maps_for_folder(folder) or (make_map_from_headers(folder),)
        recordings += _select_recordings(folder, found_maps)
    except (StudyError, OSError) as problem:
        reason = problem.happened if isinstance(problem, StudyError) else f"{problem.strerror or problem}."
        troubles.append(UnusableInput(folder.name, reason))


def _select_recordings(folder: Path, found_maps: Sequence[FoundMap]) -> list[RealRecording]:
    """Select the recordings of a sub-folder that are to be diagnosed: those that do not only test another one.
    found_maps: all of its recordings with their maps."""
    recordings = []
    for found_map in found_maps:
        if found_map.source.map.diagnosis.tests and any(_is_test_of(found_map, candidate) for candidate in found_maps):
            continue
        tests = tuple(candidate for candidate in found_maps if _is_test_of(candidate, found_map))
        reference, change_text = _find_reference(found_map, found_maps)
        recordings.append(RealRecording(folder, found_map, tests, reference, change_text))
    _require_different_names(recordings)
    return recordings


def _require_different_names(recordings: Sequence[RealRecording]) -> None:
    """Raise StudyError where two recordings of a sub-folder have the same name, under which their results lie."""
    names = [recording.name for recording in recordings]
    if repeated_names := sorted({name for name in names if names.count(name) > 1}):
        raise StudyError(
            "Two recordings have the same name",
            f"Several recordings have the name {', '.join(repeated_names)}: rename their files, or let the map match "
            "only one of them.",
            "Then run the command again.",
        )


def _is_test_of(test: FoundMap, base: FoundMap) -> bool:
    """Whether `test` only tests the diagnosis of `base`: its map states the name of that recording, or of its map. In
    the latter case, if that map makes a recording of each file, the file names must agree up to the first
    underscore."""
    tested_name = test.source.map.diagnosis.tests
    if not tested_name or base.source.map.diagnosis.tests:
        return False
    if tested_name == base.name:
        return True
    has_same_stem = test.files[0].stem.split("_")[0] == base.files[0].stem.split("_")[0]
    return tested_name == base.source.name and (not base.source.map.separate or has_same_stem)


def _find_reference(found_map: FoundMap, found_maps: Sequence[FoundMap]) -> tuple[FoundMap | None, str]:
    """Find the recording before a change of the device, and the change in words, as the map states them; None and an
    empty text where the map states none or that recording is missing. Only the first pair of the map that the
    recording's first file matches counts."""
    for pair in found_map.source.map.diagnosis.pair:
        if found_map.files[0].match(pair.after):
            reference = next(
                (
                    candidate
                    for candidate in found_maps
                    if candidate.source is found_map.source and candidate.files[0].match(pair.before)
                ),
                None,
            )
            return reference, pair.changed if reference is not None else ""
    return None, ""
