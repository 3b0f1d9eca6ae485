"""Search for a participant's data in a data folder, for a withdrawal (`withdraw_participant`).

Proved data, which the withdrawal erases: a folder with the name of a session of the participant, whose log or tombstone
confirms it or that an interrupted withdrawal emptied; an analysis whose tables, statistics, figures or report name the
participant; an unfinished file or folder (of an interrupted write) that belongs to such an analysis or names one of the
participant's sessions. Doubtful data are reported and kept. Symbolic links are never followed; those with the name of
such a session or of an analysis, and those in such a session, are reported.
"""

import csv
import io
import json
import re
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from study.regular_file import MAX_DOCUMENT_BYTES, open_regular, read_regular
from study.store.disk.real_folder import is_real_file, is_real_folder
from study.store.formats.thresholds_file import DETECTION_NAME, THRESHOLDS_NAME
from study.store.sessions.archive import (
    TOMBSTONE_NAME,
    WITHDRAWN_CLAUSE,
    SessionFolder,
    holds_session,
    is_session_name,
)
from study.store.sessions.session_lock import SESSION_LOCK_NAME
from study.store.sessions.withdrawal_files import read_tombstone
from study.store.sessions.written_elsewhere import WRITTEN_ELSEWHERE_NAME
from study.workflows.results.analysis_files import ANALYSIS_NAME, PAGE_NAME, STATISTICS_NAME, list_analysis_outputs

UNFINISHED_PATTERN = re.compile(r"\.(?P<name>.+)\.[0-9a-f]{8}\.part")
"""Name of an unfinished file or folder from an interrupted write."""

MAX_SEARCHED_BYTES = 1 << 24
"""Largest text file (bytes) that is searched for a name (chosen); recordings and bitmaps are not searched."""
SEARCHED_EXTENSIONS = (".json", ".csv", ".html", ".svg", ".toml", ".txt", ".md", ".jsonl", ".part")
"""Extensions of text files that are searched for names of a participant's sessions."""


@dataclass(frozen=True, slots=True)
class Traces:
    """Data of a participant in a data folder: proved, which may be erased, and doubtful."""

    sessions: tuple[str, ...]
    """Names of the session folders proved to be the participant's."""
    derived: tuple[str, ...]
    """Proved analyses and unfinished files, relative to the data folder."""
    doubtful: tuple[str, ...]
    """Sentences on data that may be the participant's and are not erased."""


def find_traces(data: Path, subject: str, proved_names: Collection[str] = ()) -> Traces:
    """Find the data of a participant in `data`, a resolved path, without changing it. proved_names: names of session
    folders that were proved before an interrupted withdrawal erased their logs."""
    sessions, derived, doubtful = list[str](), list[str](), list[str]()
    for path in sorted(data.iterdir()):
        if is_session_name(path.name, subject):
            # A folder that was proved earlier counts only without new content, for which nothing is proved.
            if is_session_of(path, subject) or (path.name in proved_names and _is_emptied_session(path)):
                sessions.append(path.name)
                doubtful += _describe_links(path)
            else:
                doubtful.append(_describe_unproved_session(path, subject))
        elif is_real_folder(path) and UNFINISHED_PATTERN.fullmatch(path.name) is None:
            doubtful += _describe_other_folder(path, subject)
        elif path.is_symlink() and path.name == ANALYSIS_NAME:
            doubtful.append(f"{path.name} is a link; what it leads to was not looked at.")
    for folder in (data, *(entry for entry in sorted(data.iterdir()) if _may_hold_analysis(entry, subject))):
        try:
            proved_paths, doubtful_paths = _find_analysis_traces(folder, subject, is_separate=folder != data)
        except OSError as problem:
            if folder == data:
                raise
            doubtful.append(f"{folder.name} cannot be looked into: {problem.strerror}.")
            continue
        derived += [path.relative_to(data).as_posix() for path in proved_paths]
        doubtful += [f"{path.relative_to(data)} does not say whose numbers it holds." for path in doubtful_paths]
    doubtful += [
        f"{path.name} names {subject}."
        for path in sorted(data.iterdir())
        if is_real_file(path)
        and path.name not in derived
        and _is_unmanaged_file(path, subject)
        and _has_session_name(path, subject)
    ]
    return Traces(tuple(sessions), tuple(dict.fromkeys(derived)), tuple(doubtful))


