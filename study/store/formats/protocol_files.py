"""Read protocols, shipped ones by name and others by path; write and check the locks of protocols.

A lock (`NAME.lock.json`) fixes a protocol before data are collected (preregistration): a protocol that differs from its
lock is refused. Begin with `read_protocol`.
"""

import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Generic, TypeVar

from protocols.definition.problem import Problem
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.loading import Protocol, ProtocolError
from protocols.document.lock import LockError, ProtocolLock, check_lock, lock_from_json, lock_to_json, make_lock
from study.errors import StudyError, WrongUseError
from study.local_clock import convert_to_machine_zone
from study.regular_file import MAX_DOCUMENT_BYTES
from study.session.views.local_time import format_time_in_zone
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.text_file import read_text, read_toml_text, write_text
from study.store.formats.participant_texts import load_in_language

P = TypeVar("P", bound=Protocol, covariant=True)
"""Kind of protocol: study or recording."""


@dataclass(frozen=True, slots=True)
class ProtocolFile(Generic[P]):
    """A protocol, and the file that it was read from."""

    protocol: P
    text: str
    """Text of the file, comments included; where texts of another language had to be filled in, the protocol with these
    texts, without the comments."""
    path: Path | None
    """Path of the file; None for a shipped protocol."""
    lock: ProtocolLock | None
    """Lock with which the protocol agrees; None without a lock."""

    @property
    def locked(self) -> bool:
        """Whether a lock of the protocol is beside its file or in the data folder."""
        return self.lock is not None


class ProtocolRefusedError(StudyError):
    """A protocol file is invalid. `problems`: every problem, with its key."""

    def __init__(self, name: str, error: ProtocolError) -> None:
        super().__init__(
            title=f"{name} is not a usable protocol",
            happened=str(error),
            do_now="Correct the file and run the command again; `hapteq protocol show direction_threshold` (for "
            "a recording: sweep_band) lists every key with what is allowed.",
        )
        self.problems: tuple[Problem, ...] = error.problems


class LockedProtocolChangedError(StudyError):
    """A protocol differs from the version that its lock fixes."""

    def __init__(self, lock_path: Path, error: LockError) -> None:
        super().__init__(
            title="This protocol is locked, and it is not the locked one",
            happened=f"According to {lock_path}, {error}.",
            saved="Nothing was changed, and no session was begun.",
            do_now="Restore the locked version, or save yours under another name and lock that.",
        )


def list_shipped_protocols() -> tuple[str, ...]:
    """List the names of the protocols that are part of hapteq, sorted."""
    return tuple(
        sorted(entry.name.removesuffix(".toml") for entry in files("protocols").iterdir() if _is_toml(entry.name))
    )


def read_protocol(name: Path | str, data: Path | str | None = None) -> ProtocolFile[Protocol]:
    """Read a shipped protocol by its name, or any protocol by its path. data: the data folder, if there is one.

    A lock in `data` or beside the file must agree with the protocol; both are checked, and the first is returned.
    Participants' texts that the file does not state are those of the lock. Raises WrongUseError (no such protocol),
    CannotReadError, ProtocolRefusedError, LockedProtocolChangedError, UnusableFileError (the lock, a table of texts).
    """
    name, data = str(name), None if data is None else Path(data)
    path = None if name in list_shipped_protocols() else _resolve_path(name)
    text = (
        files("protocols").joinpath(f"{name}.toml").read_text("utf-8")
        if path is None
        else read_toml_text(path, "protocol")
    )
    source = f"{name}.toml" if path is None else path.name
    folders = [folder for folder in (data, path.parent if path else None) if folder is not None]
    try:
        protocol, text = load_in_language(text, source, path.parent if path else None, find_locked_words(text, folders))
    except ProtocolError as error:
        raise ProtocolRefusedError(source, error) from error
    locks = [_read_lock(locate_lock(protocol, folder), protocol) for folder in folders]
    return ProtocolFile(protocol, text, path, next((lock for lock in locks if lock is not None), None))


def read_study_protocol(name: Path | str, data: Path | str | None = None) -> ProtocolFile[StudyProtocol]:
    """Read a study protocol. Raises as `read_protocol`, and WrongUseError for a recording protocol."""
    file = read_protocol(name, data)
    if not isinstance(file.protocol, StudyProtocol):
        raise _make_wrong_kind_error(file.protocol, "a participant can take", "hapteq record")
    return ProtocolFile(file.protocol, file.text, file.path, file.lock)


