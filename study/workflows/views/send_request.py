"""Send a request (stop, pause or note) to a running session in another process, and wait until it is received.

A request is a file in the session's folder (`RequestInbox`); the session removes it when it takes the request.
"""

from study.devices.clock import Clock
from study.errors import StudyError
from study.session.watching.requests import NoteAsked, Request, StopAsked
from study.store.sessions.archive import SessionFolder
from study.store.sessions.log_writer import is_log_locked
from study.store.sessions.request_inbox import RequestInbox

HEARD_WITHIN_S = 3.0
"""Longest wait for the session (s). It checks its inbox about twenty times a second, except while a form or notice is
shown."""
POLL_EVERY_S = 0.02
"""Interval (s) at which it is checked whether the request was taken."""


def send_request(folder: SessionFolder, request: Request, clock: Clock) -> bool:
    """Send a request. Returns True if the session received it, False for a note that stays in the inbox.

    Raises StudyError if the session is not running, the request cannot be written, or a stop or pause was not received
    in time. A stop then stays in the inbox; a pause is taken back. Where it is unknown whether the session is running
    (no file locks), the request is sent.
    """
    if is_log_locked(folder.log) is False:
        raise StudyError(
            "This session is not running",
            f"No program has {folder.name} open, so there is nothing to stop or to pause.",
            "Look at it with: hapteq watch " + str(folder.path),
        )
    inbox = RequestInbox(folder.path)
    name = inbox.send(request)
    until_s = clock.now_s() + HEARD_WITHIN_S
    while inbox.unread(name):
        if clock.now_s() >= until_s:
            return _unheard(folder, request, inbox, name)
        clock.sleep(POLL_EVERY_S)
    return True


def _unheard(folder: SessionFolder, request: Request, inbox: RequestInbox, name: str) -> bool:
    """Handle a request that was not received in time; returns and raises as `send_request`."""
    if isinstance(request, NoteAsked):
        return False
    waits = (
        f"{folder.name} accepted no request within {HEARD_WITHIN_S:g} s: a form or a notice is being read, or it hangs."
    )
    if isinstance(request, StopAsked):
        raise StudyError(
            "The session did not respond to the stop",
            waits,
            "If the handle moves: hand off, and switch the device off.",
            saved="The stop is kept, and is the first request that the session will receive.",
        )
    # A pause that begins minutes later would surprise participant and experimenter. If it cannot be taken back, the
    # session has taken it meanwhile.
    if not inbox.take_back(name):
        return True
    raise StudyError(
        "The session did not respond to the pause",
        waits,
        "Ask again when trials are running.",
        saved="Nothing is pending.",
    )
