"""Replies of a participant to a trial or stimulus other than an answer."""

from protocols.trial import VoidCause
from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.views import Unanswered

PAUSE = Unanswered("asked for a pause", leave=False, asked=True, pause=True)
"""The participant wants a pause: the trial is void and comes again after it."""
LEAVING = Unanswered("asked to leave", leave=False, asked=True, pause=True)
"""A single key must not end a sitting: it starts a pause, in which leaving is the first choice."""
REPEAT = Unanswered("asked to repeat", leave=False, asked=True)
"""The participant wants to feel the trial again: it is void and comes again."""
TIME_OVER = Unanswered("no answer within the time limit", leave=False, cause=VoidCause.LATE)
"""The protocol's time limit for an answer passed."""


def repeat_words(repeats_left: int | None, words: Words = ENGLISH_WORDS) -> str:
    """Text after a request to repeat. repeats_left: before that request."""
    if repeats_left is None:
        return words["repeat_new"]
    return words["repeat_last"] if repeats_left == 1 else words.counted("repeat", repeats_left - 1)
