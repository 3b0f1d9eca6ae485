"""How far a session is, told without a hint at levels: from runs done and trials counted."""

import math
from statistics import median

from protocols.procedure.schedule import Run
from protocols.trial import Phase
from study.session.state.state import SessionState
from study.session.views.views import Progress

USUAL_TRIALS = 65
"""Of a staircase with 13 reversals; an able participant needs some 60, a guesser 110."""
USUAL_PER_REVERSAL = USUAL_TRIALS / 13


LATEST = 30
"""Answers whose pace counts."""
FIRST = 8
"""Answers before which nothing is said of time: the first ones are slow, and a long time left frightens."""


def progress(state: SessionState) -> Progress:
    """The time left goes by the latest answers' own pace, rests that are still to come added."""
    expected = [_usual_trials(state, run) for run in state.runs]
    done = sum(expected[: state.run])
    if not state.finished:
        # A long run must not seem to end: its next trial must not seem to be the last.
        done += min(state.trial, 0.95 * expected[state.run])
    share = done / sum(expected)
    return Progress(share_done=share, minutes_left=_minutes_left(state, sum(expected) - done))


def _usual_trials(state: SessionState, run: Run) -> float:
    protocol = state.protocol
    if run.practice:
        return protocol.practice.of_last
    usual = protocol.staircase.reversals * USUAL_PER_REVERSAL
    limit = protocol.training.trial_limit if run.phase is Phase.TRAINING else 0
    return min(usual, limit) if limit else usual


def _minutes_left(state: SessionState, trials_left: float) -> int | None:
    """By how long answers took, not by the clock: forms, instructions and pauses say nothing of what is left."""
    answered = state.answers - state.sitting.answers_before
    taken_s = [trial.response_time_s for trial in state.trials if trial.counts and trial.response_time_s is not None]
    if answered < FIRST or not taken_s:
        return None
    protocol = state.protocol
    each_s = median(taken_s[-LATEST:]) + protocol.stimulus.fade_out_s + protocol.trial.pause_between_s
    rests = sum(not run.practice for run in state.runs[state.run : -1]) * state.protocol.rests.after_run_s / 60
    return math.ceil(each_s / 60 * trials_left + rests)
