"""Records of a withdrawal: first the intent, then a tombstone for each session.

The intent is one file in the data folder. While it exists, erasing is unfinished, and no session of the participant
counts as data, with all that remains of it.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from study.errors import StudyError
from study.store.disk.json_document import read_json, write_json
from study.store.disk.real_folder import is_real_file, is_real_folder, open_folder
from study.store.sessions.archive import FOLDER, SessionFolder, withdrawal_file
from study.store.sessions.session_lock import LOCK_NAME

TOMBSTONE_FORMAT, TOMBSTONE_VERSION = "hapteq-tombstone", 1
WITHDRAWAL_FORMAT, WITHDRAWAL_VERSION = "hapteq-withdrawal", 1


@dataclass(frozen=True, slots=True)
class SessionParticipant:
    """The participant of a session, as its folder names them: nothing measured."""

    protocol: str
    simulated: bool
    number: int | None
    """Place in the balanced order; None if none was taken."""


@dataclass(frozen=True, slots=True)
class WithdrawalIntent:
    """What is about to be erased, determined before any erasing."""

    subject: str
    withdrawn_utc: str
    sessions: Mapping[str, SessionParticipant | None]
    derived: tuple[str, ...]
    """Files and folders beside the sessions, relative to the data folder."""


def write_intent(data: Path, intent: WithdrawalIntent) -> None:
    """Write the intent; on return it is on the disk."""
    path = withdrawal_file(data, intent.subject)
    write_json(path, WITHDRAWAL_FORMAT, WITHDRAWAL_VERSION, asdict(intent), overwrite=True)


def read_intent(data: Path, subject: str) -> WithdrawalIntent | None:
    """The intent; None if there is no usable one: its content is then determined again. Never raises."""
    path = withdrawal_file(data, subject)
    if not is_real_file(path):
        return None
    try:
        left = read_json(path, WITHDRAWAL_FORMAT, WITHDRAWAL_VERSION)
        sessions = {
            str(name): _parse_begun(begun) for name, begun in left["sessions"].items() if _is_of_subject(name, subject)
        }
        derived = tuple(str(name) for name in left["derived"] if _is_plain_name(str(name)))
        return WithdrawalIntent(subject, str(left["withdrawn_utc"]), sessions, derived)
    except (StudyError, AttributeError, KeyError, TypeError):
        return None


def write_tombstone(folder: SessionFolder, withdrawn_utc: str, begun: SessionParticipant | None) -> None:
    """Replace the session's contents. An existing tombstone is kept."""
    if not is_real_file(folder.tombstone):
        left = {"session": folder.name, "withdrawn_utc": withdrawn_utc, "begun": asdict(begun) if begun else None}
        write_json(folder.tombstone, TOMBSTONE_FORMAT, TOMBSTONE_VERSION, left, overwrite=True)


def read_tombstone(folder: SessionFolder) -> dict[str, Any]:
    """The tombstone; empty if there is no readable one. Never raises."""
    try:
        return read_json(folder.tombstone, TOMBSTONE_FORMAT, TOMBSTONE_VERSION)
    except StudyError:
        return {}


def read_begun(folder: SessionFolder) -> SessionParticipant | None:
    """The participant facts in a tombstone."""
    return _parse_begun(read_tombstone(folder).get("begun"))


def list_remaining(folder: SessionFolder) -> tuple[str, ...]:
    """What remains in the folder of a withdrawn session; folders end in a slash. Never raises."""
    try:
        with open_folder(folder.path) as place:
            names = [name for name in place.names() if name not in (folder.tombstone.name, LOCK_NAME)]
    except OSError:
        return ()
    return tuple(f"{name}/" if is_real_folder(folder.path / name) else name for name in names)


def how_to_finish(folder: SessionFolder) -> str:
    """Sentence on what remains of an incomplete withdrawal, and the command that continues it; empty if it is
    complete."""
    left = list_remaining(folder)
    if not left and folder.tombstone.exists() and not folder.withdrawal.exists():
        return ""
    still = f"Still there: {', '.join(left)}. " if left else ""
    return f"{still}Go on with: hapteq withdraw {folder.name} --data {folder.path.parent}"


def _parse_begun(left: Any) -> SessionParticipant | None:
    try:
        return SessionParticipant(**left) if left else None
    except TypeError:
        return None


def _is_of_subject(name: Any, subject: str) -> bool:
    match = FOLDER.fullmatch(str(name))
    return match is not None and match["subject"] == subject


def _is_plain_name(name: str) -> bool:
    path = PurePosixPath(name)
    if not path.parts or path.is_absolute() or ".." in path.parts:
        return False
    return FOLDER.fullmatch(path.parts[0]) is None  # what is in a session goes with it, or is another's
