"""Requests of other programs to a running session: one small file per request, in a folder of the session.

The sender writes a file under a temporary name and renames it, so that the session never reads an incomplete request;
the session reads and removes it. The final name is unique and begins with the kind of request, so that a stop is
recognised even if its content cannot be read.
"""

import errno
import itertools
import json
import os
import secrets
import stat
import time
from contextlib import suppress
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, get_args

from study.errors import StudyError
from study.session.watching.requests import NoteAsked, PauseAsked, Request, RequestSource, StopAsked
from study.store.disk.privacy import PRIVATE_FOLDER, write_private
from study.store.disk.real_folder import is_real_folder
from study.store.disk.strict_json import load_json

REQUESTS_NAME = "requests"
"""Name of the folder of requests, inside the session's folder."""
REQUEST_FORMAT = "hapteq-request"
"""Name of the format, written into every request; others are not read."""
REQUEST_VERSION = 1
"""Version of the format; others are not read."""

REQUEST_CLASSES: dict[str, type[Request]] = {"stop": StopAsked, "pause": PauseAsked, "note": NoteAsked}
"""Class of each kind of request, by the beginning of the file's name."""
_STOP_PREFIX = "stop"
"""Beginning of the name of a request to stop: it counts even if its content cannot be read."""
_NOTE_PREFIX = "note-"
"""Beginning of the name of a note: notes that are not logged yet are kept from one sitting to the next."""
_TAKEN_PREFIX = ".taken-"
"""Put before the name of a note that was taken and is not logged yet, so that it survives the end of the program."""
_UNUSABLE_PREFIX = ".unusable-"
"""Put before the name of an invalid request, which is set aside for later inspection, such as a note of another
version."""
_SOURCES = get_args(RequestSource)
"""Origins of requests (`who`) that a reader accepts."""
_MAX_REQUEST_BYTES = 1 << 16
"""Largest number of bytes of a request that are read. Chosen: a note has only a few sentences."""
_MAX_TAKEN_PER_CALL = 50
"""Largest number of files taken in one call while a session runs. Chosen: many requests at once must not block the
session's loop."""
_request_counter = itertools.count()
"""Makes the names of this program's requests unique, and keeps them in order, within one tick of the clock."""


