"""A question of a trial."""

from protocols.trial import Phase
from study.session.views.participant_views import DirectionPicture, Progress, Question

PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, 2, 5, 7, False, 0.0, PICTURE, progress=Progress(0.42, 12))