def is_session_of(path: Path, subject: str) -> bool:
    """Whether a real folder (no symbolic link) contains a session of this subject, by the first line of its log;
    without a readable log, whether its tombstone states the session of the folder's name."""
    if not is_real_folder(path):
        return False
    folder = SessionFolder(path)
    if (identity := _read_opening(folder)) is not None:
        return identity == (path.name, subject)
    return is_real_file(folder.tombstone) and read_tombstone(folder).get("session") == path.name


def _is_emptied_session(path: Path) -> bool:
    """Whether a session folder was emptied by a withdrawal, which erases the log last: it contains only its lock, a
    tombstone, and unfinished files."""
    if not is_real_folder(path):
        return False
    names = {entry.name for entry in path.iterdir() if UNFINISHED_PATTERN.fullmatch(entry.name) is None}
    return names <= {SESSION_LOCK_NAME, TOMBSTONE_NAME}


def is_subject_in_analysis(folder: Path, subject: str) -> bool | None:
    """Whether the analysis in this folder names this subject: in its tables, its statistics, the names of its figures,
    or its report, which also lists the sessions that were left out; None where no table and no statistics, or not the
    report, can be read, and nothing else names the subject."""
    table_results = [_is_subject_in_table(folder / name, subject) for name in (THRESHOLDS_NAME, DETECTION_NAME)]
    table_results.append(_is_subject_in_statistics(folder / STATISTICS_NAME, subject))
    if any(table_results):
        return True
    figure_pattern = re.compile(rf"(staircases|psychometric)-\d+-{re.escape(subject)}\.(svg|png)")
    if any(figure_pattern.fullmatch(path.name) for path in list_analysis_outputs(folder)):
        return True
    return None if all(result is None for result in table_results) else _is_subject_in_report(folder, subject)