class RequestInbox:
    """Folder of the requests to a session; implements `study.workflows.trial.requests_port.RequestPort`. Any number of
    programs may send, only the session itself takes. session_folder: of the session; `requests` is below it."""

    def __init__(self, session_folder: Path) -> None:
        self._folder = session_folder / REQUESTS_NAME
        self._ignored_names: set[str] = set()
        """Names of files that could not be removed or renamed: they are read once, not twenty times a second."""

    def send(self, request: Request) -> str:
        """Write a request. Returns its name, for `is_unread` and `take_back`. Raises StudyError if it cannot be
        written, or is larger than the session reads."""
        kind = next(
            kind_name for kind_name, request_class in REQUEST_CLASSES.items() if isinstance(request, request_class)
        )
        unique_key = f"{time.time_ns():020d}-{os.getpid():07d}-{next(_request_counter):06d}-{secrets.token_hex(4)}"
        name = f"{kind}-{unique_key}.json"
        document = {"format": REQUEST_FORMAT, "version": REQUEST_VERSION, "request": kind, **asdict(request)}
        content = f"{json.dumps(document)}\n".encode()
        if len(content) > _MAX_REQUEST_BYTES:
            raise StudyError(
                f"This {kind} is too long for a running session",
                f"It has {len(content)} bytes as it is sent, and up to {_MAX_REQUEST_BYTES} are read.",
                "Send it in parts, or when the session has ended.",
                saved="Nothing was sent.",
            )
        temporary_path = self._folder / f".{name}.part"
        try:
            self._make_folder()
            # No fsync: a request concerns only the running session and need not survive a power failure.
            write_private(temporary_path, content)
            temporary_path.replace(self._folder / name)
        except OSError as problem:
            raise StudyError(
                "The session could not be reached",
                f"A {kind} could not be put into {self._folder}: {problem.strerror}.",
                "Use the keys of the participant's screen, or switch the device off.",
            ) from problem
        return name

    def is_unread(self, name: str) -> bool:
        """Whether the request is still in the folder: neither taken nor set aside by the session, nor taken back."""
        return (self._folder / name).exists()

    def take_back(self, name: str) -> bool:
        """Remove a request. Returns False if it was already taken or cannot be removed."""
        try:
            (self._folder / name).unlink()
        except OSError:
            return False
        return True

    def clear(self) -> None:
        """Remove all files but notes, such as old requests to stop or pause, at the start of a sitting. Notes are kept
        for the log, invalid ones for inspection; those that were taken, but not logged because the program ended,
        become unread again. Never raises."""
        with suppress(OSError):
            self._make_folder()
        for name in self._list_names():
            if name.startswith(_TAKEN_PREFIX + _NOTE_PREFIX):
                self._rename(name, name.removeprefix(_TAKEN_PREFIX))
            elif not name.startswith((_NOTE_PREFIX, _UNUSABLE_PREFIX + _NOTE_PREFIX)):
                self._remove(name)

    def forget_logged(self, note: NoteAsked) -> None:
        """Remove the file of this note, which was taken and is in the log now; only the oldest of equal ones. Never
        raises."""
        for name in sorted(self._list_names()):
            if name.startswith(_TAKEN_PREFIX) and _parse_request(_read_content(self._folder / name)) == note:
                self._remove(name)
                return

    def take(self, max_files: int | None = _MAX_TAKEN_PER_CALL) -> tuple[Request, ...]:
        """Take and remove the requests in up to `max_files` files (None: all), stops first, then oldest first; invalid
        ones other than stops are set aside. The file of a note is kept under another name until `forget_logged`. Never
        raises."""
        names = sorted(
            (name for name in self._list_names() if name[0] != "." and name not in self._ignored_names),
            key=_make_sort_key,
        )
        return tuple(request for name in names[:max_files] if (request := self._take_request(name)) is not None)

    def _list_names(self) -> list[str]:
        """List the names of the files in the folder; empty where it is missing, a link, or cannot be read."""
        try:
            # listdir takes half the time of Path.iterdir.
            return os.listdir(self._folder) if is_real_folder(self._folder) else []  # noqa: PTH208
        except OSError:
            return []

    def _make_folder(self) -> None:
        """Create the folder. Raises OSError, also for a symbolic link, which may lead outside the session."""
        self._folder.mkdir(mode=PRIVATE_FOLDER, exist_ok=True)
        if not is_real_folder(self._folder):
            raise NotADirectoryError(errno.ENOTDIR, "it is a link", str(self._folder))

    def _take_request(self, name: str) -> Request | None:
        """Read and remove a request. An invalid stop counts as one of the experimenter; any other invalid request is
        renamed to a hidden name, and None is returned."""
        request = _parse_request(_read_content(self._folder / name))
        if request is None and name.startswith(_STOP_PREFIX):
            request = StopAsked("experimenter")
        match request:
            case None:
                self._rename(name, _UNUSABLE_PREFIX + name)
            case NoteAsked():
                self._rename(name, _TAKEN_PREFIX + name)
            case _:
                self._remove(name)
        return request

    def _remove(self, name: str) -> None:
        """Delete a request; where that fails, ignore it from now on."""
        try:
            (self._folder / name).unlink()
        except OSError:
            self._ignored_names.add(name)

    def _rename(self, name: str, new_name: str) -> None:
        """Rename a file of the folder; where that fails, ignore it from now on."""
        try:
            (self._folder / name).rename(self._folder / new_name)
        except OSError:
            self._ignored_names.add(name)


def _make_sort_key(name: str) -> tuple[bool, str]:
    """Make the sort key of a file name: stops first, then by the time in the name."""
    return not name.startswith(_STOP_PREFIX), name.partition("-")[2]


def _read_content(path: Path) -> bytes:
    """Read the first `_MAX_REQUEST_BYTES` bytes of a regular file; empty for anything else. A link is not followed, and
    a named pipe does not block."""
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except OSError:
        return b""
    try:
        is_regular = stat.S_ISREG(os.fstat(descriptor).st_mode)
        return os.read(descriptor, _MAX_REQUEST_BYTES) if is_regular else b""
    except OSError:
        return b""
    finally:
        os.close(descriptor)


def _parse_request(content: bytes) -> Request | None:
    """Parse the content of a request's file; None where it is no valid request of this version."""
    try:
        document = load_json(content)
    except ValueError:
        return None
    if not isinstance(document, dict) or document.pop("format", None) != REQUEST_FORMAT:
        return None
    request_class = REQUEST_CLASSES.get(str(document.pop("request", None)))
    if (
        document.pop("version", None) != REQUEST_VERSION
        or request_class is None
        or not _has_valid_fields(request_class, document)
    ):
        return None
    return request_class(**document)


def _has_valid_fields(request_class: type[Request], values: dict[str, Any]) -> bool:
    """Whether the values are exactly the fields of this kind, each of its type, with an accepted origin."""
    field_types = {"who": str, "text": str, "adverse": bool}
    field_names = {field.name for field in fields(request_class)}
    return (
        values.keys() == field_names
        and all(isinstance(value, field_types[name]) for name, value in values.items())
        and values["who"] in _SOURCES
    )
