"""Replies of a participant to a trial other than an answer: pause, leave, repeat, no answer in time.

Each makes the trial void. They are shared by the screens and by the line mode.
"""

from protocols.trial import VoidCause
from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.views import Unanswered

PAUSE = Unanswered("asked for a pause", ends_sitting=False, repeat_requested=True, pause=True)
"""The participant wants a pause: the trial is void and is presented again after the pause."""
LEAVING = Unanswered("asked to leave", ends_sitting=False, repeat_requested=True, pause=True)
"""The participant wants to leave. A single key must not end a sitting, so this reply starts a pause, in which leaving
is the first choice."""
REPEAT = Unanswered("asked to repeat", ends_sitting=False, repeat_requested=True)
"""The participant wants to feel the trial again: the trial is void and is presented again."""
TIME_OVER = Unanswered("no answer within the time limit", ends_sitting=False, cause=VoidCause.LATE)
"""No answer came within the protocol's time limit."""


def repeat_words(repeats_left: int | None, words: Words = ENGLISH_WORDS) -> str:
    """Text after a request to repeat a trial. repeats_left: number of requests allowed before this request; None: no
    limit."""
    if repeats_left is None:
        return words["repeat_new"]
    return words["repeat_last"] if repeats_left == 1 else words.fill_count("repeat", repeats_left - 1)
