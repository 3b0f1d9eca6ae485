"""Validate one file or session folder (`hapteq validate`): determine its kind and list its problems.

The recognisers are tried in turn on the content. A file that none of them recognises, and that may be a recording of
another program, is read as `hapteq import` would read it. Remarks on access rights and on idle commands are added.
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.look.driven_band import find_silent_segments
from study.errors import StudyError
from study.importing.arrays.read_arrays import FOREIGN_ENDINGS, HDF5_ENDINGS, JSON_ENDINGS, TABLE_ENDINGS
from study.regular_file import MAX_DOCUMENT_BYTES
from study.store.disk.file_errors import CannotReadError, UnusableFileError
from study.store.disk.privacy import format_privacy_warning
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import MAX_TOML_BYTES, find_long_key
from study.store.formats.recording_file import read_recording
from study.store.sessions.archive import FOLDER_PATTERN
from study.workflows.files.file_content import FileContent, read_file_content
from study.workflows.files.recognisers import RECOGNISERS, Recogniser, describe_recording
from study.workflows.files.session_recognisers import SESSION_RECOGNISERS
from study.workflows.recording.read_any_recording import HAPTEQ_PREFIX

KNOWN_KINDS = (
    "known are recordings, identified models and calibrations (HDF5), mechanical models, protocols, tables of texts "
    "and import maps (TOML), trajectories, forces, trials and thresholds (CSV), diagnoses and other JSON documents "
    "with format and version, and session folders"
)
"""List of the kinds that `hapteq validate` recognises, for messages."""


@dataclass(frozen=True, slots=True)
class Validation:
    """Result of the validation of a file or session folder."""

    path: Path
    kind: str
    """Kind in words, such as "recording, 105 s at 1000 Hz, 3 commands, 3 responses"."""
    problems: tuple[str, ...]
    """One sentence each; empty = the file is valid."""
    notes: tuple[str, ...] = ()
    """Remarks that are not errors, such as a session folder that other accounts can read."""


def validate_file(path: Path, recognisers: tuple[Recogniser, ...] = SESSION_RECOGNISERS + RECOGNISERS) -> Validation:
    """Validate one file or session folder. Wrong content and a missing file are returned as problems, not raised."""
    validation = _validate(path, recognisers)
    folders = (path, path.absolute().parent) if FOLDER_PATTERN.fullmatch(path.absolute().name) else (path,)
    privacy_warnings = (format_privacy_warning(folder) for folder in folders if _is_folder(folder))
    return replace(
        validation, notes=(*validation.notes, *filter(None, privacy_warnings), *_describe_idle_commands(validation))
    )


def _describe_idle_commands(validation: Validation) -> tuple[str, ...]:
    """Describe, in one remark, the commands of a valid recording in hapteq's format that are zero or missing in every
    sample; empty without such commands and for other files."""
    if validation.problems or not validation.kind.startswith("recording, "):
        return ()
    command = read_recording(validation.path).command
    idle_commands = [
        name
        for name, samples in zip(command.channels, command.samples.T, strict=True)
        if not np.nan_to_num(samples).any()
    ]
    return (f"No command drives {', '.join(idle_commands)}.",) if idle_commands else ()


def _is_folder(path: Path) -> bool:
    """Whether the path is an existing folder."""
    try:
        return path.is_dir()
    except OSError:  # not a possible file name
        return False


def _validate(path: Path, recognisers: tuple[Recogniser, ...]) -> Validation:
    """Validate by the recognisers, then as a foreign recording, or only as such (`_is_foreign`); without remarks on
    access rights and commands."""
    if _is_foreign(path):
        return _validate_foreign(path)
    try:
        content = read_file_content(path)
        for recognise in recognisers:
            kind = recognise(content)
            if kind is not None:
                return Validation(path, kind, ())
    except UnusableFileError as error:
        return Validation(path, error.kind, error.sentences)
    except StudyError as error:
        # A table in another encoding than UTF-8 is no file of hapteq, but an import reads it.
        if isinstance(error.__cause__, UnicodeDecodeError) and path.suffix.lower() in TABLE_ENDINGS:
            return _validate_foreign(path, "unreadable", (error.happened,))
        return Validation(path, "unreadable", (error.happened,))
    except OSError as error:  # such as a folder of another account
        return Validation(path, "unreadable", (CannotReadError(path, error).happened,))
    kind, problem = _describe_unknown(content)
    unknown_validation = Validation(path, kind, (problem[0].upper() + problem[1:] + ".",))
    may_be_foreign = path.is_file() and path.suffix.lower() in (*FOREIGN_ENDINGS, *HDF5_ENDINGS)
    stated_format = content.hdf5_format or content.json_format or ""
    if not may_be_foreign or stated_format.startswith(HAPTEQ_PREFIX):
        return unknown_validation
    foreign_validation = _validate_foreign(path, kind, unknown_validation.problems)
    return unknown_validation if stated_format and foreign_validation.problems else foreign_validation


def _is_foreign(path: Path) -> bool:
    """Whether a file exists whose extension belongs to recordings of other programs, and to no file of hapteq."""
    extension = path.suffix.lower()
    try:
        return extension in FOREIGN_ENDINGS and extension not in (*TABLE_ENDINGS, *JSON_ENDINGS) and path.is_file()
    except OSError:  # not a possible file name
        return False


def _validate_foreign(path: Path, kind: str = "", unknown_problems: tuple[str, ...] = ()) -> Validation:
    """Validate as a recording of another program, read as `hapteq import` would read it. kind, unknown_problems: kind
    and problems to report if the import refuses the file, because it may be a damaged hapteq file."""
    # Imported here: the import takes longer to load than most files take to check.
    from study.workflows.recording.import_recording import read_foreign

    try:
        imported = read_foreign((path,), None)
    except StudyError as refusal:
        problem = f"{refusal.title}: {refusal.happened}"
        return Validation(path, kind or "recording of others", (*unknown_problems, problem))
    description = f"recording of others, {describe_recording(imported.recording)}"
    return Validation(path, description, tuple(find_silent_segments(imported.recording)), imported.notes)


def _describe_unknown(content: FileContent) -> tuple[str, str]:
    """Describe a file that no recogniser accepted: its kind, and the problem as a clause without initial capital and
    full stop."""
    if content.is_folder:
        return "folder", "this folder is not a session: it holds no events.jsonl"
    if content.hdf5_format is not None:
        sentence = f"calls itself '{content.hdf5_format}'" if content.hdf5_format else "has no attribute 'format'"
        return "HDF5 file", f"it {sentence}; known formats are hapteq-recording, hapteq-model and hapteq-calibration"
    if not (content.text or "").strip():
        return "empty file", f"it holds nothing; {KNOWN_KINDS}"
    match content.path.suffix.lower():
        case ".json":
            return "JSON document", _explain_json(content)
        case ".toml":
            return "TOML file", _explain_toml(content)
        case ".csv":
            return "table", f"its header, '{','.join(content.header)}', is not known; {KNOWN_KINDS}"
    return "unknown file", f"the kind of this file is not known; {KNOWN_KINDS}"


def _explain_json(content: FileContent) -> str:
    """Explain, as a clause, why a JSON document is not recognised."""
    try:
        load_json((content.text or "")[: MAX_DOCUMENT_BYTES + 1])
    except ValueError as error:
        return f"this is not JSON: {error}"
    if content.json_format is None:
        return "it states no format; every hapteq document states its format and version"
    return f"its format, '{content.json_format}', is not known here"


def _explain_toml(content: FileContent) -> str:
    """Explain, as a clause, why a TOML file is not recognised."""
    text = content.text or ""
    if len(text) > MAX_TOML_BYTES:
        return f"it has {len(text)} characters; up to {MAX_TOML_BYTES} are read"
    if problem := find_long_key(text):
        return problem
    try:
        tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        return f"this is not TOML: {error}"
    keys = ", ".join(content.toml or ())
    return (
        f"its keys ({keys}) are neither those of a mechanical model ([model] ...) nor of a protocol (kind = ...) nor "
        "of an import map ([[channel]] ...) nor of a table of texts (yes = ...)"
    )
