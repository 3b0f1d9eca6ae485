"""Find and assign the participant number within a protocol (logged as "place"): it selects the row of the balanced
order, and which direction is labelled 1.

A person's number is assigned after the preparation: persons who refuse or are excluded take no row. Logs are
searched as raw bytes where possible, because a data folder may hold many long logs, some of them damaged.
"""

import re
import tomllib
from pathlib import Path

from study.errors import StudyError
from study.regular_file import read_regular
from study.session.facts.events import PlaceTaken, SessionOpened, parse_event
from study.session.facts.log_chain import Chain, verify_checksum
from study.session.state.rules import is_place_assigned_later
from study.session.state.state import SessionState
from study.store.sessions.archive import SessionFolder, list_session_folders
from study.store.sessions.event_log import read_opening
from study.store.sessions.session_lock import hold_places_lock
from study.store.sessions.withdrawal_files import SessionParticipant, read_intent, read_participant
from study.workflows.trial.sitting import Sitting, log_and_apply

PLACE_TAKEN_BYTES = b'"event":"place_taken"'
"""Part of a log line whose event assigns the participant number."""
NUMBER_PATTERN = re.compile(rb'"participant_number":(\d{1,6})\b')
"""Participant number in a log: in the first line, or in the event that replaces it. The last occurrence counts."""
PROTOCOL_NAME_PATTERN = re.compile(rb'(?:\\n|")name = \\"([^"\\]*)\\"')
"""Name of the protocol in the first line of a log, which contains the protocol's TOML text as a JSON string."""
PERSON_OBSERVER_BYTES = b'"observer":null'
"""Part of the first line of the log of a person's session."""
TRIAL_PRESENTED_BYTES = b'"event":"trial_presented"'
"""Part of a log line that presents a trial; the first such line ends the preparation."""


def find_participant_number(data: Path, subject: str, protocol: str, simulated: bool) -> int:
    """Find the number of a participant in this protocol, from 0: a returning participant keeps it, a new one gets the
    number after the largest taken one. data: data folder; subject: participant code; protocol: its name.

    People and simulated participants are counted separately. A person who refused, was excluded, or left before the
    number was assigned has none. Numbers of withdrawn participants, and of damaged logs as far as they are readable,
    stay taken, so that no row of the balanced order is assigned twice.
    """
    taken_numbers = []
    for folder in list_session_folders(data):
        participant = read_begun_participant(folder)
        if (
            participant is None
            or participant.number is None
            or (participant.protocol, participant.simulated) != (protocol, simulated)
        ):
            continue
        if folder.subject == subject and not folder.withdrawn:
            return participant.number
        taken_numbers.append(participant.number)
    return max(taken_numbers, default=-1) + 1


def read_begun_participant(folder: SessionFolder) -> SessionParticipant | None:
    """Read protocol, kind and number of a session's participant, from its tombstone, a withdrawal that was begun, or
    its log. None if no session was begun or nothing can be read."""
    if folder.tombstone.exists():
        return read_participant(folder)
    intent = read_intent(folder.path.parent, folder.subject)
    if intent is not None and folder.name in intent.sessions:
        return intent.sessions[folder.name]
    try:
        session_opened = read_opening(folder.log)
        if not isinstance(session_opened, SessionOpened):
            return None
        protocol_name = tomllib.loads(session_opened.protocol_text).get("name", "")
    except (StudyError, OSError, TypeError, ValueError, RecursionError):
        return _read_damaged_log(folder)
    return SessionParticipant(
        protocol_name, session_opened.observer is not None, _read_assigned_number(folder, session_opened)
    )


def _read_damaged_log(folder: SessionFolder) -> SessionParticipant | None:
    """Read the participant of a damaged log from its bytes; None where name or number are not found. A number that
    stays taken wrongly costs a row of the balanced order; a number assigned twice would destroy the balance."""
    try:
        content = read_regular(folder.log)
    except OSError:
        return None
    first_line = content.partition(b"\n")[0]
    protocol_name, numbers = PROTOCOL_NAME_PATTERN.search(first_line), NUMBER_PATTERN.findall(content)
    if protocol_name is None or not numbers:
        return None
    return SessionParticipant(
        protocol_name[1].decode(errors="replace"), PERSON_OBSERVER_BYTES not in first_line, int(numbers[-1])
    )


def _read_assigned_number(folder: SessionFolder, session_opened: SessionOpened) -> int | None:
    """Read the participant number from the lines before the first trial, so that the rest of a long log is not parsed;
    the number expected at the opening where a trial comes first or a line is damaged. None if it was not assigned yet,
    or the log cannot be read."""
    if not is_place_assigned_later(session_opened):
        return session_opened.participant_number
    chain = Chain()
    try:
        for line in read_regular(folder.log).split(b"\n")[:-1]:
            if TRIAL_PRESENTED_BYTES in line:
                return session_opened.participant_number
            chain, event_bytes = verify_checksum(chain, line)
            if PLACE_TAKEN_BYTES in line and isinstance(assignment_event := parse_event(event_bytes), PlaceTaken):
                return assignment_event.participant_number
    except OSError:
        return None
    except ValueError:  # damaged before the first trial: the number expected at the opening was most likely assigned
        return session_opened.participant_number
    return None


def assign_place(state: SessionState, sitting: Sitting) -> SessionState:
    """Assign the participant number and log it, once, after the preparation was passed; otherwise the state is
    unchanged. A lock of the data folder prevents that two programs assign the same number. Raises StudyError."""
    if not is_place_assigned_later(state.opened) or state.has_final_place:
        return state
    data = sitting.folder.path.parent
    with hold_places_lock(data):
        number = find_participant_number(data, state.opened.subject, state.protocol.name, simulated=False)
        return log_and_apply(state, PlaceTaken(utc=sitting.clock.utc(), participant_number=number), sitting)
