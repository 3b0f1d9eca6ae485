"""Replies of a participant to a trial or stimulus other than an answer."""

from protocols.trial import VoidCause
from study.session.views.views import Unanswered

PAUSE = Unanswered("asked for a pause", leave=False, asked=True, pause=True)
LEAVING = Unanswered("asked to leave", leave=False, asked=True, pause=True)
"""A single key must not end a sitting: it starts a pause, in which leaving is the first choice."""
REPEAT = Unanswered("asked to repeat", leave=False, asked=True)
TIME_OVER = Unanswered("no answer within the time limit", leave=False, cause=VoidCause.LATE)
NO_REPEATS = "No repeats are left in this run."


def repeat_words(repeats_left: int | None) -> str:
    """Text after a request to repeat. repeats_left: before that request."""
    if repeats_left is None:
        return "A new trial comes."
    more = {0: "no more repeats", 1: "1 more repeat"}.get(repeats_left - 1, f"{repeats_left - 1} more repeats")
    return f"The same vibration comes again. {more.capitalize()} in this run."
