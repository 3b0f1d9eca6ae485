"""A due trial as the participant sees it: everything that could give the answer away left out."""

from protocols.trial import Phase
from study.session.state.due_trial import Present, labels_are_swapped
from study.session.state.progress import progress
from study.session.state.state import SessionState, repeats_left
from study.session.views.views import Question, Task, picture_of


def question_of(state: SessionState, present: Present) -> Question:
    run = state.runs[present.run]
    alike = [other.index for other in state.runs if (other.phase, other.practice) == (run.phase, run.practice)]
    return Question(
        phase=run.phase,  # a catch trial is one of the test run's, as far as anybody can see
        run_number=1 + alike.index(present.run),
        runs_in_phase=len(alike),
        trial_number=present.trial + 1,
        repeated=present.attempt > 0,
        time_limit_s=state.protocol.trial.time_limit_s,
        picture=picture_of(state.protocol.directions, labels_are_swapped(state.protocol, state.opened)),
        task=Task.INTERVAL if run.phase is Phase.DETECTION else Task.DIRECTION,
        practice=run.practice,
        progress=progress(state),
        repeats_left=repeats_left(state),
    )
