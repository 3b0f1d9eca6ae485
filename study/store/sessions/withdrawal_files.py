"""Files that document a withdrawal of consent: the intent, written before any erasing, and a tombstone per session.

The intent is a single file in the data folder, `<code>.withdrawal.json`, with all that will be erased, so that an
interrupted withdrawal can be completed. While it exists, no session of the participant may be used as data. A
tombstone, `withdrawn.json`, replaces the contents of a session folder and holds no measured value.
"""

import json
import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from pydantic import TypeAdapter

from study.errors import StudyError
from study.session.facts.fact_types import Count
from study.store.disk.json_document import read_json, write_json
from study.store.disk.real_folder import is_real_file, is_real_folder, open_folder
from study.store.sessions.archive import SessionFolder, holds_session, is_session_name, locate_withdrawal_record
from study.store.sessions.session_lock import SESSION_LOCK_NAME

TOMBSTONE_FORMAT, TOMBSTONE_VERSION = "hapteq-tombstone", 1
"""Name and version of the format of a tombstone."""
WITHDRAWAL_FORMAT, WITHDRAWAL_VERSION = "hapteq-withdrawal", 1
"""Name and version of the format of an intent."""


@dataclass(frozen=True, slots=True)
class SessionParticipant:
    """Participant of a withdrawn session as its tombstone states it: protocol, whether simulated, and place in the
    counterbalanced order."""

    protocol: str
    simulated: bool
    """Whether a simulated participant gave the answers."""
    number: Count | None
    """Place in the counterbalanced order, as a participant number from 0; None if none was assigned."""


_PARTICIPANT_VALIDATOR = TypeAdapter(SessionParticipant)


@dataclass(frozen=True, slots=True)
class WithdrawalIntent:
    """Sessions and files that a withdrawal erases, listed before the first of them is erased."""

    subject: str
    """Participant code."""
    withdrawn_utc: str
    """UTC time of the withdrawal, kept when an interrupted withdrawal is continued."""
    sessions: Mapping[str, SessionParticipant | None]
    """Participant for the tombstone, by the name of the session; None where the log does not state it."""
    derived: tuple[str, ...]
    """Analyses and unfinished files with the participant's data, as paths relative to the data folder."""


def write_intent(data_folder: Path, intent: WithdrawalIntent) -> None:
    """Write the intent, replacing an earlier one, and sync it to the disk. Raises CannotWriteError or NotSyncedError
    where that fails."""
    path = locate_withdrawal_record(data_folder, intent.subject)
    write_json(path, WITHDRAWAL_FORMAT, WITHDRAWAL_VERSION, asdict(intent), overwrite=True)


def read_intent(data_folder: Path, subject: str) -> WithdrawalIntent | None:
    """Read the intent; None if the file is missing or invalid, so that its content must be determined again. Names that
    are not sessions of the participant, and paths that may not be erased, are dropped. Never raises."""
    path = locate_withdrawal_record(data_folder, subject)
    if not is_real_file(path):
        return None
    try:
        document = read_json(path, WITHDRAWAL_FORMAT, WITHDRAWAL_VERSION)
        sessions = {
            str(name): _parse_participant(participant_document)
            for name, participant_document in document["sessions"].items()
            if is_session_name(name, subject)
        }
        derived = tuple(str(name) for name in document["derived"] if _is_erasable_path(data_folder, str(name)))
        return WithdrawalIntent(subject, str(document["withdrawn_utc"]), sessions, derived)
    except (StudyError, AttributeError, KeyError, TypeError):
        return None


def write_tombstone(folder: SessionFolder, withdrawn_utc: str, participant: SessionParticipant | None) -> None:
    """Write the tombstone into the session's folder; an existing one is unchanged. participant: None if it is not
    known. Raises CannotWriteError or NotSyncedError where it cannot be written."""
    if not is_real_file(folder.tombstone):
        document = {
            "session": folder.name,
            "withdrawn_utc": withdrawn_utc,
            "begun": asdict(participant) if participant else None,
        }
        write_json(folder.tombstone, TOMBSTONE_FORMAT, TOMBSTONE_VERSION, document, overwrite=True)


def read_tombstone(folder: SessionFolder) -> dict[str, Any]:
    """Read the content of the tombstone; empty if it is missing or unreadable. Never raises."""
    try:
        return read_json(folder.tombstone, TOMBSTONE_FORMAT, TOMBSTONE_VERSION)
    except StudyError:
        return {}


def read_participant(folder: SessionFolder) -> SessionParticipant | None:
    """Read the participant from the tombstone of a session; None where it states no valid one."""
    return _parse_participant(read_tombstone(folder).get("begun"))


def list_remaining_entries(folder: SessionFolder) -> tuple[str, ...]:
    """List the names in the folder of a withdrawn session, except tombstone and lock; names of folders end in a slash.
    Empty if the folder cannot be read."""
    try:
        with open_folder(folder.path) as opened_folder:
            names = [
                name for name in opened_folder.list_names() if name not in (folder.tombstone.name, SESSION_LOCK_NAME)
            ]
    except OSError:
        return ()
    return tuple(f"{name}/" if is_real_folder(folder.path / name) else name for name in names)


def describe_unfinished_withdrawal(folder: SessionFolder) -> str:
    """Describe an incomplete withdrawal to the user: the files that still exist, and the command that continues it.
    Empty if the withdrawal is complete: tombstone written, all else in the folder and the intent erased."""
    remaining_entries = list_remaining_entries(folder)
    if not remaining_entries and folder.tombstone.exists() and not folder.withdrawal.exists():
        return ""
    remaining_text = f"Still there: {', '.join(remaining_entries)}. " if remaining_entries else ""
    return f"{remaining_text}Continue with: {format_withdraw_command(folder)}"


def format_withdraw_command(folder: SessionFolder) -> str:
    """Format the command that erases the data of the session's participant, or continues to; the path is quoted for a
    POSIX shell where needed."""
    return shlex.join(("hapteq", "withdraw", folder.name, "--data", str(folder.path.parent)))


def _parse_participant(document: Any) -> SessionParticipant | None:
    """Parse a participant from a JSON value; None if it is missing, or has other fields or types."""
    try:
        return _PARTICIPANT_VALIDATOR.validate_json(json.dumps(asdict(SessionParticipant(**document))), strict=True)
    except (TypeError, ValueError):
        return None


def _is_erasable_path(data_folder: Path, name: str) -> bool:
    """Whether a path stays within the data folder and outside all session folders, so that it may be erased."""
    path = PurePosixPath(name)
    if not path.parts or path.is_absolute() or ".." in path.parts:
        return False
    # Files in a session folder are erased with that folder, or belong to another participant.
    return not holds_session(data_folder / path.parts[0])