def read_recording_protocol(name: Path | str, data: Path | str | None = None) -> ProtocolFile[RecordingProtocol]:
    """Read a recording protocol. Raises as `read_protocol`, and WrongUseError for a study protocol."""
    file = read_protocol(name, data)
    if not isinstance(file.protocol, RecordingProtocol):
        raise _make_wrong_kind_error(file.protocol, "a device can record", "hapteq study")
    return ProtocolFile(file.protocol, file.text, file.path, file.lock)


def lock_protocol(file: ProtocolFile[Protocol], folder: Path, locked_utc: str, hapteq_version: str) -> Path:
    """Write NAME.lock.json into `folder` (data folder, or folder of the protocol) and return its path. locked_utc: time
    of the locking (ISO 8601).

    Locking the same protocol again changes nothing. Raises LockedProtocolChangedError if another version is locked
    there, CannotReadError or UnusableFileError for an unusable existing lock, CannotWriteError; AlreadyExistsError if
    another program writes a lock at the same time.
    """
    path = locate_lock(file.protocol, folder)
    if _read_lock(path, file.protocol) is None:
        write_text(path, lock_to_json(make_lock(file.protocol, locked_utc, hapteq_version)))
    return path


def locate_lock(protocol: Protocol, folder: Path) -> Path:
    """Return the path of the lock of this protocol in the folder; the file need not exist."""
    return folder / f"{protocol.name}.lock.json"


def find_locked_words(text: str, folders: Sequence[Path]) -> Mapping[str, str]:
    """Find the texts in the first lock in these folders of the protocol with this TOML text; empty without any. Raises
    as `_parse_lock`."""
    try:
        name = tomllib.loads(text).get("name")
    except (ValueError, RecursionError):
        return {}  # the caller refuses it with the cause
    locks = [_parse_lock(folder / f"{name}.lock.json") for folder in folders if name == Path(str(name)).name]
    return next((lock.words for lock in locks if lock is not None and lock.words), {})


def _parse_lock(path: Path) -> ProtocolLock | None:
    """Read the lock at this path; None if there is none. Raises CannotReadError, and UnusableFileError for a malformed
    lock."""
    if not os.path.lexists(path):  # a dangling link is an unreadable lock, not a missing one
        return None
    text = read_text(path, MAX_DOCUMENT_BYTES)
    try:
        return lock_from_json(text)
    except LockError as error:
        raise UnusableFileError(path, "protocol lock", (str(error),)) from error


def _read_lock(path: Path, protocol: Protocol) -> ProtocolLock | None:
    """Read and check the lock at this path; None if there is none. Raises as `_parse_lock`, and
    LockedProtocolChangedError where the protocol differs."""
    lock = _parse_lock(path)
    if lock is None:
        return None
    try:
        check_lock(lock, protocol, format_time_in_zone(lock.locked_utc, convert_to_machine_zone))
    except LockError as error:
        raise LockedProtocolChangedError(path, error) from error
    return lock


def _resolve_path(name: str) -> Path:
    """Interpret the name as a path: it ends in .toml, contains a folder, or exists. Raises WrongUseError for any
    other."""
    path = Path(name)
    if _is_toml(name) or path.parent != Path() or path.exists():
        return path
    suggestions = get_close_matches(name, list_shipped_protocols(), n=1)
    hint = f" Did you mean {suggestions[0]}?" if suggestions else ""
    raise WrongUseError(
        title="There is no such protocol",
        happened=f"'{name}' is neither a file nor a shipped protocol.{hint}",
        do_now=f"Give the path of a .toml file, or one of {', '.join(list_shipped_protocols())}.",
    )


def _is_toml(name: str) -> bool:
    """Whether a file name is that of a TOML file."""
    return name.endswith(".toml")


def _make_wrong_kind_error(protocol: Protocol, purpose: str, command: str) -> WrongUseError:
    """Make the error for a protocol of another kind. purpose: relative clause about the kind that is needed; command:
    command that takes the given protocol."""
    return WrongUseError(
        title="This protocol is of another kind",
        happened=f"'{protocol.name}' is a {protocol.kind} protocol, not one that {purpose}.",
        do_now=f"Use it with `{command}`, or choose another one; `hapteq protocol list` shows the shipped ones.",
    )
