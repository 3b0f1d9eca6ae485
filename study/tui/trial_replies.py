"""What a participant may say to a trial, or to anything that plays, beside an answer."""

from study.session.views import Unanswered

PAUSE = Unanswered("asked for a pause", leave=False, asked=True, pause=True)
LEAVING = Unanswered("asked to leave", leave=False, asked=True, pause=True)
"""One key must not end a sitting: a pause, in which leaving is offered first."""
REPEAT = Unanswered("asked to repeat", leave=False, asked=True)
TIME_OVER = Unanswered("no answer within the time limit", leave=False)
