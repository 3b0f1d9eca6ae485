"""Progress of a session from completed runs and counted trials, without revealing levels."""

import math
from statistics import median

from protocols.procedure.schedule import Run
from protocols.trial import Phase
from study.session.state.state import SessionState
from study.session.views.views import Progress

USUAL_TRIALS = 65
"""Trials of a staircase with 13 reversals; 60 with few errors, 110 for guessing."""
USUAL_PER_REVERSAL = USUAL_TRIALS / 13
"""Trials per reversal."""


LATEST = 30
"""Number of latest answers that give the pace."""
FIRST = 8
"""No time is estimated before this many answers: the first ones are slow."""


def progress(state: SessionState) -> Progress:
    """Share done, and minutes left at the pace of the latest answers, pending rests included."""
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
    rule = protocol.staircase
    usual = rule.bayesian.trials if rule.is_bayesian else rule.reversals * USUAL_PER_REVERSAL
    limit = protocol.training.trial_limit if run.phase is Phase.TRAINING else 0
    return min(usual, limit) if limit else usual


def _minutes_left(state: SessionState, trials_left: float) -> int | None:
    """Minutes left, estimated from the duration of answers, not from the clock: forms, instructions and pauses do not
    predict the rest."""
    answered = state.answers - state.sitting.answers_before
    taken_s = [trial.response_time_s for trial in state.trials if trial.counts and trial.response_time_s is not None]
    if answered < FIRST or not taken_s:
        return None
    protocol = state.protocol
    each_s = median(taken_s[-LATEST:]) + protocol.stimulus.fade_out_s + protocol.trial.pause_between_s
    rests = sum(not run.practice for run in state.runs[state.run : -1]) * state.protocol.rests.after_run_s / 60
    return math.ceil(each_s / 60 * trials_left + rests)
