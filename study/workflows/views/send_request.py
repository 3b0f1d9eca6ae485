"""Send a request (stop, pause or note) to a running session in another process, and wait until it is received.

A request is a file in the session's folder (`RequestInbox`); the session removes it when it takes the request.
"""

import shlex

from study.devices.clock import Clock
from study.errors import StudyError
from study.session.watching.requests import NoteAsked, Request, StopAsked
from study.store.sessions.archive import SessionFolder
from study.store.sessions.log_lock import is_log_locked
from study.store.sessions.request_inbox import RequestInbox

RECEIVE_TIMEOUT_S = 3.0
"""Longest wait (s) until the session receives the request. Chosen: it reads its inbox several times a second, except
while it checks the device."""
POLL_INTERVAL_S = 0.02
"""Interval (s) at which the sender checks whether the request was received. Chosen below the session's interval."""


def send_request(folder: SessionFolder, request: Request, clock: Clock) -> bool:
    """Send a request. Returns True if the session received it, False for a note that stays in the inbox.

    Raises StudyError if the session is not running, the request cannot be written, or a stop or pause was not received
    in time. A stop then stays in the inbox; a pause is withdrawn. Where file locks are not supported, it is unknown
    whether the session is running, and the request is sent.
    """
    if is_log_locked(folder.log) is False:
        raise StudyError(
            "This session is not running",
            f"No program has {folder.name} open, so there is nothing to stop or to pause.",
            f"Look at it with: hapteq watch {shlex.quote(str(folder.path))}",
        )
    inbox = RequestInbox(folder.path)
    request_name = inbox.send(request)
    deadline_s = clock.now_s() + RECEIVE_TIMEOUT_S
    while inbox.is_unread(request_name):
        if clock.now_s() >= deadline_s:
            return _handle_timeout(folder, request, inbox, request_name)
        clock.sleep(POLL_INTERVAL_S)
    return True


def _handle_timeout(folder: SessionFolder, request: Request, inbox: RequestInbox, request_name: str) -> bool:
    """Leave or withdraw a request that was not received in time; returns and raises as `send_request`."""
    if isinstance(request, NoteAsked):
        return False
    explanation = (
        f"{folder.name} accepted no request within {RECEIVE_TIMEOUT_S:g} s: it checks its device, or it hangs."
    )
    if isinstance(request, StopAsked):
        raise StudyError(
            "The session did not respond to the stop",
            explanation,
            "If the handle moves: hand off, and switch the device off.",
            saved="The stop is kept, and is the first request that the session will receive.",
        )
    # A pause is withdrawn, because it would be unexpected minutes later. If that fails, the session has received it in
    # the meantime.
    if not inbox.take_back(request_name):
        return True
    raise StudyError(
        "The session did not respond to the pause",
        explanation,
        "Ask again when trials are running.",
        saved="Nothing is pending.",
    )
