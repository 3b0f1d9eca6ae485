"""Replies of a participant to a trial other than an answer: pause, leave, repeat, no answer in time.

Each makes the trial void.
"""

from protocols.trial import VoidCause
from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import Unanswered

PAUSE = Unanswered("asked for a pause", ends_sitting=False, repeat_requested=True, pause=True)
"""Request for a pause: the trial is presented again after the pause."""
LEAVING = Unanswered("asked to leave", ends_sitting=False, repeat_requested=True, pause=True)
"""Request to leave. A single key must not end a sitting, so this reply starts a pause, in which leaving is the first
choice."""
REPEAT = Unanswered("asked to repeat", ends_sitting=False, repeat_requested=True)
"""Request to feel the stimulus again: the trial is presented again."""
TIME_OVER = Unanswered("no answer within the time limit", ends_sitting=False, cause=VoidCause.LATE)


def format_repeat_text(repeats_left: int | None, words: Words = ENGLISH_WORDS) -> str:
    """Format the confirmation of a request to repeat a trial, with the number of further requests. repeats_left: number
    of allowed requests, this one included, at least 1; None: no limit."""
    if repeats_left is None:
        return words["repeat_new"]
    return words["repeat_last"] if repeats_left == 1 else words.fill_count("repeat", repeats_left - 1)