def _read_opening(folder: SessionFolder) -> tuple[Any, Any] | None:
    """Read session and subject from the first line of the log, which need not be a valid event; None if it cannot be
    read."""
    if not is_real_file(folder.log):
        return None
    try:
        with open_regular(folder.log) as file:
            first_event = json.loads(file.readline(MAX_DOCUMENT_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    return (first_event.get("session"), first_event.get("subject")) if isinstance(first_event, dict) else None


def _describe_unproved_session(path: Path, subject: str) -> str:
    """Describe a folder or link that is named like a session of the subject, but is not proved to be one."""
    if path.is_symlink():
        return f"{path.name} is a link; neither it nor what it leads to was touched."
    return next(
        _describe_other_folder(path, subject), f"{path.name} holds no log that says it is a session of {subject}."
    )


def _describe_other_folder(path: Path, subject: str) -> Iterator[str]:
    """Describe a folder that contains a log of the subject and is not named like its session, or a diagnosis of the
    subject, and entries in it that are named like sessions of the subject, a sentence each; yields nothing for other
    folders."""
    identity = _read_opening(SessionFolder(path))
    if identity is not None and identity[1] == subject:
        yield f"{path.name} holds a log of {subject} under another name: it was copied or renamed."
    elif _has_session_name(path / "diagnosis.json", subject):
        yield f"{path.name} holds a diagnosis that names {subject}."
    with suppress(OSError):  # a folder that cannot be looked into is reported by the search for analyses
        nested_names = (entry.name for entry in sorted(path.iterdir()) if is_session_name(entry.name, subject))
        yield from (f"{path.name}/{name} is named like a session of {subject}." for name in nested_names)


def _describe_links(session: Path) -> Iterator[str]:
    """Describe the links in a session's folder, such as to recordings that were moved to another disk, a sentence each:
    the links are erased with the session."""
    for path in sorted(session.rglob("*")):
        if path.is_symlink():
            name = path.relative_to(session.parent).as_posix()
            yield f"{name} is a link; what it leads to was not touched: {path.readlink()}."


def _may_hold_analysis(path: Path, subject: str) -> bool:
    """Whether the path is a real folder that is neither that of a session, nor named like one of the subject, nor
    unfinished."""
    is_session = holds_session(path) or is_session_name(path.name, subject)
    return is_real_folder(path) and not is_session and UNFINISHED_PATTERN.fullmatch(path.name) is None


def _find_analysis_traces(folder: Path, subject: str, is_separate: bool) -> tuple[list[Path], list[Path]]:
    """Find proved and doubtful paths among the files of the analysis in `folder` and its unfinished files. is_separate:
    `folder` is not the data folder itself, so that its unfinished files belong to the analysis."""
    analysis_paths = list(list_analysis_outputs(folder))
    is_subject_named = is_subject_in_analysis(folder, subject) if analysis_paths else False
    proved_paths, doubtful_paths = (
        (analysis_paths if is_subject_named else []),
        (analysis_paths if is_subject_named is None and folder.name == ANALYSIS_NAME else []),
    )
    searched_folders = [folder, *([folder / "figures"] if is_real_folder(folder / "figures") else [])]
    for path in (path for searched_folder in searched_folders for path in sorted(searched_folder.iterdir())):
        if UNFINISHED_PATTERN.fullmatch(path.name) is None or path.is_symlink():
            continue
        if (is_subject_named and is_separate) or _has_session_name(path, subject):
            proved_paths.append(path)
        else:
            doubtful_paths.append(path)
    return proved_paths, doubtful_paths


def _is_subject_in_table(table: Path, subject: str) -> bool | None:
    """Whether a row of a table of thresholds is the subject's; None if the table cannot be read."""
    text = _read_text_file(table)
    if text is None:
        return None
    try:
        return any(row.get("subject") == subject for row in csv.DictReader(io.StringIO(text)))
    except csv.Error:
        return None


def _is_subject_in_statistics(path: Path, subject: str) -> bool | None:
    """Whether anova.json names the subject, as a participant or in the seeds of its sessions; None if it cannot be
    read."""
    text = _read_text_file(path)
    try:
        document = json.loads(text) if text is not None else None
    except (ValueError, RecursionError):
        return None
    if not isinstance(document, dict):
        return None
    provenance = document.get("provenance")
    seeds = provenance.get("seeds") if isinstance(provenance, dict) else None
    seeded_subjects = [str(name).rpartition("_")[0] for name in seeds] if isinstance(seeds, dict) else []
    participants = document.get("participants")
    return subject in seeded_subjects or (isinstance(participants, list) and subject in participants)


def _is_subject_in_report(folder: Path, subject: str) -> bool | None:
    """Whether the report of an analysis names a session of the subject, other than as withdrawn; False without a
    report, None where it cannot be read."""
    path = folder / PAGE_NAME
    session_pattern = re.compile(rf"(?<![A-Za-z0-9]){re.escape(subject)}_\d{{3,}}(?!\d| {WITHDRAWN_CLAUSE})")
    text = _read_text_file(path)
    if text is None:
        return None if is_real_file(path) else False
    return session_pattern.search(text) is not None


def _is_unmanaged_file(path: Path, subject: str) -> bool:
    """Whether a file of the data folder is none of these: the record of the subject's withdrawal, the list of analyses
    written elsewhere, an unfinished file."""
    return (
        path.name not in (f"{subject}.withdrawal.json", WRITTEN_ELSEWHERE_NAME)
        and UNFINISHED_PATTERN.fullmatch(path.name) is None
    )


def _has_session_name(path: Path, subject: str) -> bool:
    """Whether the name of a path, its text or, for a folder, the name or text of any file in it contains the name of a
    session of this subject or of the record of a withdrawal."""
    session_pattern = re.compile(rf"(?<![A-Za-z0-9]){re.escape(subject)}(_\d{{3,}}|\.withdrawal\.json)(?!\d)")
    if session_pattern.search(path.name):
        return True
    if is_real_folder(path):
        with suppress(OSError):  # a folder that cannot be looked into is not proved to be the subject's
            return any(_has_session_name(entry, subject) for entry in sorted(path.iterdir()))
        return False
    return path.suffix in SEARCHED_EXTENSIONS and session_pattern.search(_read_text_file(path) or "") is not None


def _read_text_file(path: Path) -> str | None:
    """Read the text of a file, with invalid UTF-8 replaced; None if it is not a regular file, cannot be read, or is
    larger than `MAX_SEARCHED_BYTES`."""
    try:
        return read_regular(path, MAX_SEARCHED_BYTES).decode("utf-8", errors="replace") if is_real_file(path) else None
    except OSError:
        return None
