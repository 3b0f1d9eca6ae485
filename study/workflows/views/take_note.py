"""Write a note into the log of a session (`hapteq note`).

A log has a single writer. While a session runs, its program is that writer, and the note is sent to it as a request;
otherwise the note is appended directly, with the session's lock held.
"""

from study.devices.clock import Clock
from study.errors import StudyError
from study.session.facts.events import NoteTaken
from study.session.watching.requests import NoteAsked
from study.store.disk.text_file import replace_invalid_bytes
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog, remove_incomplete_line
from study.store.sessions.log_lock import is_log_locked
from study.store.sessions.log_seal import seal_log
from study.store.sessions.request_inbox import RequestInbox
from study.store.sessions.session_lock import hold_session_lock
from study.workflows.results.fold_session import fold_session
from study.workflows.views.send_request import send_request


def take_note(folder: SessionFolder, note: NoteAsked, clock: Clock) -> bool:
    """Write a note. Returns True if it was appended to the log or the running session received it, False if it waits in
    the inbox of the running session.

    Before it is appended, an incomplete last line of the log is removed, and notes are appended that an ended session
    left in its inbox; afterwards a closed session is sealed again.
    Raises StudyError for an empty text or one that is not UTF-8, where the log cannot be read or written, and where
    another program holds the session's lock.
    """
    if not note.text.strip():
        raise StudyError("There is nothing to note", "The text is empty.", "Give a sentence.")
    if note.text != replace_invalid_bytes(note.text):
        raise StudyError(
            "This note cannot be written",
            "Its text holds bytes that are not UTF-8.",
            "Type it again.",
            saved="Nothing was changed.",
        )
    is_sent = is_log_locked(folder.log) is True
    if is_sent and send_request(folder, note, clock):
        return True
    if is_sent and is_log_locked(folder.log):
        return False
    # The session does not run, or ended before it received the note, which then waits in the inbox.
    try:
        _append_notes(folder, () if is_sent else (note,), clock)
    except StudyError as error:
        if is_sent:
            error.saved = "The note is kept in the session's folder, and need not be written again."
        raise
    return True


def _append_notes(folder: SessionFolder, notes: tuple[NoteAsked, ...], clock: Clock) -> None:
    """Append the notes of the inbox, then these, to the log of a session that does not run. Raises as `take_note`."""
    with hold_session_lock(folder.path):
        log = EventLog.reopen(folder.log)
        try:
            folded_session = fold_session(folder)
            log_contents = folded_session.log_contents
            if log_contents.torn:
                remove_incomplete_line(folder.log, log_contents)
                cut_text = f"a torn last line was cut off: {log_contents.torn}"
                log.append(NoteTaken(utc=clock.utc(), who="program", text=cut_text))
            inbox = RequestInbox(folder.path)
            inbox.clear()
            waiting_notes = [request for request in inbox.take(max_files=None) if isinstance(request, NoteAsked)]
            for note in (*waiting_notes, *notes):
                log.append(NoteTaken(utc=clock.utc(), who=note.who, text=note.text, adverse=note.adverse))
                inbox.forget_logged(note)
            if folded_session.state.closed:
                seal_log(folder.log)
        finally:
            log.close()
