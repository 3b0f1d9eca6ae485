"""Which participant of a protocol somebody is: chooses the row of a balanced order, and who has swapped labels."""

import tomllib
from pathlib import Path

from study.errors import StudyError
from study.session.events import SessionOpened
from study.store.archive import SessionFolder, session_folders
from study.store.event_log import read_opening
from study.store.withdrawal_files import Begun, begun_of_tombstone, read_intent


def participant_number(data: Path, subject: str, protocol: str, simulated: bool) -> int:
    """0 for the first participant of this protocol in the data folder; a returning one keeps the number.

    People and simulated participants are counted apart. Withdrawn ones keep their number, so that no row of a
    balanced order is given twice; folders that cannot be read are passed over.
    """
    numbers = []
    for folder in session_folders(data):
        begun = begun_in(folder)
        if begun is None or (begun.protocol, begun.simulated) != (protocol, simulated):
            continue
        if folder.subject == subject and not folder.withdrawn:
            return begun.number
        numbers.append(begun.number)
    return max(numbers, default=-1) + 1


def begun_in(folder: SessionFolder) -> Begun | None:
    """None where nothing was begun, or nothing can be read of it."""
    if folder.tombstone.exists():
        return begun_of_tombstone(folder)
    intent = read_intent(folder.path.parent, folder.subject)
    if intent is not None and folder.name in intent.sessions:
        return intent.sessions[folder.name]
    try:
        opening = read_opening(folder.log)
        if not isinstance(opening, SessionOpened):
            return None
        name = tomllib.loads(opening.protocol_text).get("name", "")
    except (StudyError, OSError, TypeError, ValueError, RecursionError):
        return None
    return Begun(name, opening.observer is not None, opening.participant_number)
