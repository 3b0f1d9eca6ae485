"""`hapteq validate`: what a file is, and everything that is wrong with it, in words."""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.look.driven_band import silent_segments
from study.errors import StudyError
from study.importing.arrays.arrays import FOREIGN, HDF5, RECORDS, TABLES
from study.regular_file import DOCUMENT_BYTES
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.privacy import privacy_warning
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import TOML_BYTES, too_long_key
from study.store.formats.recording_file import read_recording
from study.store.sessions.archive import FOLDER
from study.workflows.files.file_content import FileContent, open_content
from study.workflows.files.recognisers import RECOGNISERS, Recogniser, describe_recording
from study.workflows.files.session_recognisers import SESSION_RECOGNISERS

KNOWN = (
    "known are recordings, identified models and calibrations (HDF5), mechanical models, protocols and import maps "
    "(TOML), trajectories, forces, trials and thresholds (CSV), diagnoses and other JSON documents with format and "
    "version, and session folders"
)
"""What `hapteq validate` recognises, for messages."""


@dataclass(frozen=True, slots=True)
class Validation:
    """Result of the validation of a file or session folder."""

    path: Path
    kind: str
    """In words: "recording, 105 s at 1000 Hz, 3 commands, 3 responses"."""
    problems: tuple[str, ...]
    """One sentence each; empty = the file is valid."""
    notes: tuple[str, ...] = ()
    """Remarks about a valid file, such as a session's folder that others can read."""


def validate_file(path: Path, recognisers: tuple[Recogniser, ...] = SESSION_RECOGNISERS + RECOGNISERS) -> Validation:
    """Validate one file. Never raises for its content or absence."""
    found = _validate(path, recognisers)
    folders = (path, path.absolute().parent) if FOLDER.fullmatch(path.absolute().name) else (path,)
    warnings = (privacy_warning(folder) for folder in folders if _is_folder(folder))
    return replace(found, notes=(*found.notes, *filter(None, warnings), *_notes(found)))


def _notes(found: Validation) -> tuple[str, ...]:
    """Remarks about a valid recording: axes that are not driven."""
    if found.problems or not found.kind.startswith("recording, "):
        return ()
    command = read_recording(found.path).command
    idle = [
        name for name, each in zip(command.channels, command.samples.T, strict=True) if not np.nan_to_num(each).any()
    ]
    return (f"No command drives {', '.join(idle)}.",) if idle else ()


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # not a possible file name
        return False


def _validate(path: Path, recognisers: tuple[Recogniser, ...]) -> Validation:
    if _is_foreign(path):
        return _validate_foreign(path)
    try:
        content = open_content(path)
        for recognise in recognisers:
            kind = recognise(content)
            if kind is not None:
                return Validation(path, kind, ())
    except UnusableFileError as error:
        return Validation(path, error.kind, error.sentences)
    except StudyError as error:
        return Validation(path, "unreadable", (error.happened,))
    kind, problem = _describe_unknown(content)
    unknown = Validation(path, kind, (problem[0].upper() + problem[1:] + ".",))
    foreign = path.is_file() and path.suffix.lower() in (*FOREIGN, *HDF5)
    if not foreign or content.hdf5_format or content.json_format:
        return unknown
    return _validate_foreign(path, kind, unknown.problems)


def _is_foreign(path: Path) -> bool:
    """Whether a file is of a kind in which hapteq stores nothing."""
    kind = path.suffix.lower()
    try:
        return kind in FOREIGN and kind not in (*TABLES, *RECORDS) and path.is_file()
    except OSError:  # not a possible file name
        return False


def _validate_foreign(path: Path, kind: str = "", unknown: tuple[str, ...] = ()) -> Validation:
    """A foreign recording, read as an import would read it. kind, unknown: of a file that may be a damaged one of our
    own, which is reported if it is no recording either."""
    # Imported here: the import takes longer to load than most files take to check.
    from study.workflows.recording.import_recording import read_foreign

    try:
        found = read_foreign((path,), None)
    except StudyError as refused:
        problem = f"{refused.title}: {refused.happened}"
        return Validation(path, kind or "recording of others", (*unknown, problem))
    text = f"recording of others, {describe_recording(found.recording)}"
    return Validation(path, text, tuple(silent_segments(found.recording)), found.notes)


def _describe_unknown(content: FileContent) -> tuple[str, str]:
    """Kind and problem of a file of no known format."""
    if content.is_folder:
        return "folder", "this folder is not a session: it holds no events.jsonl"
    if content.hdf5_format is not None:
        sentence = f"calls itself '{content.hdf5_format}'" if content.hdf5_format else "has no attribute 'format'"
        return "HDF5 file", f"it {sentence}; known formats are hapteq-recording, hapteq-model and hapteq-calibration"
    if not (content.text or "").strip():
        return "empty file", f"it holds nothing; {KNOWN}"
    match content.path.suffix.lower():
        case ".json":
            return "JSON document", _json_problem(content)
        case ".toml":
            return "TOML file", _toml_problem(content)
        case ".csv":
            return "table", f"its header, '{','.join(content.header)}', is not known; {KNOWN}"
    return "unknown file", f"nothing here knows this file; {KNOWN}"


def _json_problem(content: FileContent) -> str:
    try:
        load_json((content.text or "")[: DOCUMENT_BYTES + 1])
    except ValueError as error:
        return f"this is not JSON: {error}"
    if content.json_format is None:
        return "it says no format; every hapteq document says its format and version"
    return f"its format, '{content.json_format}', is not known here"


def _toml_problem(content: FileContent) -> str:
    text = content.text or ""
    if len(text) > TOML_BYTES:
        return f"it has {len(text)} characters; up to {TOML_BYTES} are read"
    if problem := too_long_key(text):
        return problem
    try:
        tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        return f"this is not TOML: {error}"
    keys = ", ".join(content.toml or ())
    return (
        f"its keys ({keys}) are neither those of a mechanical model ([model] ...) nor of a protocol (kind = ...) nor "
        "of an import map ([[channel]] ...)"
    )
