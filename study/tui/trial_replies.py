"""What a participant may say to a trial, or to anything that plays, beside an answer."""

from protocols.trial import VoidCause
from study.session.views.views import Unanswered

PAUSE = Unanswered("asked for a pause", leave=False, asked=True, pause=True)
LEAVING = Unanswered("asked to leave", leave=False, asked=True, pause=True)
"""One key must not end a sitting: a pause, in which leaving is offered first."""
REPEAT = Unanswered("asked to repeat", leave=False, asked=True)
TIME_OVER = Unanswered("no answer within the time limit", leave=False, cause=VoidCause.LATE)
NO_REPEATS = "No repeats are left in this run."


def repeat_words(repeats_left: int | None) -> str:
    """What is said when the participant has asked for the trial again. repeats_left: before that."""
    if repeats_left is None:
        return "A new trial comes."
    more = {0: "no more repeats", 1: "1 more repeat"}.get(repeats_left - 1, f"{repeats_left - 1} more repeats")
    return f"The same vibration comes again. {more.capitalize()} in this run."
