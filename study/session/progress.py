"""How far a session is, told without a hint at levels: from runs done and trials counted."""

import math

from protocols.schedule import Run
from protocols.trial import Phase
from study.session.sitting_state import minutes_between
from study.session.state import SessionState
from study.session.views import Progress

USUAL_TRIALS = 65
"""Of a staircase with 13 reversals; an able participant needs some 60, a guesser 110."""
USUAL_PER_REVERSAL = USUAL_TRIALS / 13


def progress(state: SessionState, utc: str) -> Progress:
    """utc: now. The time left goes by this sitting's own pace, rests that are still to come added."""
    expected = [_usual_trials(state, run) for run in state.runs]
    done = sum(expected[: state.run])
    if not state.finished:
        # A long run must not seem to end: nobody should count on its next trial being the last.
        done += min(state.trial, 0.95 * expected[state.run])
    share = done / sum(expected)
    return Progress(share_done=share, minutes_left=_minutes_left(state, utc, sum(expected) - done))


def _usual_trials(state: SessionState, run: Run) -> float:
    protocol = state.protocol
    if run.practice:
        return protocol.practice.of_last
    usual = protocol.staircase.reversals * USUAL_PER_REVERSAL
    limit = protocol.training.trial_limit if run.phase is Phase.TRAINING else 0
    return min(usual, limit) if limit else usual


def _minutes_left(state: SessionState, utc: str, trials_left: float) -> int | None:
    minutes = minutes_between(state.sitting.began_utc, utc)
    answered = state.answers - state.sitting.answers_before
    if answered < 5 or minutes <= 0:
        return None
    rests = sum(not run.practice for run in state.runs[state.run : -1]) * state.protocol.rests.after_run_s / 60
    return math.ceil(minutes / answered * trials_left + rests)
